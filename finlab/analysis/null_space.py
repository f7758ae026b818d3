"""The null space of the effectiveness matrix: changes of forces that leave the wrench as it is.

Forces y (m,) along the directions in which the working actuators push give the wrench B y. Where N
(m, k) is a basis of the null space of B, y + N s gives the same wrench for every s (k,) [N], as
long as every actuator has a command for its force, and the power budget allows it. The app shows
these alternatives.
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

FORCE_TOLERANCE = 1e-3
"""Share of an actuator's largest force by which the force of its command may differ from the wanted
one."""
SAMPLES = 33
"""Shifts along a direction that are tried at once."""
RANGE_ROUNDS = 3
"""Rounds of such tries, each between the last feasible shift and the next one."""
EXACT_STEPS = 20
"""Most Levenberg-Marquardt steps that make commands exact."""
EXACT_TOLERANCE = 1e-9
"""Normalized error that is enough."""
QUARTIMAX_STEPS = 100
"""Iterations towards a basis with few actuators in each direction."""


class NullSpace:
    """Changes of the forces of one answer that leave its wrench as it is."""

    def __init__(self, answer: Allocation) -> None:
        """Takes an answer of any method to one wrench; its lost actuators take no part."""
        self._works: NDArray[np.bool_] = np.array(
            [name not in answer.lost for name in answer.names]
        )
        layout = answer.layout.without(answer.lost) if answer.lost else answer.layout
        counts = np.isfinite(answer.target)
        self._plant = plant_of(layout).at(answer.flow).counting(counts)
        compiled = Compiled(layout, self._plant, answer.scale).at(self._plant.inflow(None))
        self._compiled = compiled
        self._budget = answer.budget
        self._command = answer.command[self._works]
        self._problem = CommandProblem.of(self._plant, answer.scale)
        self._wrench = self._problem.wrench(self._command[None])
        self._force = compiled.forces_along(self._plant.force(self._command))
        self._force_max = np.abs(compiled.ends).max(axis=1)
        moves: NDArray[np.bool_] = np.repeat(
            np.ptp(compiled.ends, axis=1, keepdims=True) > 0.0, 2, axis=1
        )
        moves[compiled.is_line, 1] = False
        columns = (compiled.effectiveness / answer.scale)[moves]
        moves[moves] = np.abs(columns).max(axis=1) > 0.0
        basis = _sparse(
            null_space((compiled.effectiveness / answer.scale)[moves].T, rcond=EXACT_TOLERANCE)
        )
        self.basis: Array = np.zeros((basis.shape[1], *moves.shape))
        """Directions (k, n, 2) of the null space by the forces of the n working actuators along
        their own directions, orthonormal; the second force of a thruster is 0."""
        self.basis[:, moves] = basis.T

    def participants(self, direction: int) -> dict[str, float]:
        """Returns the actuators that take part in a direction of the basis, by name, with the size
        of their component in it."""
        size = np.linalg.norm(self.basis[direction], axis=-1)
        names = self._plant.layout.names
        return {names[i]: float(size[i]) for i in np.flatnonzero(size > FORCE_TOLERANCE)}

    def commands(self, shift: Array) -> Array:
        """Returns the commands for shifts, made exact by the actuators' laws as an answer is.

        Args:
            shift: shifts (R, k) along the directions of the basis [N].

        Returns:
            Commands (R, n, 3) of all actuators, NaN for lost ones; their normalized error is at
            most 0.001.
        """
        exact = refine(
            self._problem, self._wrench, self._start_commands(shift), EXACT_STEPS, EXACT_TOLERANCE
        ).command
        moved = np.linalg.norm(shift, axis=1)[:, None, None] > 0.0
        return among_all(np.where(moved, exact, self._command), self._works)

    def ranges(self, shift: Array, count: int) -> Array:
        """Returns the feasible range of the shift along each of the first directions.

        Args:
            shift: the present shift (k,) [N], which the other directions keep.
            count: how many directions.

        Returns:
            Least and most shift (count, 2) [N]; beyond them an actuator has no command for its
            force, or a bus not enough power.
        """
        directions = (
            np.repeat(np.eye(count, len(shift)), 2, axis=0) * np.tile([-1.0, 1.0], count)[:, None]
        )
        force = self._forces(shift)
        change = np.linalg.norm(np.tensordot(directions, self.basis, 1), axis=-1)
        distance_max = (self._force_max + np.linalg.norm(force, axis=-1)) / np.maximum(
            change, 1e-12
        )
        low = np.zeros(2 * count)
        width = distance_max.min(axis=1)
        for _ in range(RANGE_ROUNDS):
            size = low[:, None] + np.linspace(0.0, 1.0, SAMPLES) * width[:, None]
            shifts = shift + size[..., None] * directions[:, None]
            is_feasible = self._has_commands(shifts.reshape(size.size, len(shift))).reshape(
                size.shape
            )
            is_feasible[:, 0] = True
            last_feasible = np.minimum(is_feasible.cumprod(axis=1).sum(axis=1) - 1, SAMPLES - 2)
            low = size[np.arange(len(size)), last_feasible]
            width = width / (SAMPLES - 1)
        return np.asarray(shift[:count, None] + low.reshape(-1, 2) * [-1.0, 1.0])

    def mean(self, first: Array, second: Array) -> Array:
        """Returns the mean of two commands: what a model with one answer learns from both.

        Args:
            first: commands (n, 3).
            second: commands (n, 3).

        Returns:
            Commands (n, 3); the mean of angles that turn freely lies on the shorter arc.
        """
        change = second - first
        is_free_angle = np.zeros(first.shape, bool)
        is_free_angle[self._works] = self._plant.turns
        mean = first + 0.5 * np.where(is_free_angle, wrapped(change), change)
        return among_all(self._plant.feasible(mean[self._works]), self._works)

    def _forces(self, shift: Array) -> Array:
        """Forces (..., n, 2) [N] at shifts (..., k)."""
        return np.asarray(self._force + np.tensordot(shift, self.basis, 1))

    def _start_commands(self, shift: Array) -> Array:
        """Commands (R, n, 3) for shifts (R, k) by the tables of the core, before they are exact."""
        return self._compiled.core.commands(self._forces(shift), self._command)

    def _has_commands(self, shift: Array) -> NDArray[np.bool_]:
        """Whether all actuators have commands for shifts (R, k), within the power budget."""
        force = self._forces(shift)
        command = self._start_commands(shift)
        force_of_command = self._compiled.forces_along(self._plant.force(command))
        counts = np.where(
            self._compiled.is_line[:, None], [1.0, 0.0], 1.0
        )  # drag comes with the lift
        error = np.linalg.norm((force_of_command - force) * counts, axis=-1)
        is_given = (error <= FORCE_TOLERANCE * self._force_max).all(axis=1)
        return np.asarray(is_given & self._is_within_budget(command))

    def _is_within_budget(self, command: Array) -> NDArray[np.bool_]:
        """Whether commands (R, n, 3) of the working actuators keep the power budget of the
        answer."""
        if self._budget is None:
            return np.ones(len(command), bool)
        power = np.zeros((len(command), len(self._works)))
        power[:, self._works] = self._plant.power(command)
        return self._budget.are_kept(power)


def _sparse(basis: Array) -> Array:
    """An orthonormal basis (m, k) of the same space with few large numbers in each direction: the
    turn that maximizes the sum of their fourth powers (quartimax), the direction of most first."""
    count = basis.shape[1]
    rotation = np.linalg.qr(np.random.default_rng(0).normal(size=(count, count)))[0]
    for _ in range(QUARTIMAX_STEPS):
        left, _, right = np.linalg.svd(basis.T @ (basis @ rotation) ** 3)
        rotation = left @ right
    rotated = basis @ rotation
    size = (rotated**4).sum(axis=0)
    rotated = rotated[:, np.argsort(-size, kind="stable")]
    largest = np.take_along_axis(rotated, np.abs(rotated).argmax(axis=0)[None], axis=0)
    return np.asarray(rotated * np.sign(largest))
