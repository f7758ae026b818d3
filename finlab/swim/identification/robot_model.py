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
from finlab.swim.vehicle.many_bodies import Bodies

TYPICAL_SPEED = np.array([0.2, 0.2, 0.2, 0.5, 0.5, 0.5])
"""At which linear and quadratic damping are compared [m/s, rad/s]."""
DAMPING_DOUBT = 0.5
"""How far damping may be off, as a share of what the layout says."""
REVERSED_SHARE = -0.25
"""A share of its law's force below which an actuator pushes the other way, and not hardly."""
REVERSED_ERRORS = 4.0
"""Standard errors by which that share lies below 0."""
NOISE_ROUNDS = 4
"""Times that the noise of each axis is estimated."""


class RobotModel:
    """One layout, and the swims from which it is learned, M steps in all."""

    def __init__(self, layout: Layout, swims: Sequence[Swim], doubts: Mapping[str, float]) -> None:
        """Takes a robot and its swims.

        Args:
            layout: the robot as it is believed to be.
            swims: what its actuators did and its sensors said.
            doubts: block of unknowns to the factor by which it may be farther off.
        """
        self.layout = layout
        self.body = complete_body(layout)
        self.dynamics = Dynamics(*map(np.array, dynamics_of(self.body)))
        """Of that body; arrays."""
        known = self.dynamics
        at_speed = known.linear_damping + known.quadratic_damping * TYPICAL_SPEED
        at_speed = np.maximum(at_speed, 0.1 * known.inertia * TYPICAL_SPEED)
        doubt = DAMPING_DOUBT * np.stack([at_speed, at_speed / TYPICAL_SPEED])
        self.blocks = {
            name: replace(block, scale=block.scale * doubts.get(name, 1.0))
            for name, block in blocks_of(layout.names, doubt).items()
        }
        self._plant = plant_of(layout)
        self.motion = np.concatenate([swim.motion for swim in swims])
        self.law_force = self._plant.forces(self.motion)
        """What each actuator gives by the layout's law (M, SUBSTEPS, n, 3) [N], in its own
        frame."""
        self.is_flow_driven = np.array([part.KIND.driven_by_flow for part in layout.actuators])
        """Which actuators (n,) the flow drives: one that leans meets the water at another angle."""
        self._force_by_lean = np.zeros_like(self.law_force)
        self.delay_steps = [0] * len(SENSORS)
        """Whole steps by which each sensor of `SENSORS` is late, as far as is known."""

    def set_flow(self, flow: Array) -> None:
        """Takes the robot to move through the water, which some actuators feel.

        Args:
            flow: velocity and angular rates (M, 6), body frame [m/s, rad/s].
        """
        if self._plant.feels_flow:
            self.law_force = self._plant.forces(self.motion, flow=flow[:, None])
            _, slopes = self._plant.force_and_jacobian(
                np.nan_to_num(self.motion), flow=flow[:, None]
            )
            works = self.is_flow_driven[:, None] & np.isfinite(self.motion[..., :1])
            self._force_by_lean = np.where(works, slopes[..., 0, :], 0.0)

    @cached_property
    def reference_command(self) -> list[float]:
        """Amplitude [rad] and frequency [Hz] at which a fin has the strength that is given."""
        return [float(np.nanmedian(self.motion[..., k])) for k in range(2)]

    @cached_property
    def fitted_range(self) -> list[tuple[float, float]]:
        """Amplitudes and frequencies between which nearly all were; the law is fitted no
        further."""
        ends = [np.nanquantile(self.motion[..., k], (0.005, 0.995)) for k in range(2)]
        return [(max(float(low), 1e-3), max(float(high), 2e-3)) for low, high in ends]

    @cached_property
    def _shapes(self) -> Array:
        return self.shape_terms(np.nan_to_num(self.motion))

    def shape_terms(self, command: Array) -> Array:
        """Returns terms (..., 5) of the logarithm of a fin's true law over the layout's.

        A polynomial of second order in amplitude and frequency, so that it ends somewhere where
        fins hardly beat.

        Args:
            command: (..., 3) [rad, Hz, rad].
        """
        (low_a, high_a), (low_f, high_f) = self.fitted_range
        a = np.clip(command[..., 0], low_a, high_a) / self.reference_command[0]
        f = np.clip(command[..., 1], low_f, high_f) / self.reference_command[1]
        p = a - 1.0
        q = f - 1.0
        return np.stack([p, q, p * p, p * q, q * q], axis=-1)

    def wrench(self, unknowns: Unknowns, vector: Array) -> Array:
        """Returns the mean wrench (M, 6) of each step [N, N m].

        Args:
            unknowns: what the entries of the vector are.
            vector: theta (size,), in scales.
        """
        layout = self.layout
        lean = unknowns.block("lean", vector)
        force = self.law_force  # (M, SUBSTEPS, n, 3)
        if self.is_flow_driven.any():
            force = force + lean[:, None] * self._force_by_lean
        factor = np.exp(unknowns.block("strength", vector)) * np.ones(force.shape[:-1])
        shape = unknowns.optional_block(SHAPE, vector)
        if shape is not None:
            factor *= thrust_factor(self._shapes, shape)
        position = layout.position - unknowns.block("center", vector)
        frame_lean = np.where(self.is_flow_driven, 0.0, lean)
        frames = turned_frames(layout, unknowns.block("mounting", vector), frame_lean)
        effectiveness = moved_effectiveness(layout, position, frames)
        mean_force = (force * factor[..., None]).mean(axis=1)
        wrench: Array = mean_force.reshape(len(mean_force), -1) @ effectiveness.reshape(-1, 6)
        wrench[:, [0, 1, 5]] += unknowns.block("bias", vector)
        return wrench

    def bodies(self, unknowns: Unknowns, vectors: Array) -> Bodies:
        """Returns the bodies (..., B) of B vectors theta (B, size)."""
        known = self.dynamics
        linear = known.linear_damping + unknowns.block("linear", vectors)
        quadratic = known.quadratic_damping + unknowns.block("quadratic", vectors)
        center = known.center_of_buoyancy + unknowns.block("buoyancy", vectors)
        return Dynamics(
            inertia=(known.inertia * np.exp(unknowns.block("inertia", vectors))).T,
            linear_damping=np.maximum(linear, 0.0).T,
            quadratic_damping=np.maximum(quadratic, 0.0).T,
            weight=np.full(len(vectors), known.weight),
            buoyancy=known.buoyancy + unknowns.block("lift", vectors)[:, 0],
            center_of_buoyancy=center.T,
        )

    def sensed(self, unknowns: Unknowns, vectors: Array, state: Array) -> Array:
        """Returns what late sensors say (L, 12, B, W): the state `delay_steps` steps before, moved
        on along its slope by the rest of the delay.

        Args:
            unknowns: what the entries of the vectors are.
            vectors: B vectors theta (B, size).
            state: of L steps under each of them, in W windows (L, 12, B, W).
        """
        slope = np.gradient(state, STEP_S, axis=0)
        result = np.empty_like(state)
        step = np.arange(len(state))
        delays = unknowns.block("delay", vectors).T
        for delay, n_late, channels in zip(delays, self.delay_steps, SENSORS.values(), strict=True):
            late_step = np.clip(step - n_late, 0, len(state) - 1)
            remaining = delay - STEP_S * (step - late_step)[:, None]
            for k in channels:
                result[:, k] = state[late_step, k] - remaining[..., None] * slope[late_step, k]
        return result


def turned_frames(layout: Layout, mounting: Array, lean: Array) -> Array:
    """Returns the own axes (n, 3, 3), rows in the body frame, of actuators not as drawn.

    Args:
        layout: the robot as it is drawn.
        mounting: angles (n,) about the third of the axes [rad], of a fin's horizontal shaft about
            z.
        lean: angles (n,), after that, about the first axis, a shaft [rad]; of thrusters, which push
            along it, about the second.
    """
    is_thruster = np.array([len(part.KIND.axes) == 1 for part in layout.actuators])
    about_first = np.where(is_thruster, 0.0, lean)
    about_second = np.where(is_thruster, lean, 0.0)
    angles = np.stack([mounting, about_first, about_second], axis=-1)
    rotation = Rotation.from_euler("ZXY", angles).as_matrix()
    return np.asarray(rotation.swapaxes(1, 2) @ layout.frames)


def thrust_factor(terms: Array, shape: Array) -> Array:
    """What thrust is multiplied by, from terms (..., 5) and their coefficients (5,)."""
    return np.asarray(np.exp(np.clip(terms @ shape, -2.0, 2.0)))


def opposed_in(layout: Layout, names: Sequence[str]) -> Layout:
    """Returns a robot of which some actuators push the other way at every command: of fins and
    azimuths zero is turned about, of thrusters and rudders the first axis."""
    parts = list(layout.actuators)
    for k in layout.indices(names):
        part = parts[k]
        signs = [[-1], [1], [-1]] if len(part.KIND.push_rows) == 1 else [[1], [-1], [-1]]
        parts[k] = part.turned(np.array(part.frame) * signs)
    return replace(layout, actuators=tuple(parts))


def pushing_back(model: RobotModel, swims: Sequence[Swim], smooth: Array) -> tuple[str, ...]:
    """Returns the names of the actuators that push the other way, by smoothed measurements (M, 12).
    One that the swims do not tell apart from others counts as drawn."""
    share, error = _shares(model, [len(swim) for swim in swims], smooth)
    is_opposed = (share < REVERSED_SHARE) & (share < -REVERSED_ERRORS * error)
    return tuple(np.array(model.layout.names)[is_opposed].tolist())


def _shares(model: RobotModel, lengths: Sequence[int], smooth: Array) -> tuple[Array, Array]:
    """Returns shares (n,) of their laws' forces that actuators give, and standard errors.

    With everything filtered, and M nu' less what the body does alone on the left,

        M (nu' - nu'_alone) - sum_i w_i = sum_i (s_i - 1) w_i - d_1 nu - d_2 |nu| nu + bias

    is linear in the shares s_i, believed to be 1 +- 1, and per axis in errors d_1 and d_2 of the
    damping and a constant.

    Args:
        model: the robot.
        lengths: steps of each swim, M in all.
        smooth: smoothed measurements (M, 12).
    """
    from scipy.signal import savgol_filter

    def filtered(values: Array, derivative: int = 0) -> Array:
        swims = []
        for swim in np.split(values, np.cumsum(lengths)[:-1]):
            swims.append(savgol_filter(swim, *SMOOTHED, deriv=derivative, delta=STEP_S, axis=0))
        return np.concatenate(swims)

    n = model.layout.n
    nu = smooth[:, 6:]
    body = model.dynamics
    model.set_flow(nu)
    mean_force = model.law_force.mean(axis=1)
    law_wrench = np.einsum("mnk,nkw->mwn", mean_force, own_effectiveness(model.layout))
    law_wrench = filtered(law_wrench)  # (M, 6, n)
    up = rotation_of_angles(smooth[:, 3:6].T)[2::3]
    alone = np.stack(accelerations(body, nu.T, up, np.zeros(6)), axis=-1)
    missing = (filtered(nu, 1) - alone) * body.inertia - law_wrench.sum(axis=-1)  # (M, 6)

    # Columns: shares less 1 (n), and for each axis d_1, d_2 and a constant (18).
    of_axis = -np.stack([nu, nu * np.abs(nu), np.ones_like(nu)], axis=-1)  # (M, 6, 3)
    by_axis = (np.eye(6)[:, :, None] * of_axis[:, :, None]).reshape(-1, 6, 18)
    regressors = np.concatenate([law_wrench, by_axis], axis=-1)  # (M, 6, n + 18)
    # Prior standard deviations of the unknowns, in the order of `of_axis`: d_1, d_2, constant.
    axis_deviations = [
        model.blocks["linear"].scale,
        model.blocks["quadratic"].scale,
        missing.std(axis=0) + 1e-9,
    ]
    deviations = np.concatenate([np.ones(n), np.stack(axis_deviations, axis=-1).ravel()])
    prior = np.diag(deviations**-2.0)

    residual = missing
    for _ in range(NOISE_ROUNDS):
        noise = residual.std(axis=0) + 1e-9
        rows = (regressors / noise[:, None]).reshape(-1, n + 18)
        target = (missing / noise).ravel()
        # The filter leaves one independent sample in as many as it is long.
        information = rows.T @ rows / SMOOTHED[0] + prior
        change = np.linalg.solve(information, rows.T @ target / SMOOTHED[0])
        residual = missing - regressors @ change
    covariance = np.linalg.inv(information)
    return 1.0 + change[:n], np.sqrt(np.diag(covariance))[:n]
