"""Which actuators push the other way than drawn, before a fit, whose strengths are logarithms.

What the measured accelerations need beside what the body does by itself is linear in the shares that the
actuators give of their laws' forces, and in errors of the damping: one weighted least-squares problem of both
sides after the same low-pass filter (equation error; V. Klein and E. Morelli, Aircraft System
Identification).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from finlab.arrays import Array
from finlab.fit.robot.model import RobotModel
from finlab.fit.robot.swim import SMOOTHED, STEP_S, Swim
from finlab.layout import Layout, Rudder, Thruster
from finlab.layout.directions import with_axes
from finlab.layout.effectiveness import own_effectiveness
from finlab.vehicle.attitude import rotation_of_angles
from finlab.vehicle.fossen import accelerations

BACKWARDS = -0.25
"""A share of its law's force below which an actuator pushes the other way, and not hardly."""
SURE = 4.0
"""Standard errors by which that share lies below 0."""
ROUNDS = 4
"""Times that the noise of each axis is estimated."""


def opposed_in(layout: Layout, names: Sequence[str]) -> Layout:
    """Returns a robot of which some actuators push the other way at every command: of fins and azimuths zero
    is turned about, of thrusters and rudders the first axis."""
    parts = list(layout.actuators)
    for k in layout.indices(names):
        part = parts[k]
        first = isinstance(part, Thruster | Rudder)
        parts[k] = with_axes(part, np.array(part.frame) * ([[-1], [1], [-1]] if first else [[1], [-1], [-1]]))
    return replace(layout, actuators=tuple(parts))


def pushing_back(model: RobotModel, swims: Sequence[Swim], smooth: Array) -> tuple[str, ...]:
    """Returns the names of the actuators that push the other way, by smoothed measurements (M, 12).

    One that the swims do not tell apart from others counts as drawn.
    """
    share, error = _shares(model, [len(swim) for swim in swims], smooth)
    backwards = (share < BACKWARDS) & (share < -SURE * error)
    return tuple(np.array(model.layout.names)[backwards].tolist())


def _shares(model: RobotModel, lengths: Sequence[int], smooth: Array) -> tuple[Array, Array]:
    """Shares (n,) of their laws' forces that actuators give, and standard errors; believed to be 1 +- 1."""
    from scipy.signal import savgol_filter

    def filtered(values: Array, order: int = 0) -> Array:
        parts = np.split(values, np.cumsum(lengths)[:-1])
        kept = [savgol_filter(part, *SMOOTHED, deriv=order, delta=STEP_S, axis=0) for part in parts]
        return np.concatenate(kept)

    n, flow, body = model.layout.n, smooth[:, 6:], model.dynamics
    model.meet(flow)
    given = filtered(np.einsum("mnk,nkw->mwn", model.alone.mean(axis=1), own_effectiveness(model.layout)))
    up = rotation_of_angles(smooth[:, 3:6].T)[2::3]
    alone = np.stack(accelerations(body, flow.T, up, np.zeros(6)), axis=-1)
    missing = (filtered(flow, 1) - alone) * body.inertia - given.sum(axis=-1)
    damped = -np.stack([flow, flow * np.abs(flow), np.ones_like(flow)], axis=-1)  # (M, 6, 3)
    by = np.concatenate([given, (np.eye(6)[:, :, None] * damped[:, :, None]).reshape(-1, 6, 18)], axis=-1)
    wide = [model.blocks["linear"].scale, model.blocks["quadratic"].scale, missing.std(axis=0) + 1e-9]
    believed = np.diag(np.concatenate([np.ones(n), np.stack(wide, axis=-1).ravel()]) ** -2.0)
    left = missing
    for _ in range(ROUNDS):
        noise = left.std(axis=0) + 1e-9
        rows, wanted = (by / noise[:, None]).reshape(-1, n + 18), (missing / noise).ravel()
        # The filter leaves one independent sample in as many as it is long.
        information = rows.T @ rows / SMOOTHED[0] + believed
        found = np.linalg.solve(information, rows.T @ wanted / SMOOTHED[0])
        left = missing - by @ found
    return 1.0 + found[:n], np.sqrt(np.diag(np.linalg.inv(information)))[:n]
