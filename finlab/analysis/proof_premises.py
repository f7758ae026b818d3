"""A robot as a proof takes it: positions and axes as decimals, and for each actuator the set of its
forces and its power, as `check_proof` reads them.

What a file of a proof says of an actuator is a premise: the proof holds of the robot in the file.
Positions, axes and arcs are those of the layout, rounded to `PLACES` decimals, and force limits and
power laws are the layout's own. A fin's largest force and its power come from its law, rounded to
the safe side by `FIN_MARGIN`: in mean over a stroke, as everywhere in finlab.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from finlab.actuators.azimuth import Azimuth
from finlab.actuators.fin.fin import Fin
from finlab.actuators.fin.fin_response import fin_table
from finlab.actuators.propeller import usable_force
from finlab.actuators.rudder import Rudder
from finlab.actuators.thrust_model import PowerLaw
from finlab.actuators.thrust_power import ThrustPower
from finlab.actuators.thruster import Thruster
from finlab.arrays import Array
from finlab.axes import is_full_turn
from finlab.errors import FinlabError
from finlab.layout import Layout

PLACES = 12
"""Decimals of positions [m], axes and directions [1]."""
FIN_MARGIN = 1e-6
"""Share by which a fin's largest force and its power are rounded to the safe side [1]."""
POWER_POINTS = 65
"""Points of a power that is no power law, on each side."""
EDGE_LENGTH = 1.0 + 1e-6
"""Length of the directions that end an arc [1]: at least 1, whatever rounding does."""
AHEAD_LENGTH = 1.0 - 1e-9
"""Length of the direction ahead of a part without small forces [1]: at most 1."""
HALF_TURN_TOLERANCE = 1e-9
"""Most by which an arc that counts as half a turn differs from it [rad]."""
INNER_SHARE = 0.3
"""Where a sector's inner point lies between its tip and its rim [1]."""
NO_ROOM = 0.99
"""Least force of a fin over its largest one from which on there is no room between them [1]."""
MAX_CUT = 3
"""Most actuators whose wide arcs have several parts to choose from, three each."""


class NotSettledError(FinlabError):
    """A statement that is neither proved nor refuted; the message says why."""


class Part(NamedTuple):
    """A convex part of an actuator's forces, in coordinates along its axes."""

    values: dict[str, Any]
    """Its keys in the file; none where the whole set is convex."""
    sector_center: float
    """Middle of its arc [rad]."""
    sector_half_angle: float
    """Half of its arc [rad]; pi of a circle, 0 of a line."""
    least_ahead: float
    """Least force along the middle of its arc [N]; 0 where any smaller force is in the set."""
    inner_point: Array
    """A point well inside (1,) or (2,) [N]."""


@dataclass(frozen=True, eq=False)
class ProofActuator:
    """One actuator of a proof."""

    values: dict[str, Any]
    """Its premises, as the file has them."""
    radius: float
    """Largest force that is certain [N]; of a line the farther one of its ends."""
    outer_radius: float
    """Force that it does not exceed [N]."""
    parts: tuple[Part, ...]
    """Convex parts to choose from, at least one."""
    hull: Part
    """The whole set, convex or not."""
    halves: tuple[Part, ...] = ()
    """Both halves of a wide arc, which together are the whole set; none of others."""

    @property
    def name(self) -> str:
        """Its name."""
        return str(self.values["name"])

    @property
    def n_axes(self) -> int:
        """1 of a line, 2 of a plane."""
        return len(self.values["axes"])


def proof_actuators(layout: Layout, with_power: bool) -> tuple[ProofActuator, ...]:
    """Returns the premises of a robot at rest in the water.

    Args:
        layout: the robot.
        with_power: whether the statement has a power budget.

    Returns:
        Its actuators in the order of the layout, without rudders, which give no force at rest.

    Raises:
        NotSettledError: no premises are known that are certain, with the reason.
    """
    if layout.interaction is not None:
        raise NotSettledError(
            "the layout has an interaction, with which wrenches do not add up; leave it out"
        )
    actuators = []
    for actuator, frame in zip(layout.actuators, layout.frames, strict=True):
        if isinstance(actuator, Rudder):
            continue
        axes = frame[list(actuator.KIND.push_rows)]
        try:
            if isinstance(actuator, Thruster):
                made = _thruster(actuator, axes, with_power)
            elif isinstance(actuator, Azimuth):
                made = _azimuth(actuator, axes, with_power)
            elif isinstance(actuator, Fin):
                made = _fin(actuator, axes)
            else:
                raise NotSettledError(f"nothing certain is known of a {actuator.type}")
        except NotSettledError as error:
            raise NotSettledError(f"{actuator.name}: {error}") from None
        if not with_power:
            made.values["power"] = None
        actuators.append(made)
    return tuple(actuators)


def part_choices(actuators: tuple[ProofActuator, ...]) -> list[tuple[Part, ...]]:
    """Returns the combinations of convex parts to try in a case, first those in the middle of each
    arc."""
    choices = []
    cut = 0
    for actuator in actuators:
        parts = actuator.parts
        if len(parts) > 1:
            cut += 1
            if cut > MAX_CUT:
                parts = parts[:1]
        choices.append(parts)
    return list(product(*choices))


def decimals(values: Any) -> Any:
    """Returns numbers rounded to `PLACES` decimals, as plain values."""
    return (np.round(np.asarray(values, np.float64), PLACES) + 0.0).tolist()  # + 0.0: no "-0.0"


def _premises(
    actuator: Any, axes: Array, force: tuple[float, float], outer_force: float, power: Any
) -> dict[str, Any]:
    """What a file says of an actuator with these axes (1, 3) or (2, 3)."""
    return {
        "name": actuator.name,
        "type": actuator.type,
        "position_m": decimals(actuator.position),
        "axes": decimals(axes),
        "torque_per_newton_m": decimals(getattr(actuator, "torque_per_newton", 0.0)),
        "force_n": list(map(float, force)),
        "outer_force_n": float(outer_force),
        "arc": None,
        "mean": False,
        "power": power,
    }


def _thruster(thruster: Thruster, axes: Array, with_power: bool) -> ProofActuator:
    least, most = usable_force(thruster)
    if with_power and thruster.dead_band:
        raise NotSettledError("has a dead band, within which its power is not convex")
    if not least <= 0.0 <= most:
        raise NotSettledError(f"hangs at {most:g} N")
    power = _propeller_power(thruster, least, most, is_plane=False)
    radius = max(-least, most)
    values = _premises(thruster, axes, (least, most), radius, power)
    values["mean"] = thruster.dead_band > 0.0
    inner_point = np.array([0.25 * (least + most)])
    part = Part({}, 0.0, 0.0, 0.0, inner_point)
    return ProofActuator(values, radius, radius, (part,), part)


def _azimuth(azimuth: Azimuth, axes: Array, with_power: bool) -> ProofActuator:
    least, most = usable_force(azimuth)
    if with_power and (azimuth.dead_band or (least < 0.0 and not _has_law(azimuth))):
        raise NotSettledError("has a dead band or a table of power astern, and so no convex power")
    if most <= 0.0:
        raise NotSettledError("pushes astern alone; turn its zero direction round")
    if azimuth.barred:
        raise NotSettledError("has several arcs, and premises are those of one")
    power = _propeller_power(azimuth, least, most, is_plane=True)
    outer = max(-least, most)
    values = _premises(azimuth, axes, (least, most), outer, power)
    values["mean"] = azimuth.dead_band > 0.0
    low, high = azimuth.turn_range
    half_angle = math.pi if is_full_turn(high - low) else 0.5 * (high - low)
    return _plane(values, most, outer, 0.5 * (low + high), half_angle)


def _fin(fin: Fin, axes: Array) -> ProofActuator:
    table = fin_table(fin)
    law = table.box.law
    if law.measured:
        raise NotSettledError(
            "its forces are a table of measurements, which also has forces along the shaft"
        )
    gauge = table.directions.gauge
    weakest_share = 1.0 if gauge is None else float(gauge.min()) * (1.0 - _gauge_step(gauge))
    strongest_share = 1.0 if gauge is None else float(gauge.max()) * (1.0 + _gauge_step(gauge))
    if weakest_share <= 0.0:
        raise NotSettledError("has directions without force")
    force = np.array([table.table.force[0], table.table.largest])
    least = float(force[0] * strongest_share) * (1.0 + FIN_MARGIN)
    most = float(force[1] * weakest_share) * (1.0 - FIN_MARGIN)
    outer = float(force[1] * strongest_share) * (1.0 + FIN_MARGIN)
    if least >= NO_ROOM * most:
        raise NotSettledError("can push hardly less than it can at most")

    # Chords of the least power over the force, of the weakest direction; of the strongest one it is
    # less, by `error_w` at most.
    size = outer / weakest_share * np.linspace(0.0, 1.0, POWER_POINTS) ** 2
    between = np.linspace(0.0, size[-1] * weakest_share, 16 * POWER_POINTS)
    in_reach = np.minimum(size, table.table.largest)
    watts = table.table.cost(in_reach)
    slope = table.table.price_max
    watts = watts + slope * (size - in_reach)
    chord = np.interp(between, size * weakest_share, watts)
    true = table.table.cost(np.minimum(between / strongest_share, table.table.largest))
    margin = FIN_MARGIN * float(watts[-1])
    power = {
        "points": _points(size * weakest_share, watts + margin),
        "error_w": float(1.01 * np.max(chord - true)) + 3.0 * margin,
    }
    values = _premises(fin, axes, (least, most), outer, power)
    values["mean"] = True
    directions = table.directions
    half_angle = directions.sector_half_angle
    return _plane(values, most, outer, directions.sector_center, half_angle)


def _gauge_step(gauge: Array) -> float:
    """How much a gauge (K,) may differ between two of its directions, as a share of it: the largest
    difference of neighbours."""
    return float(np.abs(np.diff(gauge, append=gauge[:1])).max() / gauge.min())


def _has_law(propeller: Any) -> bool:
    return isinstance(propeller.model, PowerLaw)


def _propeller_power(propeller: Any, least: float, most: float, *, is_plane: bool) -> Any:
    """A power law as it is, or the points of a table's curve, for a force along a line or the size
    of one in a plane."""
    model = propeller.model
    if isinstance(model, PowerLaw):
        reverse = model.forward if model.reverse is None else model.reverse
        return {"forward": model.forward, "reverse": reverse, "exponent": model.exponent}
    side = np.linspace(0.0, 1.0, POWER_POINTS) ** 2
    force = most * side
    if not is_plane and least < 0.0:
        force = np.append(least * side[:0:-1], force)
    curve = ThrustPower([model])
    watts = _convex(force, curve.watts(force[:, None])[:, 0])
    between = np.linspace(force[0], force[-1], 32 * POWER_POINTS)
    error = np.interp(between, force, watts) - curve.watts(between[:, None])[:, 0]
    margin = FIN_MARGIN * float(watts.max())
    return {
        "points": _points(force, watts + margin),
        "error_w": float(1.01 * error.max()) + 3.0 * margin,
    }


def _convex(x: Array, y: Array) -> Array:
    """Points' values (K,), raised by rounding errors so that their slopes rise."""
    slope = np.maximum.accumulate(np.diff(y) / np.diff(x))
    start = y[0]
    return np.asarray(start + np.append(0.0, np.cumsum(slope * np.diff(x))))


def _points(x: Array, y: Array) -> list[list[float]]:
    """Points that are convex when they are read as decimals."""
    curved = _convex(x, y)
    # A parabola far below the margin keeps slopes apart that rounding would bring out of order.
    span = x[-1] - x[0]
    curved = curved + 1e-9 * (curved.max() + 1e-12) * ((x - x[0]) / span) ** 2
    points: list[list[float]] = np.stack([x, curved], axis=-1).tolist()
    return points


def _plane(
    values: dict[str, Any], radius: float, outer: float, center: float, half_angle: float
) -> ProofActuator:
    """An actuator whose force lies in a plane, with its parts."""
    hull = _part(values, radius, center, half_angle)
    if half_angle >= math.pi:
        if values["force_n"][0] > 0.0 and not values["mean"]:
            raise NotSettledError("cannot stop, and turns by more than half a turn")
        return ProofActuator(values, radius, outer, (hull,), hull)
    values["arc"] = _edges(center, half_angle)
    quarter = 0.5 * math.pi
    if half_angle <= quarter + HALF_TURN_TOLERANCE:
        return ProofActuator(values, radius, outer, (hull,), hull)
    room = half_angle - quarter
    parts = []
    for share in (0.0, 1.0, -1.0):
        part_center = center + share * (room - 1e-9)
        part = _part(values, radius, part_center, quarter)
        part.values["arc"] = _edges(part_center, quarter)
        parts.append(part)
    halves = []
    for share in (-0.5, 0.5):
        half = Part({}, center + share * half_angle, 0.5 * half_angle, 0.0, np.zeros(2))
        halves.append(half)
    can_cut = values["force_n"][0] >= 0.0
    return ProofActuator(
        values, radius, outer, tuple(parts), hull, tuple(halves) if can_cut else ()
    )


def middle_of(part: Part) -> list[float]:
    """Returns the direction in the middle of an arc, as a file has it."""
    return _direction(part.sector_center)


def _part(values: dict[str, Any], radius: float, center: float, half_angle: float) -> Part:
    """A sector, without its small forces where these cannot be held."""
    if half_angle >= math.pi:
        return Part({}, center, half_angle, 0.0, np.zeros(2))
    direction = np.array([math.cos(center), math.sin(center)])
    is_half_turn = abs(half_angle - 0.5 * math.pi) <= HALF_TURN_TOLERANCE
    least = max(values["force_n"][0], 0.0)
    if least == 0.0 or (values["mean"] and is_half_turn):
        return Part({}, center, half_angle, 0.0, INNER_SHARE * radius * direction)
    if values["type"] != "fin" and half_angle > 0.5 * math.pi + HALF_TURN_TOLERANCE:
        raise NotSettledError("cannot stop, and turns by more than half a turn")
    inner_point = 0.5 * (least + radius) * direction
    own = {"ahead": decimals(AHEAD_LENGTH * direction)}
    return Part(own, center, half_angle, least, inner_point)


def _edges(center: float, half_angle: float) -> list[list[float]]:
    """The directions that end an arc, exactly opposite ones of half a turn."""
    first = _direction(center - half_angle)
    if abs(half_angle - 0.5 * math.pi) <= HALF_TURN_TOLERANCE:
        return [first, [0.0 - first[0], 0.0 - first[1]]]
    return [first, _direction(center + half_angle)]


def _direction(angle: float) -> list[float]:
    """A direction as decimals, not shorter than 1."""
    exact = EDGE_LENGTH * np.array([math.cos(angle), math.sin(angle)])
    rounded: list[float] = decimals(exact)
    return rounded
