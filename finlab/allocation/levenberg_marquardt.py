"""Levenberg-Marquardt on the commands, through closed-form Jacobians of the forces, inside the
limits.

The last stage of a search: it works in commands, not forces, and with the actuators' own laws, so
it removes the error that compiled tables leave. The paper's method uses it with its surrogate.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import NOTHING, AnyArray, Array, solve
from finlab.axes import feasible
from finlab.physics.plant import Plant

if TYPE_CHECKING:
    from finlab.allocation.rates import Box

RIDGE = (1e-9, 1e-14)
"""Regularization of the 6 x 6 systems: absolute, and relative to their trace. Without the latter
those of strong fins on long levers are singular to rounding."""
ZERO_DIRECTION = np.array([False, False, True])
"""Which numbers of a fin's command are angles."""


@dataclass(frozen=True, eq=False)
class CommandProblem:
    """One layout as the refinement sees it."""

    forces: Any
    """Gives forces (..., n, 3) [N] of commands by `force`, with derivatives by
    `force_and_jacobian`, as a `Plant` does, each in a frame of its own choice: the actuators' own
    laws, or a surrogate."""
    effectiveness: AnyArray
    """Normalized wrench (n, 3, 6) per newton along the axes of each force."""
    lower: AnyArray
    """Lower limits (n, 3)."""
    upper: AnyArray
    """Upper limits (n, 3)."""
    full_turn: NDArray[np.bool_]
    """True (n,) where the zero direction may turn a full circle."""
    sigma: Array | None = None
    """What wrenches are divided by (6,), of a plant whose actuators act on each other; None of any
    other."""
    works: NDArray[np.bool_] | None = None
    """Which actuators (n,) give a force; None where all do."""
    counts: NDArray[np.bool_] | None = None
    """Which axes (6,) of the wrench count; None where all do."""

    @classmethod
    def of(cls, plant: Plant, sigma: Array) -> Self:
        """A robot as its actuators' own laws say, wrenches normalized by `sigma` (6,)."""
        own = None if plant.interaction is None else sigma
        return cls(
            plant, plant.effectiveness / sigma, plant.lower, plant.upper, plant.full_turn, own
        )

    def standing(self, works: NDArray[np.bool_] | None, counts: NDArray[np.bool_] | None) -> Self:
        """Returns the problem of the same robot where some actuators (n,) work and some axes (6,)
        count."""
        effectiveness = self.effectiveness
        if works is not None:
            effectiveness = np.where(works[:, None, None], effectiveness, 0.0)
        if counts is not None:
            effectiveness = np.where(counts, effectiveness, 0.0)
        return replace(self, effectiveness=effectiveness, works=works, counts=counts)

    def after(self, box: "Box") -> Self:
        """Returns the problem within what may follow the command of the tick before."""
        full_turn = box.free[:, 2] & self.full_turn
        return replace(self, lower=box.lower, upper=box.upper, full_turn=full_turn)

    @cached_property
    def width(self) -> AnyArray:
        """Ranges of the limits (n, 3)."""
        return self.upper - self.lower

    @cached_property
    def edges(self) -> tuple[AnyArray, AnyArray]:
        """Below the first and above the second (n, 3), a command is at its limit; full circles have
        none."""
        low = self.lower + NOTHING
        high = self.upper - NOTHING
        low[self.full_turn, 2] = -np.inf
        high[self.full_turn, 2] = np.inf
        return low, high

    def wrench(self, command: AnyArray) -> AnyArray:
        """Normalized wrenches (R, 6) of commands (R, n, 3)."""
        return self.wrench_of(self.forces.force(command))

    def wrench_of(self, force: AnyArray) -> AnyArray:
        """The same of forces (R, n, 3)."""
        effectiveness = self.effectiveness.reshape(-1, 6)
        wrench: AnyArray = force.reshape(len(force), len(effectiveness)).dot(effectiveness)
        if self.sigma is None:
            return wrench
        acting = force if self.works is None else np.where(self.works[:, None], force, 0.0)
        offset = self.forces.offset(acting) / self.sigma
        return wrench + (offset if self.counts is None else np.where(self.counts, offset, 0.0))

    def slope(self, command: AnyArray) -> tuple[AnyArray, AnyArray]:
        """Normalized wrenches (R, 6) of commands (R, n, 3), and their derivatives (R, n, 3, 6)."""
        force, jacobian = self.forces.force_and_jacobian(command)
        if self.sigma is None:
            return self.wrench_of(force), np.matmul(jacobian, self.effectiveness)
        acting = force if self.works is None else np.where(self.works[:, None], force, 0.0)
        offset, effectiveness = self.forces.effect(acting)
        offset = offset / self.sigma
        effectiveness = effectiveness / self.sigma
        if self.works is not None:
            effectiveness = np.where(self.works[:, None, None], effectiveness, 0.0)
        if self.counts is not None:
            offset, effectiveness = (
                np.where(self.counts, each, 0.0) for each in (offset, effectiveness)
            )
        wrench = np.einsum("rnk,nkw->rw", force, self.effectiveness) + offset
        return wrench, np.matmul(jacobian, effectiveness)

    def feasible(self, command: AnyArray) -> AnyArray:
        """Commands (..., n, 3) inside the limits, zero directions wrapped first."""
        return feasible(command, self.lower, self.upper, ZERO_DIRECTION)


class Refined(NamedTuple):
    """R refined commands."""

    command: AnyArray
    """(R, n, 3), inside the limits."""
    wrench: AnyArray
    """Normalized wrench (R, 6)."""
    error: AnyArray
    """Normalized error (R,) of that wrench."""


def refine(
    problem: CommandProblem, target: AnyArray, command: AnyArray, steps: int, enough: float = 0.0
) -> Refined:
    """Reduces the error of commands (R, n, 3) towards normalized targets (R, 6), or one (1, 6), in
    some steps; a row whose error is `enough` takes no more.

    Each step is the smallest change, in units of the limit ranges, that cancels the error to first
    order; commands at a limit that would leave it are held.
    """

    from finlab.least_squares import Damping, levenberg_marquardt

    def moved(at: _Evaluated, damping: AnyArray, last: bool) -> _Evaluated:
        # (R, n, 3 commands, 6): change of the normalized wrench per unit of each limit range.
        jacobian = at.jacobian * problem.width[..., None]
        there = _step(problem, at, jacobian, damping)
        there *= problem.width
        there += at.command
        return _evaluated(problem, target, problem.feasible(there), at.jacobian if last else None)

    # Where nothing better is found this is the answer: it must not lie outside by a turn or a
    # rounding error.
    start = _evaluated(problem, target, problem.feasible(command), None if steps else _NO_GRADIENT)
    best = levenberg_marquardt(start, moved, steps, Damping(1e-6), enough=enough**2)
    return Refined(best.command, best.wrench, np.sqrt(best.cost))


class _Evaluated(NamedTuple):
    """R commands, normalized wrenches (R, 6), targets minus these, squared sizes of that (R,), and
    the derivatives of the wrenches (R, n, 3 commands, 6)."""

    command: AnyArray
    wrench: AnyArray
    residual: AnyArray
    cost: AnyArray
    jacobian: AnyArray


_NO_GRADIENT = np.empty((1, 1, 1, 1))


def _evaluated(
    problem: CommandProblem, target: AnyArray, command: AnyArray, jacobian: AnyArray | None
) -> _Evaluated:
    """Errors of commands; slopes that are given are not computed again."""
    if jacobian is None:
        wrench, jacobian = problem.slope(command)
    else:
        wrench = problem.wrench(command)
    residual = target - wrench
    return _Evaluated(
        command, wrench, residual, np.einsum("ri,ri->r", residual, residual), jacobian
    )


def _step(
    problem: CommandProblem, at: _Evaluated, jacobian: AnyArray, damping: AnyArray
) -> AnyArray:
    """Damped smallest change (R, n, 3), in units of the limit ranges, that leaves no limit."""
    rows, n, _ = at.command.shape
    free = jacobian.reshape(rows, 3 * n, 6)
    right = at.residual[..., None]
    low, high = problem.edges
    at_low = at.command <= low
    at_high = at.command >= high

    def leaving(step: AnyArray) -> AnyArray:
        """Which commands (R, n, 3) at a limit a step takes out."""
        return np.asarray((at_low & (step < 0.0)) | (at_high & (step > 0.0)))

    step = _smallest_change(free, right, damping).reshape(rows, n, 3)
    held = leaving(step)
    if not held.any():
        return step
    step = _smallest_change(free * ~held.reshape(rows, 3 * n, 1), right, damping).reshape(
        rows, n, 3
    )
    return np.where(leaving(step), 0.0, step)


def _smallest_change(free: AnyArray, right: AnyArray, damping: AnyArray) -> AnyArray:
    """The change (R, 3n, 1) that gives the wrenches (R, 6, 1) by a Jacobian (R, 3n, 6)."""
    gram = free.swapaxes(1, 2) @ free
    diagonal = gram.reshape(-1, 36)[:, ::7]
    # By the derivatives themselves: no bound holds for fins whose force falls again, or rises from
    # rest.
    diagonal += (damping + RIDGE[0] + RIDGE[1] * np.einsum("ri->r", diagonal))[:, None]
    return np.asarray(free @ solve(gram, right))
