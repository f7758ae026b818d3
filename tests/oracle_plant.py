"""A plant of all kinds of actuator, written apart from the library: it judges what the library
answers.

It reads a layout file's mapping as a stranger would and follows the formulas in the documentation.
Commands are arrays (n, 3): fin (half amplitude [rad], frequency [Hz], zero direction [rad]),
thruster (force [N], 0, 0), azimuth (angle [rad], force [N], 0), rudder (deflection [rad], 0, 0),
propeller with a rudder (deflection [rad], thrust [N], 0).
"""

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import j1

from finlab.arrays import Array

DENSITY = 1000.0
"""Density of water [kg/m3]."""
LIMIT_KEYS = ("amplitude_rad", "frequency_hz", "zero_direction_rad")
"""Keys of a fin's limits in a layout file, in the order of its command."""
NOMINAL = ((0.05, 0.6), (0.1, 2.1), (-math.pi, math.pi))
"""Limits of a fin, where a file gives none."""
SERVO = {"amplitude_rate_rad_s": 1.0, "frequency_rate_hz_s": 3.0, "direction_rate_rad_s": 5.0}
"""How fast a fin's command changes at most, where a file says nothing."""
FIN_DEFAULTS: Mapping[str, Mapping[str, float]] = {
    "drag": {"drag_coefficient": 0.15, "area": 0.02, "lever": 0.1},
    "lighthill": {"length": 0.2, "width": 0.1},
    "soft": {"k": 3.6, "p": 1.0, "x0": 1.3, "q": 5.0, "e": 0.0, "phi_e": 0.0, "d": 0.0},
}
"""Kind of fin model -> constants that a layout file may leave out."""


class OracleActuator:
    """One actuator of a layout file: its set of forces, its watts, and its effectiveness.

    A force is a size along a direction of the actuator's own plane (angle [rad]); a thruster or a
    rudder has the two angles 0 and pi.
    """

    def __init__(
        self,
        spec: Mapping[str, Any],
        flow: ArrayLike | None = None,
        box: tuple[Array, Array] | None = None,
    ) -> None:
        self.spec = spec
        self.name = str(spec["name"])
        self._box = box
        self.flow = np.zeros(6) if flow is None else np.asarray(flow, np.float64)
        self.kind = "azimuth" if spec["type"] == "tilt" else str(spec["type"])
        self.model = dict(spec.get("model", {"type": "drag"}))
        self.position = np.array(spec["position_m"], np.float64)
        self.first, self.second = self._plane()
        wrench = np.stack([self._column(self.first), self._column(self.second)], axis=-1)
        self.effectiveness = wrench[:, :1] if self.kind == "thruster" else wrench
        """Wrench (6, 1 or 2) of 1 N along the own directions."""

    def _plane(self) -> tuple[Array, Array]:
        """Directions (3,) of zero and of a quarter turn, in which the actuator pushes."""
        spec = self.spec
        if self.kind == "thruster":
            return np.array(spec["axis"], np.float64), np.zeros(3)
        if "mounting_angle_deg" in spec:
            angle = math.radians(spec["mounting_angle_deg"])
            return np.array([-math.sin(angle), math.cos(angle), 0.0]), np.array([0.0, 0.0, 1.0])
        about = np.array(spec["turn_axis" if self.kind == "azimuth" else "shaft"], np.float64)
        zero = np.array(spec["zero"], np.float64)
        across = np.cross(about, zero)
        return zero, across

    def _column(self, direction: Array) -> Array:
        """Wrench (6,) of a newton in a direction (3,)."""
        reaction = float(self.spec.get("torque_per_newton_m", 0.0))
        return np.concatenate(
            [direction, np.cross(self.position, direction) + reaction * direction]
        )

    @property
    def limits(self) -> tuple[Array, Array]:
        """Least and largest command (3,)."""
        if self._box is not None:
            return self._box
        spec = self.spec
        if self.kind == "fin":
            keys = ("amplitude_rad", "frequency_hz", "zero_direction_rad")
            ends = [
                spec.get("limits", {}).get(key, default)
                for key, default in zip(keys, NOMINAL, strict=True)
            ]
        elif self.kind == "azimuth":
            ends = [np.radians(spec.get("arc_deg", [-180.0, 180.0])), spec["force_n"], (0.0, 0.0)]
        elif self.kind == "thruster":
            ends = [spec["force_n"], (0.0, 0.0), (0.0, 0.0)]
        elif self.kind == "propeller_rudder":
            deflection = np.radians(spec.get("deflection_deg", [-30.0, 30.0]))
            ends = [deflection, spec["force_n"], (0.0, 0.0)]
        else:
            ends = [np.radians(spec["deflection_deg"]), (0.0, 0.0), (0.0, 0.0)]
        low, high = np.array(ends, np.float64).T
        return low, high

    @property
    def turns_fully(self) -> bool:
        """Whether the direction goes round the whole circle."""
        low, high = self.limits
        turn = {"fin": 2, "azimuth": 0}.get(self.kind)
        return turn is not None and bool(high[turn] - low[turn] >= 2.0 * math.pi - 1e-6)

    @property
    def dead_band(self) -> float:
        """Force [N] below which a thruster gives none."""
        return float(self.spec.get("dead_band_n", 0.0))

    # ---- fins
    # -----------------------------------------------------------------------------------------
    def _of(self, key: str) -> float:
        """A constant of the fin's model."""
        return float(self.model.get(key, FIN_DEFAULTS[self.model["type"]][key]))

    def thrust(self, amplitude: ArrayLike, frequency: ArrayLike) -> Array:
        """Thrust [N] of a fin, its unevenness left out."""
        a = np.asarray(amplitude, np.float64)
        f = np.asarray(frequency, np.float64)
        if self.model["type"] == "drag":
            scale = (
                2.0
                * DENSITY
                * self._of("drag_coefficient")
                * self._of("area")
                * self._of("lever") ** 2
            )
            return scale * (2.0 * math.pi * f) ** 2 * (1.0 - np.cos(2.0 * a))
        if self.model["type"] == "lighthill":
            mass = math.pi / 4.0 * DENSITY * self._of("width") ** 2
            return 0.5 * mass * (self._of("length") * 2.0 * math.pi * f) ** 2 * a * j1(a)
        x = a * f
        return np.asarray(
            self._of("k") * x ** self._of("p") / (1.0 + (x / self._of("x0")) ** self._of("q"))
        )

    def unevenness(self, direction: ArrayLike) -> Array:
        """By what the thrust of a fin is larger at a zero direction [rad]."""
        phi = np.asarray(direction, np.float64)
        if self.kind != "fin" or self.model["type"] != "soft":
            return np.ones(phi.shape)
        return 1.0 + self._of("e") * np.cos(phi - self._of("phi_e"))

    @property
    def lean(self) -> float:
        """Angle [rad] from a fin's zero direction to its thrust."""
        return self._of("d") if self.kind == "fin" and self.model["type"] == "soft" else 0.0

    def beating(self, amplitude: ArrayLike, frequency: ArrayLike) -> Array:
        """Mean watts of a plate that beats about one edge; what braking gives back is lost."""
        a = np.asarray(amplitude, np.float64)
        f = np.asarray(frequency, np.float64)
        length = 0.2
        width = 0.1
        if self.model["type"] == "drag":
            length = 2.0 * self._of("lever")
            width = self._of("area") / length
        elif self.model["type"] == "lighthill":
            length = self._of("length")
            width = self._of("width")
        own = 0.0097 * (length / 0.2) ** 3 * (width / 0.1)
        inertia = own + math.pi / 4.0 * DENSITY * width**2 * length**3 / 3.0
        drag = DENSITY * 2.0 * width * length**4 / 8.0
        # Half a beat does work from one end up to where the drag no longer outweighs the inertia:
        # sin = end.
        ratio = drag * a / inertia
        end = np.where(ratio > 0.0, 2.0 * ratio / (1.0 + np.sqrt(1.0 + 4.0 * ratio**2)), 0.0)
        half = 0.5 * inertia * (1.0 - end**2) + drag * a * (end - end**3 / 3.0 + 2.0 / 3.0)
        return np.asarray(2.0 * f * (2.0 * math.pi * f * a) ** 2 * half)

    # ---- rudders
    # --------------------------------------------------------------------------------------
    def foil(self, deflection: Array) -> tuple[Array, Array]:
        """Force (..., 2) [N] in the own plane and watts (...,) of deflections [rad] in the flow."""
        spec = self.spec
        through = self.flow[:3] + np.cross(self.flow[3:], self.position)
        ahead = float(through @ self.first)
        aside = float(through @ self.second)
        speed = math.hypot(ahead, aside)
        if speed == 0.0:
            return np.zeros((*deflection.shape, 2)), np.zeros(deflection.shape)
        course = np.array([ahead, aside]) / speed
        lift, drag = self.foil_coefficients(deflection - math.atan2(aside, ahead))
        pressure = 0.5 * spec.get("density_kg_m3", DENSITY) * speed**2 * spec["area_m2"]
        across = np.array([-course[1], course[0]])
        force = pressure * (lift[..., None] * across - drag[..., None] * course)
        return force, pressure * drag * speed

    def foil_coefficients(self, angle: Array) -> tuple[Array, Array]:
        """Lift and drag coefficients (...,) of a foil at angles (...,) from the flow [rad]."""
        spec = self.spec
        ratio = spec["aspect_ratio"]
        slope = 1.8 * math.pi * ratio / (math.sqrt(ratio**2 + 4.0) + 1.8)
        stall = math.radians(spec.get("stall_deg", math.degrees(0.47)))
        angle = np.arctan(np.tan(angle))  # astern is as good as ahead
        ends = (
            np.exp(np.clip(-50.0 * (angle - stall), -600, 600)),
            np.exp(np.clip(50.0 * (angle + stall), -600, 600)),
        )
        parted = (1.0 + ends[0] + ends[1]) / ((1.0 + ends[0]) * (1.0 + ends[1]))
        lift = (1.0 - parted) * slope * angle + parted * 2.0 * np.sign(angle) * np.sin(
            angle
        ) ** 2 * np.cos(angle)
        drag = spec.get("drag_coefficient", 0.0065) + parted * 2.0 * np.sin(angle) ** 2
        drag = drag + (1.0 - parted) * (slope * angle) ** 2 / (0.9 * math.pi * ratio)
        return lift, drag

    def steered(self, deflection: Array, thrust: Array) -> Array:
        """Force (..., 2) [N] of a propeller and of the rudder in its slipstream, in the own plane.

        The slipstream has the speed sqrt(V^2 + 2 T / (rho A)), by momentum theory; a share of the
        dynamic pressure that it adds meets the rudder.
        """
        spec = self.spec
        density = spec.get("density_kg_m3", DENSITY)
        disc = math.pi * spec["diameter_m"] ** 2 / 4.0
        share = spec.get("slipstream", 1.0)
        through = self.flow[:3] + np.cross(self.flow[3:], self.position)
        V = max(float(through @ self.first), 0.0)
        slipstream_squared = V**2 + 2.0 * thrust / (density * disc)
        added = 0.5 * density * (slipstream_squared - V**2)
        pressure = np.maximum(0.5 * density * V**2 + share * added, 0.0)
        lift, drag = self.foil_coefficients(deflection)
        along = thrust - pressure * spec["area_m2"] * drag
        return np.stack([along, pressure * spec["area_m2"] * lift], axis=-1)

    # ---- any kind
    # -------------------------------------------------------------------------------------
    def propeller_watts(self, force: ArrayLike) -> Array:
        """Watts of a propeller for a force [N]."""
        size = np.asarray(force, np.float64)
        scale = np.where(
            size > 0.0, self.model["forward"], self.model.get("reverse", self.model["forward"])
        )
        return np.asarray(scale * np.abs(size) ** self.model.get("exponent", 1.5))

    def own_force(self, command: Array) -> Array:
        """Force (..., 2) [N] in the own plane of commands (..., 3)."""
        if self.kind == "thruster":
            force = np.where(np.abs(command[..., 0]) < self.dead_band, 0.0, command[..., 0])
            return np.stack([force, np.zeros_like(force)], axis=-1)
        if self.kind == "rudder":
            return self.foil(command[..., 0])[0]
        if self.kind == "propeller_rudder":
            return self.steered(command[..., 0], command[..., 1])
        if self.kind == "azimuth":
            size = command[..., 1]
            angle = command[..., 0]
        else:
            size = self.thrust(command[..., 0], command[..., 1]) * self.unevenness(command[..., 2])
            angle = command[..., 2] + self.lean
        return np.stack([size * np.cos(angle), size * np.sin(angle)], axis=-1)

    def force(self, command: Array) -> Array:
        """Force (..., 3) [N] in the body frame."""
        own = self.own_force(command)
        return own[..., :1] * self.first + own[..., 1:] * self.second

    def watts(self, command: Array) -> Array:
        """Watts (...,) of commands (..., 3)."""
        if self.kind == "fin":
            return self.beating(command[..., 0], command[..., 1])
        if self.kind == "rudder":
            return self.foil(command[..., 0])[1]
        thruster = self.kind == "thruster"
        return self.propeller_watts(
            self.own_force(command)[..., 0] if thruster else command[..., 1]
        )

    def excess(self, command: Array) -> float:
        """By how much a command (3,) is outside the limits; a full circle has none."""
        low, high = self.limits
        over = np.maximum(np.maximum(low - command, command - high), 0.0)
        if self.turns_fully:
            over[2 if self.kind == "fin" else 0] = 0.0
        return float(over.max())

    @property
    def rates(self) -> Array:
        """How fast a command (3,) changes at most [per second]."""
        spec = self.spec
        if self.kind == "fin":
            return np.array([spec.get("servo", {}).get(key, value) for key, value in SERVO.items()])
        force = spec.get("rate_n_s", np.inf)
        turn = math.radians(spec.get("turn_rate_deg_s", np.inf))
        if self.kind == "rudder":
            return np.array([math.radians(spec.get("rate_deg_s", np.inf)), np.inf, np.inf])
        turns = self.kind in ("azimuth", "propeller_rudder")
        return np.array([turn, force, np.inf] if turns else [force, np.inf, np.inf])

    def rate_excess(self, previous: Array, command: Array, period_s: float) -> float:
        """By what share of its largest step a command (3,) goes beyond what may follow a previous
        one."""
        change = command - previous
        turn = {"fin": 2, "azimuth": 0}.get(self.kind)
        if turn is not None and self.turns_fully:
            change[turn] = (change[turn] + math.pi) % (2.0 * math.pi) - math.pi
        return float((np.abs(change) / (self.rates * period_s)).max() - 1.0)

    def after(self, previous: Array, period_s: float) -> "OracleActuator":
        """The actuator with only the commands that may follow a previous one (3,) after a time
        [s]."""
        low, high = self.limits
        step = self.rates * period_s
        turn = {"fin": 2, "azimuth": 0}.get(self.kind)
        near = np.maximum(low, previous - step)
        far = np.minimum(high, previous + step)
        if turn is not None and self.turns_fully:
            whole = step[turn] >= math.pi
            near[turn] = low[turn]
            far[turn] = high[turn]
            if not whole:
                near[turn] = previous[turn] - step[turn]
                far[turn] = previous[turn] + step[turn]
        return OracleActuator(self.spec, self.flow, (near, far))

    def draw(self, rng: np.random.Generator, share: float = 1.0, count: int = 1) -> Array:
        """Commands (count, 3), uniform in the limits, the size of the force up to a share of its
        range."""
        low, high = self.limits
        top = high.copy()
        if self.kind == "fin":
            top[:2] = low[:2] + share * (high - low)[:2]
        elif self.kind == "azimuth":
            top[1] = low[1] + share * (high - low)[1]
        elif self.kind == "propeller_rudder":
            low = low * [1.0, share, 1.0]
            top[1] = share * high[1]
        elif low[0] < 0.0 < high[0]:
            low = share * low
            top = share * high
        else:
            top[0] = low[0] + share * (high - low)[0]
        return low + rng.random((count, 3)) * (top - low)


class OraclePlant:
    """All actuators of a layout file, in a flow: the velocity (6,) through the water, none by
    default."""

    def __init__(self, layout: Mapping[str, Any], flow: ArrayLike | None = None) -> None:
        self.layout = layout
        self.flow = flow
        self.actuators = tuple(OracleActuator(spec, flow) for spec in layout["actuators"])

    @cached_property
    def effectiveness(self) -> Array:
        """Wrench (6, m) of 1 N along each own direction, actuator after actuator."""
        return np.concatenate([each.effectiveness for each in self.actuators], axis=1)

    def wrench(self, commands: Array) -> Array:
        """Wrench (..., 6) of commands (..., n, 3); NaN rows give nothing."""
        total = np.zeros((*commands.shape[:-2], 6))
        for i, each in enumerate(self.actuators):
            given = np.where(np.isfinite(commands[..., i, :]), commands[..., i, :], 0.0)
            own = each.own_force(given)[..., : each.effectiveness.shape[1]]
            alive = np.isfinite(commands[..., i, :1])
            total += np.where(alive, own @ each.effectiveness.T, 0.0)
        return total

    def power(self, commands: Array) -> float:
        """Watts of commands (n, 3); NaN rows take none."""
        return float(self.powers(commands).sum())

    def powers(self, commands: Array) -> Array:
        """Watts (n,) of each actuator at commands (n, 3); NaN rows take none."""
        pairs = zip(self.actuators, commands, strict=True)
        watts = [each.watts(row) if np.isfinite(row).all() else 0.0 for each, row in pairs]
        return np.array(watts)

    def excess(self, commands: Array) -> float:
        """By how much commands (n, 3) break a limit at most."""
        pairs = zip(self.actuators, commands, strict=True)
        return max((each.excess(row) for each, row in pairs if np.isfinite(row).all()), default=0.0)

    def rate_excess(self, previous: Array, commands: Array, period_s: float) -> float:
        """By what share of its largest step a command goes beyond what may follow a previous one,
        at most."""
        rows = zip(self.actuators, previous, commands, strict=True)
        return max(each.rate_excess(before, now, period_s) for each, before, now in rows)

    def after(self, previous: Array, period_s: float) -> "OraclePlant":
        """The plant with only the commands that may follow previous ones (n, 3) after a time
        [s]."""
        other = OraclePlant(self.layout, self.flow)
        rows = zip(self.actuators, previous, strict=True)
        other.actuators = tuple(each.after(row, period_s) for each, row in rows)
        other.scales = self.scales
        return other

    def draw(self, rng: np.random.Generator, share: float = 1.0) -> Array:
        """Commands (n, 3) within limits."""
        return np.stack([each.draw(rng, share)[0] for each in self.actuators])

    @cached_property
    def scales(self) -> Array:
        """Two scales of the robot, one for forces [N] and one for torques [N m], as six numbers:
        roots of the sums of squares of what each actuator alone can push and turn at most."""
        forces = []
        torques = []
        for each in self.actuators:
            edge = edge_forces(each, 181)
            wrench = edge @ each.effectiveness.T
            forces.append(np.linalg.norm(wrench[:, :3], axis=1).max())
            torques.append(np.linalg.norm(wrench[:, 3:], axis=1).max())
        return np.repeat([np.linalg.norm(forces), max(np.linalg.norm(torques), 1e-12)], 3)

    def commands_of(self, result: Any) -> Array:
        """Commands (n, 3) of a result of the library, from its typed commands where it has them."""
        if not hasattr(result, "commands"):
            return np.array(result.command, np.float64)
        rows = []
        for each in self.actuators:
            given = result.commands.get(each.name)
            row = np.full(3, np.nan)
            if given is not None:
                values = [getattr(given, key) for key in COMMAND_KEYS[each.kind]]
                row = np.zeros(3)
                row[: len(values)] = values
            rows.append(row)
        return np.array(rows, np.float64)


COMMAND_KEYS = {
    "fin": ("amplitude", "frequency", "zero_direction"),
    "thruster": ("force",),
    "azimuth": ("angle", "force"),
    "rudder": ("deflection",),
    "propeller_rudder": ("deflection", "force"),
}
"""Kind of actuator -> names of its command's numbers, in their order."""


def edge_forces(actuator: OracleActuator, count: int) -> Array:
    """The outermost forces (K, 1 or 2) [N] in the own plane of an actuator: the corners of its
    hull."""
    low, high = actuator.limits
    if actuator.kind == "thruster":
        return np.array([[low[0]], [high[0]], [min(max(0.0, low[0]), high[0])]])
    if actuator.kind == "rudder":
        return actuator.foil(np.linspace(low[0], high[0], count))[0]
    if actuator.kind == "propeller_rudder":
        deflection = np.linspace(low[0], high[0], 4 * count)
        ahead = actuator.steered(deflection, np.full(4 * count, high[1]))
        least = max(low[1], 0.0) if actuator.flow.any() else low[1]
        return np.concatenate([ahead, actuator.steered(deflection, np.full(4 * count, least))])
    if actuator.kind == "azimuth":
        angle = np.linspace(low[0], high[0], count)
        ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return np.concatenate([low[1] * ring, high[1] * ring])
    size = actuator.thrust(*np.meshgrid(*(np.linspace(low[k], high[k], 400) for k in (0, 1))))
    phi = np.linspace(low[2], high[2], count)
    ring = np.stack([np.cos(phi + actuator.lean), np.sin(phi + actuator.lean)], axis=-1)
    ring *= actuator.unevenness(phi)[:, None]
    return np.concatenate([size.min() * ring, size.max() * ring])
