"""The pseudo-inverse in force space, each fin's force looked up in its own envelope."""

import numpy as np

from finlab.arrays import Array
from finlab.forces.envelopes import layout_envelopes
from finlab.forces.force_space import planar_problem, polar
from finlab.layout import layout_effectiveness
from finlab.physics import Plant
from finlab.physics.objective import Objective

RCOND = 1e-3
"""Singular values below this share of the largest count as zero."""
STEPS = 1
"""Newton steps by the fins' own laws: one takes the looked-up forces from 1e-3 to 1e-6 of their size."""
RIDGE = 1e-12
"""Regularization of these steps, relative to the squared slopes."""


class PseudoInverse:
    """Everything about one layout that does not depend on the target.

    Args:
        plant: the robot.
        sigma: scales the rows (6,).
        objective: by which the cheapest command for each force is chosen.
        rcond: see `RCOND`.
    """

    def __init__(self, plant: Plant, sigma: Array, objective: Objective, rcond: float = RCOND) -> None:
        self.plant = plant
        self.fins = fins = layout_envelopes(plant.layout, objective)
        """What the fins can do, and at what cost."""
        self.effectiveness = layout_effectiveness(plant.layout)
        """Wrench (6, 2 n) per newton of each fin's horizontal and vertical force."""
        self._forces = planar_problem(plant.layout, fins, sigma, objective)
        most = np.repeat(np.maximum(fins.maximum, 1e-9), 2)
        scaled = self.effectiveness * most / sigma[:, None]
        self.inverse = (most[:, None] * np.linalg.pinv(scaled, rcond=rcond) / sigma).T.copy()
        """Target (6,) times this (6, 2 n) gives each fin's horizontal and vertical force [N]."""

    def command(self, targets: Array) -> Array:
        """Commands (N, n, 3) for targets (N, 6)."""
        return self.decoded(self.force(targets))

    def force(self, targets: Array) -> Array:
        """Planar forces (N, n, 2) [N] for targets (N, 6), whatever the limits."""
        return (targets @ self.inverse).reshape(len(targets), self.plant.n_fins, 2)

    def decoded(self, force: Array) -> Array:
        """The cheapest commands (N, n, 3) for planar forces (N, n, 2) [N], by the fins' own laws; what a fin
        cannot give is cut off."""
        found = polar(self._forces, force)
        point = np.stack([np.cos(found.direction), np.sin(found.direction)], axis=-1)
        return self._sharpened(self.plant.feasible(found.command), found.size[..., None] * point)

    def _sharpened(self, command: Array, wanted: Array) -> Array:
        """Commands (N, n, 3) whose planar forces are nearer to those wanted (N, n, 2), by their frequency and
        zero direction, or by their amplitude where the frequency has come to a limit."""
        plant = self.plant
        best, error = command, np.full(command.shape[:-1], np.inf)
        for step in range(STEPS + 1):
            last = step == STEPS
            force, jacobian = (plant.force(command), None) if last else plant.force_and_jacobian(command)
            missing = wanted - force[..., 1:]
            off: Array = np.hypot(missing[..., 0], missing[..., 1])
            better = off < error
            best, error = np.where(better[..., None], command, best), np.minimum(off, error)
            if jacobian is None:
                break
            frequency = command[..., 1]
            stuck = (frequency <= plant.lower[:, 1]) | (frequency >= plant.upper[:, 1])
            range_ = plant.width * np.stack([stuck, ~stuck, np.ones_like(stuck)], axis=-1)
            command = plant.feasible(
                command + range_ * _least_change(jacobian[..., 1:] * range_[..., None], missing)
            )
        return best


def _least_change(jacobian: Array, missing: Array) -> Array:
    """The least change (..., 3) of commands that makes up for forces (..., 2), by slopes (..., 3, 2)."""
    x, y = jacobian[..., 0], jacobian[..., 1]
    xx, xy, yy = (x * x).sum(-1), (x * y).sum(-1), (y * y).sum(-1)
    ridge = RIDGE * (xx + yy) + 1e-30
    xx, yy = xx + ridge, yy + ridge
    determinant = xx * yy - xy * xy
    by_x = (yy * missing[..., 0] - xy * missing[..., 1]) / determinant
    by_y = (xx * missing[..., 1] - xy * missing[..., 0]) / determinant
    change: Array = x * by_x[..., None] + y * by_y[..., None]
    return change
