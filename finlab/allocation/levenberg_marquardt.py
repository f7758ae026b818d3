"""Levenberg-Marquardt on the commands, through closed-form Jacobians of the forces, inside the
limits (Eq. 11).

The last stage of a search: it works in commands, not forces, and with the actuators' own laws, so
it removes the error that compiled tables leave. The baselines use it for all.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import NOTHING, AnyArray, Array, solve_or_nan
from finlab.axes import feasible
from finlab.physics.plant import Plant

if TYPE_CHECKING:
    from finlab.allocation.rates import CommandBox

RIDGE = (1e-9, 1e-14)
"""Regularization of the 6 x 6 systems: absolute, and relative to their trace. Without the latter
those of strong fins on long levers are singular to rounding."""
FIRST_DAMPING = 1e-6
"""Damping of the first step: nearly that of Newton, for starts are near."""
FIN_DIRECTION = np.array([False, False, True])
"""Which number of a fin's command is an angle. It wraps in a narrow arc, too, as proposals of
networks may lie a turn away; a thruster has nothing there."""


@dataclass(frozen=True, eq=False)
class CommandProblem:
    """One layout as the refinement sees it: normalized wrenches of commands, and limits."""

    plant: Plant
    """Gives forces (..., n, 3) [N] of commands by the actuators' own laws, with derivatives, and
    the wrench offset of actuators that act on each other."""
    effectiveness: AnyArray
    """Normalized wrench (n, 3, 6) per newton along the axes of each force."""
    lower: AnyArray
    """Lower limits (n, 3)."""
    upper: AnyArray
    """Upper limits (n, 3)."""
    wraps: NDArray[np.bool_]
    """Angles (n, 3) that are brought near to the middle of their limits by full turns."""
    no_limits: NDArray[np.bool_]
    """Those of them (n, 3) that all angles may follow: at +-pi they are at no limit."""
    error_scale: Array | None = None
    """What wrenches (6,) are divided by [N, N m], the wrench scale or the `asked_scale` of a
    method, where actuators act on each other; None where they do not."""
    works: NDArray[np.bool_] | None = None
    """Which actuators (n,) give a force; None where all do."""
    counts: NDArray[np.bool_] | None = None
    """Which axes (6,) of the wrench count; None where all do."""

    @classmethod
    def of(cls, plant: Plant, error_scale: Array) -> Self:
        """Poses the problem by the actuators' own laws.

        Args:
            plant: of the robot.
            error_scale: what wrenches (6,) are divided by [N, N m]: the wrench scale, or the
                `asked_scale` of a method.

        Returns:
            The problem within the limits of the robot.
        """
        return cls(
            plant=plant,
            effectiveness=plant.effectiveness / error_scale,
            lower=plant.lower,
            upper=plant.upper,
            wraps=plant.turns | FIN_DIRECTION,
            no_limits=plant.turns,
            error_scale=None if plant.interaction is None else error_scale,
        )

    def restricted(self, works: NDArray[np.bool_] | None, counts: NDArray[np.bool_] | None) -> Self:
        """Returns the problem of some actuators and some axes.

        Args:
            works: which actuators (n,) work; None for all.
            counts: which axes (6,) count; None for all.

        Returns:
            The problem in which the others give nothing, and the other axes are 0.
        """
        effectiveness = self.effectiveness
        if works is not None:
            effectiveness = np.where(works[:, None, None], effectiveness, 0.0)
        if counts is not None:
            effectiveness = np.where(counts, effectiveness, 0.0)
        return replace(self, effectiveness=effectiveness, works=works, counts=counts)

    def in_tick(self, box: "CommandBox") -> Self:
        """Returns the problem within what may follow the command of the tick before."""
        no_limits = box.any_angle & self.no_limits
        return replace(self, lower=box.lower, upper=box.upper, no_limits=no_limits)

    @cached_property
    def width(self) -> AnyArray:
        """Ranges of the limits (n, 3)."""
        return self.upper - self.lower

    @cached_property
    def edges(self) -> tuple[AnyArray, AnyArray]:
        """Below the first and above the second (n, 3), a command is at its limit; angles without
        limits never are."""
        low = np.where(self.no_limits, -np.inf, self.lower + NOTHING)
        high = np.where(self.no_limits, np.inf, self.upper - NOTHING)
        return low, high

    def wrench(self, command: AnyArray) -> AnyArray:
        """Returns the normalized wrenches (R, 6) of commands (R, n, 3)."""
        return self.wrench_of(self.plant.force(command))

    def wrench_of(self, force: AnyArray) -> AnyArray:
        """Returns the normalized wrenches (R, 6) of forces (R, n, 3) [N]."""
        effectiveness = self.effectiveness.reshape(-1, 6)
        wrench: AnyArray = force.reshape(len(force), len(effectiveness)).dot(effectiveness)
        if self.error_scale is None:
            return wrench
        offset = self.plant.offset(self._of_working(force)) / self.error_scale
        return wrench + self._in_counted_axes(offset)

    def wrench_and_jacobian(self, command: AnyArray) -> tuple[AnyArray, AnyArray]:
        """Returns the normalized wrenches (R, 6) of commands (R, n, 3), and their derivatives J
        (R, n, 3, 6) by the commands."""
        force, force_jacobian = self.plant.force_and_jacobian(command)
        if self.error_scale is None:
            return self.wrench_of(force), np.matmul(force_jacobian, self.effectiveness)
        offset, effectiveness = self.plant.effect(self._of_working(force))
        offset = offset / self.error_scale
        effectiveness = effectiveness / self.error_scale
        if self.works is not None:
            effectiveness = np.where(self.works[:, None, None], effectiveness, 0.0)
        offset = self._in_counted_axes(offset)
        effectiveness = self._in_counted_axes(effectiveness)
        wrench = np.einsum("rnk,nkw->rw", force, self.effectiveness) + offset
        return wrench, np.matmul(force_jacobian, effectiveness)

    def _of_working(self, force: AnyArray) -> AnyArray:
        """Forces (R, n, 3), 0 of the actuators that do not work."""
        return force if self.works is None else np.where(self.works[:, None], force, 0.0)

    def _in_counted_axes(self, wrench: AnyArray) -> AnyArray:
        """Wrenches (..., 6), 0 along the axes that do not count."""
        return wrench if self.counts is None else np.where(self.counts, wrench, 0.0)

    def feasible(self, command: AnyArray) -> AnyArray:
        """Returns commands (..., n, 3) inside the limits, angles wrapped first."""
        return feasible(command, self.lower, self.upper, self.wraps)


class RefinedCommands(NamedTuple):
    """R refined commands, and what they give."""

    command: AnyArray
    """(R, n, 3), inside the limits."""
    wrench: AnyArray
    """Normalized wrench (R, 6)."""
    error: AnyArray
    """Normalized error (R,) of that wrench."""


def refine(
    problem: CommandProblem, target: AnyArray, command: AnyArray, steps: int, enough: float = 0.0
) -> RefinedCommands:
    """Reduces the error of commands by Levenberg-Marquardt steps.

    Each step is the smallest change, in units of the limit ranges, that cancels the error to first
    order; commands at a limit that would leave it are held.

    Args:
        problem: the robot.
        target: normalized wrenches (R, 6), or one (1, 6) for all.
        command: (R, n, 3) where the steps begin.
        steps: most steps, those included that are undone.
        enough: normalized error at which a row takes no further step.

    Returns:
        For each row the best command on the way, never worse than the first one within the limits.
    """
    # Most answers of the default method need no step: `finlab allocate` is to load few files.
    from finlab.least_squares import DampingRule, levenberg_marquardt

    def after_step(at: _Iterate, damping: AnyArray, is_last: bool) -> _Iterate:
        # (R, n, 3, 6): change of the normalized wrench per unit of each limit range.
        jacobian = at.jacobian * problem.width[..., None]
        moved = _step(problem, at, jacobian, damping)
        moved *= problem.width
        moved += at.command
        known_jacobian = at.jacobian if is_last else None
        return _iterate(problem, target, problem.feasible(moved), known_jacobian)

    # Where nothing better is found the first command is the answer: it must not lie outside by a
    # turn or a rounding error.
    known_jacobian = None if steps else _NO_JACOBIAN
    start = _iterate(problem, target, problem.feasible(command), known_jacobian)
    rule = DampingRule(initial=FIRST_DAMPING)
    best = levenberg_marquardt(start, after_step, steps, rule, cost_tolerance=enough**2)
    return RefinedCommands(best.command, best.wrench, np.sqrt(best.cost))


class _Iterate(NamedTuple):
    """R commands between two steps, and what they give."""

    command: AnyArray
    """(R, n, 3)."""
    wrench: AnyArray
    """Normalized wrenches (R, 6)."""
    residual: AnyArray
    """Targets minus these wrenches (R, 6)."""
    cost: AnyArray
    """Squared sizes (R,) of the residuals."""
    jacobian: AnyArray
    """Derivatives (R, n, 3, 6) of the wrenches by the commands."""


_NO_JACOBIAN = np.empty((1, 1, 1, 1))
"""Stands for derivatives that nobody reads, where no step is taken."""


def _iterate(
    problem: CommandProblem, target: AnyArray, command: AnyArray, known_jacobian: AnyArray | None
) -> _Iterate:
    """Evaluates commands (R, n, 3); derivatives that are known are not computed again."""
    if known_jacobian is None:
        wrench, jacobian = problem.wrench_and_jacobian(command)
    else:
        wrench = problem.wrench(command)
        jacobian = known_jacobian
    residual = target - wrench
    cost = np.einsum("ri,ri->r", residual, residual)
    return _Iterate(command, wrench, residual, cost, jacobian)


def _step(problem: CommandProblem, at: _Iterate, jacobian: AnyArray, damping: AnyArray) -> AnyArray:
    """Damped smallest change (R, n, 3), in units of the limit ranges, that leaves no limit.

    Commands that a first step takes out of their limits are held, and a second step is found by the
    others; what that one takes out stays where it is.
    """
    rows, n, _ = at.command.shape
    jacobian = jacobian.reshape(rows, 3 * n, 6)
    residual = at.residual[..., None]
    low, high = problem.edges
    at_low = at.command <= low
    at_high = at.command >= high

    def leaves_limits(step: AnyArray) -> AnyArray:
        """Which commands (R, n, 3) at a limit a step takes out of it."""
        return np.asarray((at_low & (step < 0.0)) | (at_high & (step > 0.0)))

    step = _smallest_change(jacobian, residual, damping).reshape(rows, n, 3)
    held = leaves_limits(step)
    if not held.any():
        return step
    jacobian_of_others = jacobian * ~held.reshape(rows, 3 * n, 1)
    step = _smallest_change(jacobian_of_others, residual, damping).reshape(rows, n, 3)
    return np.where(leaves_limits(step), 0.0, step)


def _smallest_change(jacobian: AnyArray, residual: AnyArray, damping: AnyArray) -> AnyArray:
    """The change J^T (J J^T + mu I)^-1 r (R, 3n, 1) of Eq. 11 for residuals r (R, 6, 1); the
    Jacobians (R, 3n, 6) are given as J^T, the damping mu as (R,)."""
    gram = jacobian.swapaxes(1, 2) @ jacobian
    diagonal = gram.reshape(-1, 36)[:, ::7]
    # Measured by the derivatives themselves: no bound of them holds for fins whose force falls
    # again, or rises from rest.
    trace = np.einsum("ri->r", diagonal)
    diagonal += (damping + RIDGE[0] + RIDGE[1] * trace)[:, None]
    return np.asarray(jacobian @ solve_or_nan(gram, residual))
