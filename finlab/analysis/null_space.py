"""Other ways to give the same wrench: the null space of the effectiveness matrix, in the space of
forces.

Forces y (m,) along the directions in which the working actuators push give the wrench B y. Where N
(m, k) is a basis of the null space of B, y + N s gives the same wrench for every s (k,) [N], and is
another way to do it as long as every actuator has a command for its part.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from finlab.allocation.allocation import Allocation
from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.allocation.solution import among_all
from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.physics import plant_of

HELD = 1e-3
"""Share of an actuator's largest force by which that of its command may differ from the one asked
for."""
TRIED, ROUNDS = 33, 3
"""Places along a direction at which commands are tried, and how often, anew between the last
two."""
STEPS, EXACT = 20, 1e-9
"""Steps that make commands exact, and the normalized error that is enough."""
TURNS = 100
"""Steps towards a basis with few actuators in each direction."""


class NullSpace:
    """What can be added to the forces of one answer without any change of the wrench that it
    gives."""

    def __init__(self, answer: Allocation) -> None:
        """Takes an answer of any method to one wrench; its lost actuators have no part in any
        direction."""
        self._alive: NDArray[np.bool_] = np.array(
            [name not in answer.lost for name in answer.names]
        )
        layout = answer.layout.without(answer.lost) if answer.lost else answer.layout
        counts = np.isfinite(answer.target)
        self._plant = plant_of(layout).at(answer.flow).counting(counts)
        compiled = Compiled(layout, self._plant, answer.scale).at(self._plant.inflow(None))
        self._compiled = compiled
        robot = compiled.robot
        self._command = answer.command[self._alive]
        self._problem = CommandProblem.of(self._plant, answer.scale)
        self._wrench = self._problem.wrench(self._command[None])
        self._force = compiled.forces_along(self._plant.force(self._command))
        self._most = np.abs(robot.ends).max(axis=1)
        moves: NDArray[np.bool_] = np.repeat(
            np.ptp(robot.ends, axis=1, keepdims=True) > 0.0, 2, axis=1
        )
        moves[robot.is_line, 1] = False
        columns = (robot.effectiveness / answer.scale)[moves]
        moves[moves] = np.abs(columns).max(axis=1) > 0.0
        basis = _sparse(null_space((robot.effectiveness / answer.scale)[moves].T, rcond=EXACT))
        self.basis: Array = np.zeros((basis.shape[1], *moves.shape))
        """Directions (k, n, 2) of the null space by the forces of the n working actuators along
        their own directions, orthonormal; the second force of a thruster is 0."""
        self.basis[:, moves] = basis.T

    def takers(self, direction: int) -> dict[str, float]:
        """Returns the actuators that push otherwise along a direction, and the size of their share
        in it."""
        size = np.linalg.norm(self.basis[direction], axis=-1)
        names = self._plant.layout.names
        return {names[i]: float(size[i]) for i in np.flatnonzero(size > HELD)}

    def commands(self, shift: Array) -> Array:
        """Returns commands (R, n, 3) of all actuators for shifts (R, k) [N] along the directions,
        made exact by the actuators' own laws, as an answer is (an error of at most 0.001); NaN for
        lost ones."""
        exact = refine(self._problem, self._wrench, self._begin(shift), STEPS, EXACT).command
        moved = np.linalg.norm(shift, axis=1)[:, None, None] > 0.0
        return among_all(np.where(moved, exact, self._command), self._alive)

    def ranges(self, shift: Array, count: int) -> Array:
        """Returns from where to where one may go along each of the first directions (count, 2) [N],
        the others as they are in `shift` (k,), until an actuator has no command for its force."""
        way = np.repeat(np.eye(count, len(shift)), 2, axis=0) * np.tile([-1.0, 1.0], count)[:, None]
        force = self._forces(shift)
        part = np.linalg.norm(np.tensordot(way, self.basis, 1), axis=-1)
        room = (self._most + np.linalg.norm(force, axis=-1)) / np.maximum(part, 1e-12)
        low = np.zeros(2 * count)
        width = room.min(axis=1)
        for _ in range(ROUNDS):
            size = low[:, None] + np.linspace(0.0, 1.0, TRIED) * width[:, None]
            tried = shift + size[..., None] * way[:, None]
            holds = self._has_commands(tried.reshape(size.size, len(shift))).reshape(size.shape)
            holds[:, 0] = True
            last = np.minimum(holds.cumprod(axis=1).sum(axis=1) - 1, TRIED - 2)
            low = size[np.arange(len(size)), last]
            width = width / (TRIED - 1)
        return np.asarray(shift[:count, None] + low.reshape(-1, 2) * [-1.0, 1.0])

    def mean(self, first: Array, second: Array) -> Array:
        """Returns the mean (n, 3) of two commands (n, 3), of angles that turn freely the shorter
        way round: what a model with one answer learns from both."""
        change = second - first
        turns = np.zeros(first.shape, bool)
        turns[self._alive] = self._plant.turns
        middle = first + 0.5 * np.where(turns, wrapped(change), change)
        return among_all(self._plant.feasible(middle[self._alive]), self._alive)

    def _forces(self, shift: Array) -> Array:
        return np.asarray(self._force + np.tensordot(shift, self.basis, 1))

    def _begin(self, shift: Array) -> Array:
        return self._compiled.robot.core.commands(self._forces(shift), self._command)

    def _has_commands(self, shift: Array) -> NDArray[np.bool_]:
        """Whether all actuators have commands for shifts (R, k)."""
        wanted = self._forces(shift)
        command = self._begin(shift)
        got = self._compiled.forces_along(self._plant.force(command))
        free = np.where(
            self._compiled.robot.is_line[:, None], [1.0, 0.0], 1.0
        )  # drag comes with the lift
        off = np.linalg.norm((got - wanted) * free, axis=-1)
        return np.asarray((off <= HELD * self._most).all(axis=1))


def _sparse(basis: Array) -> Array:
    """An orthonormal basis (m, k) of the same space with few large numbers in each direction: the
    turn that maximizes the sum of their fourth powers (quartimax), the direction of most first."""
    count = basis.shape[1]
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(count, count)))[0]
    for _ in range(TURNS):
        left, _, right = np.linalg.svd(basis.T @ (basis @ turn) ** 3)
        turn = left @ right
    turned = basis @ turn
    size = (turned**4).sum(axis=0)
    turned = turned[:, np.argsort(-size, kind="stable")]
    largest = np.take_along_axis(turned, np.abs(turned).argmax(axis=0)[None], axis=0)
    return np.asarray(turned * np.sign(largest))
