"""The pseudo-inverse in force space, each actuator's force turned into its cheapest command."""

import numpy as np

from finlab.actuators.registry import groups_of
from finlab.actuators.response import Line, Plane, Response
from finlab.arrays import Array
from finlab.layout.axes import wrapped
from finlab.physics import Plant

RCOND = 1e-3
"""Singular values below this share of the largest count as zero."""
SAME_DIRECTION = 1e-6
"""The same where directions of the wrench are told apart in which the actuators push at all."""

_FULL = 0.0, np.pi
"""Middle and half of an arc [rad] that cuts nothing off."""


class PseudoInverse:
    """What does not depend on the target, of a robot in the flow that it has, rows scaled by `sigma` (6,).
    Forces are along each actuator's own two directions; the second one of a line is 0."""

    def __init__(self, plant: Plant, sigma: Array) -> None:
        self.plant, inflow = plant, plant.inflow(None)
        self.groups = [
            (places, group.at(None if inflow is None else inflow[places]))
            for places, group in groups_of(plant.layout, plant.effectiveness)
        ]
        """What the actuators can do, and by which commands."""
        self.places = sorted(
            (int(i), k, j) for k, (own, _) in enumerate(self.groups) for j, i in enumerate(own)
        )
        """Of each actuator, in order: itself, its group, and its place there."""
        self.responses: list[Response] = [self.groups[k][1].responses[j] for _, k, j in self.places]
        """What each offers."""
        self.beside = sum((group.beside.sum(axis=0) for _, group in self.groups), np.zeros(6))
        """Wrench (6,) [N, N m] of forces of 0, such as the drag of foils."""
        along = [np.reshape(each.effectiveness, (-1, 6)) for each in self.responses]
        both = [np.concatenate([rows, np.zeros((2 - len(rows), 6))]) for rows in along]
        self.effectiveness: Array = np.concatenate(both).T
        """Wrench (6, 2 n) per newton along each actuator's directions."""
        self.largest = np.array([_largest(each) for each in self.responses])
        """The largest force (n,) of each in any direction [N]."""
        arcs = [(each.middle, each.half) if isinstance(each, Plane) else _FULL for each in self.responses]
        self._middle, self._half = np.array(arcs).T
        most = np.repeat(np.maximum(self.largest, 1e-9), 2)
        scaled = self.effectiveness * most / sigma[:, None]
        self.inverse = (most[:, None] * np.linalg.pinv(scaled, rcond=RCOND) / sigma).T.copy()
        """Target (6,) times this (6, 2 n) gives each actuator's forces [N]."""

    def command(self, targets: Array) -> Array:
        """Commands (N, n, 3) for targets (N, 6)."""
        return self.decoded(self.force(targets))

    def force(self, targets: Array) -> Array:
        """Forces (N, n, 2) [N] for targets (N, 6), whatever the limits."""
        return ((targets - self.beside) @ self.inverse).reshape(len(targets), self.plant.n, 2)

    def decoded(self, force: Array) -> Array:
        """The cheapest commands (N, n, 3) for forces (N, n, 2) [N]; what an actuator cannot give is cut
        off."""
        angle = wrapped(np.arctan2(force[..., 1], force[..., 0]) - self._middle)
        held = np.clip(angle, -self._half, self._half)
        excess = np.minimum(np.abs(angle - held), 0.5 * np.pi)
        size = np.hypot(force[..., 0], force[..., 1]) * np.cos(excess)
        angle = self._middle + held
        inside = size[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        command = np.empty((*size.shape, 3))
        for places, group in self.groups:
            command[:, places] = group.commands(inside[:, places])
        return self.plant.feasible(command)


def _largest(response: Response) -> float:
    if isinstance(response, Line):
        reverse = 0.0 if response.reverse is None else response.reverse.largest
        return max(response.forward.largest, reverse)
    return response.table.largest * (1.0 if response.gauge is None else float(response.gauge.max()))


def pushed_axes(effectiveness: Array) -> Array:
    """Directions (r, 6) of the wrench in which columns (6, k) push at all, each once."""
    axes, size, _ = np.linalg.svd(effectiveness)
    return np.asarray(axes[:, : int((size > SAME_DIRECTION * size[0]).sum())].T)
