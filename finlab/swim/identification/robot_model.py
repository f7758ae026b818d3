"""From unknowns to what a robot does: wrenches of its actuators over a swim, and the body that they
move.

Which actuators push the other way than drawn is found before a fit, whose strengths are logarithms:
what the measured accelerations need besides what the body does by itself is linear in the shares
that actuators give of their laws' forces, and in errors of the damping. That is one weighted
least-squares problem of both sides after the same low-pass filter (equation error; V. Klein and E.
Morelli, Aircraft System Identification).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.effectiveness import moved_effectiveness, own_effectiveness
from finlab.physics import plant_of
from finlab.swim.identification.swim import SMOOTHED, STEP_S, Swim
from finlab.swim.identification.unknowns import SENSORS, SHAPE, Unknowns, blocks_of
from finlab.swim.vehicle.attitude import rotation_of_angles
from finlab.swim.vehicle.fossen import Dynamics, accelerations, complete_body, dynamics_of
from finlab.swim.vehicle.vehicle import Bodies

TYPICAL_SPEED = np.array([0.2, 0.2, 0.2, 0.5, 0.5, 0.5])
"""At which linear and quadratic damping are compared [m/s, rad/s]."""
DAMPING_DOUBT = 0.5
"""How far damping may be off, as a share of what the layout says."""
BACKWARDS = -0.25
"""A share of its law's force below which an actuator pushes the other way, and not hardly."""
SURE = 4.0
"""Standard errors by which that share lies below 0."""
ROUNDS = 4
"""Times that the noise of each axis is estimated."""


class RobotModel:
    """One layout, and the swims from which it is learned, M steps in all."""

    def __init__(self, layout: Layout, swims: Sequence[Swim], doubts: Mapping[str, float]) -> None:
        """Takes the robot as it is believed to be, and by what factors some blocks may be farther
        off."""
        self.layout = layout
        self.body = complete_body(layout)
        self.dynamics = Dynamics(*map(np.array, dynamics_of(self.body)))
        """Of that body; arrays."""
        known = self.dynamics
        at_speed = known.linear + known.quadratic * TYPICAL_SPEED
        at_speed = np.maximum(at_speed, 0.1 * known.inertia * TYPICAL_SPEED)
        doubt = DAMPING_DOUBT * np.stack([at_speed, at_speed / TYPICAL_SPEED])
        self.blocks = {
            name: replace(block, scale=block.scale * doubts.get(name, 1.0))
            for name, block in blocks_of(layout.names, doubt).items()
        }
        self._plant = plant_of(layout)
        self.motion = np.concatenate([swim.motion for swim in swims])
        self.alone = self._plant.forces(self.motion)
        """What each actuator gives by the layout's law (M, SUBSTEPS, n, 3) [N], in its own
        frame."""
        self.steers = np.array([part.KIND.driven_by_flow for part in layout.actuators])
        """Which actuators (n,) the flow drives: one that leans meets the water at another angle."""
        self._by_lean = np.zeros_like(self.alone)
        self.late = [0] * len(SENSORS)
        """Whole steps by which each sensor is late, as far as is known."""

    def meet(self, flow: Array) -> None:
        """Takes the robot to move through the water with (M, 6) [m/s, rad/s], which some actuators
        feel."""
        if self._plant.feels_flow:
            self.alone = self._plant.forces(self.motion, flow=flow[:, None])
            _, slopes = self._plant.force_and_jacobian(
                np.nan_to_num(self.motion), flow=flow[:, None]
            )
            works = self.steers[:, None] & np.isfinite(self.motion[..., :1])
            self._by_lean = np.where(works, slopes[..., 0, :], 0.0)

    @cached_property
    def middle(self) -> list[float]:
        """Amplitude [rad] and frequency [Hz] at which a fin has the strength that is given."""
        return [float(np.nanmedian(self.motion[..., k])) for k in range(2)]

    @cached_property
    def seen(self) -> list[tuple[float, float]]:
        """Amplitudes and frequencies between which nearly all were; the law is fitted no
        further."""
        ends = [np.nanquantile(self.motion[..., k], (0.005, 0.995)) for k in range(2)]
        return [(max(float(low), 1e-3), max(float(high), 2e-3)) for low, high in ends]

    @cached_property
    def _shapes(self) -> Array:
        return self.shape_terms(np.nan_to_num(self.motion))

    def shape_terms(self, command: Array) -> Array:
        """Terms (..., 5) of the logarithm of a fin's true law over the layout's, for commands (...,
        3): a polynomial, so that it ends somewhere where fins hardly beat."""
        (low_a, high_a), (low_f, high_f) = self.seen
        a = np.clip(command[..., 0], low_a, high_a) / self.middle[0]
        f = np.clip(command[..., 1], low_f, high_f) / self.middle[1]
        p = a - 1.0
        q = f - 1.0
        return np.stack([p, q, p * p, p * q, q * q], axis=-1)

    def wrench(self, unknowns: Unknowns, vector: Array) -> Array:
        """Mean wrench (M, 6) of each step for one vector (size,) of unknowns."""
        layout = self.layout
        lean = unknowns.of("lean", vector)
        force = self.alone + lean[:, None] * self._by_lean if self.steers.any() else self.alone
        share = np.exp(unknowns.of("strength", vector)) * np.ones(force.shape[:-1])
        shape = unknowns.part(SHAPE, vector)
        if shape is not None:
            share *= shape_factor(self._shapes, shape)
        position = layout.position - unknowns.of("center", vector)
        turned = np.where(self.steers, 0.0, lean)
        frames = turned_frames(layout, unknowns.of("mounting", vector), turned)
        columns = moved_effectiveness(layout, position, frames)
        mean = (force * share[..., None]).mean(axis=1)
        wrench: Array = mean.reshape(len(mean), -1) @ columns.reshape(-1, 6)
        wrench[:, [0, 1, 5]] += unknowns.of("bias", vector)
        return wrench

    def bodies(self, unknowns: Unknowns, vectors: Array) -> Bodies:
        """The bodies (..., B) of B vectors (B, size)."""
        known = self.dynamics
        return Dynamics(
            (known.inertia * np.exp(unknowns.of("inertia", vectors))).T,
            np.maximum(known.linear + unknowns.of("linear", vectors), 0.0).T,
            np.maximum(known.quadratic + unknowns.of("quadratic", vectors), 0.0).T,
            np.full(len(vectors), known.weight),
            known.lift + unknowns.of("lift", vectors)[:, 0],
            (known.center + unknowns.of("buoyancy", vectors)).T,
        )

    def sensed(self, unknowns: Unknowns, vectors: Array, state: Array) -> Array:
        """What late sensors say of states (L, 12, B, W) of L steps under B vectors (B, size): where
        the robot was `late` steps before, and from there on along its slope."""
        slope = np.gradient(state, STEP_S, axis=0)
        said = np.empty_like(state)
        step = np.arange(len(state))
        delays = unknowns.of("delay", vectors).T
        for delay, late, channels in zip(delays, self.late, SENSORS.values(), strict=True):
            before = np.clip(step - late, 0, len(state) - 1)
            rest = delay - STEP_S * (step - before)[:, None]
            for k in channels:
                said[:, k] = state[before, k] - rest[..., None] * slope[before, k]
        return said


def turned_frames(layout: Layout, mounting: Array, lean: Array) -> Array:
    """Returns own axes (n, 3, 3), rows in the body frame, of actuators not as drawn: turned by
    angles (n,) of their mounting about the third of the axes [rad], of a fin's horizontal shaft
    about z, and then by those of their lean about the first, a shaft; of thrusters, which push
    along it, about the second."""
    thrusts = np.array([len(part.KIND.axes) == 1 for part in layout.actuators])
    angles = np.stack(
        [mounting, np.where(thrusts, 0.0, lean), np.where(thrusts, lean, 0.0)], axis=-1
    )
    return np.asarray(Rotation.from_euler("ZXY", angles).as_matrix().swapaxes(1, 2) @ layout.frames)


def shape_factor(terms: Array, shape: Array) -> Array:
    """What thrust is multiplied by, from terms (..., 5) and their coefficients (5,)."""
    return np.asarray(np.exp(np.clip(terms @ shape, -2.0, 2.0)))


def opposed_in(layout: Layout, names: Sequence[str]) -> Layout:
    """Returns a robot of which some actuators push the other way at every command: of fins and
    azimuths zero is turned about, of thrusters and rudders the first axis."""
    parts = list(layout.actuators)
    for k in layout.indices(names):
        part = parts[k]
        first = len(part.KIND.push_rows) == 1
        parts[k] = part.turned(
            np.array(part.frame) * ([[-1], [1], [-1]] if first else [[1], [-1], [-1]])
        )
    return replace(layout, actuators=tuple(parts))


def pushing_back(model: RobotModel, swims: Sequence[Swim], smooth: Array) -> tuple[str, ...]:
    """Returns the names of the actuators that push the other way, by smoothed measurements (M, 12).
    One that the swims do not tell apart from others counts as drawn."""
    share, error = _shares(model, [len(swim) for swim in swims], smooth)
    backwards = (share < BACKWARDS) & (share < -SURE * error)
    return tuple(np.array(model.layout.names)[backwards].tolist())


def _shares(model: RobotModel, lengths: Sequence[int], smooth: Array) -> tuple[Array, Array]:
    """Shares (n,) of their laws' forces that actuators give, and standard errors; believed to be 1
    +- 1."""
    from scipy.signal import savgol_filter

    def filtered(values: Array, order: int = 0) -> Array:
        parts = np.split(values, np.cumsum(lengths)[:-1])
        kept = [savgol_filter(part, *SMOOTHED, deriv=order, delta=STEP_S, axis=0) for part in parts]
        return np.concatenate(kept)

    n = model.layout.n
    flow = smooth[:, 6:]
    body = model.dynamics
    model.meet(flow)
    drawn = filtered(
        np.einsum("mnk,nkw->mwn", model.alone.mean(axis=1), own_effectiveness(model.layout))
    )
    up = rotation_of_angles(smooth[:, 3:6].T)[2::3]
    alone = np.stack(accelerations(body, flow.T, up, np.zeros(6)), axis=-1)
    missing = (filtered(flow, 1) - alone) * body.inertia - drawn.sum(axis=-1)
    damped = -np.stack([flow, flow * np.abs(flow), np.ones_like(flow)], axis=-1)  # (M, 6, 3)
    by = np.concatenate(
        [drawn, (np.eye(6)[:, :, None] * damped[:, :, None]).reshape(-1, 6, 18)], axis=-1
    )
    wide = [
        model.blocks["linear"].scale,
        model.blocks["quadratic"].scale,
        missing.std(axis=0) + 1e-9,
    ]
    believed = np.diag(np.concatenate([np.ones(n), np.stack(wide, axis=-1).ravel()]) ** -2.0)
    left = missing
    for _ in range(ROUNDS):
        noise = left.std(axis=0) + 1e-9
        rows = (by / noise[:, None]).reshape(-1, n + 18)
        wanted = (missing / noise).ravel()
        # The filter leaves one independent sample in as many as it is long.
        information = rows.T @ rows / SMOOTHED[0] + believed
        change = np.linalg.solve(information, rows.T @ wanted / SMOOTHED[0])
        left = missing - by @ change
    return 1.0 + change[:n], np.sqrt(np.diag(np.linalg.inv(information)))[:n]
