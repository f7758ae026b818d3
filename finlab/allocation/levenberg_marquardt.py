"""Levenberg-Marquardt on the commands, through closed-form Jacobians of the forces, inside the
limits (Eq. 11).

The last stage of a search: it works in commands, not forces, and with the actuators' own laws, so
it removes the error that the core's tables leave (`exact_commands`). The baselines use it for all.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import CLOSE, EXACT, NEARLY, NOTHING, ROUNDS, AnyArray, Array, solve_or_nan
from finlab.axes import feasible
from finlab.core.calls import CoreAnswer
from finlab.physics.plant import Plant

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

    from finlab.allocation.rates import CommandBox

RIDGE = (1e-9, 1e-14)
"""Regularization of the 6 x 6 systems: absolute, and relative to their trace. Without the latter
those of strong fins on long levers are singular to rounding."""
FIRST_DAMPING = 1e-6
"""Damping of the first step: nearly that of Newton, for starts are near."""


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
    error_scale: Array
    """What wrenches (6,) are divided by [N, N m]: the wrench scale, or the `asked_scale` of a
    method."""
    box: "CommandBox | None" = None
    """What may follow the command of the tick before; None outside of ticks."""
    works: NDArray[np.bool_] | None = None
    """Which actuators (n,) give a force; None where all do."""
    counts: NDArray[np.bool_] | None = None
    """Which axes (6,) of the wrench count; None where all do."""

    @classmethod
    def of(cls, plant: Plant, error_scale: Array) -> "Self":
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
            wraps=plant.wraps,
            no_limits=plant.turns,
            error_scale=error_scale,
        )

    def restricted(
        self, works: NDArray[np.bool_] | None, counts: NDArray[np.bool_] | None
    ) -> "Self":
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

    def in_tick(self, box: "CommandBox") -> "Self":
        """Returns the problem within what may follow the command of the tick before."""
        no_limits = box.any_angle & self.no_limits
        return replace(self, lower=box.lower, upper=box.upper, no_limits=no_limits, box=box)

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
        if self.plant.interaction is None:
            return wrench
        offset = self.plant.offset(self._of_working(force)) / self.error_scale
        return wrench + self._in_counted_axes(offset)

    def wrench_and_jacobian(self, command: AnyArray) -> tuple[AnyArray, AnyArray]:
        """Returns the normalized wrenches (R, 6) of commands (R, n, 3), and their derivatives J
        (R, n, 3, 6) by the commands."""
        force, force_jacobian = self.plant.force_and_jacobian(command)
        if self.plant.interaction is None:
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

    def missing(self, command: AnyArray, wanted: AnyArray) -> AnyArray:
        """Returns what normalized wrenches (R, 6) of commands (R, n, 3) miss of those that are
        wanted (R, 6), with the sign of the excess; 0 along axes that do not count."""
        missing: AnyArray = self.wrench(command) - wanted
        return missing if self.counts is None else np.where(self.counts, missing, 0.0)

    def error(self, command: AnyArray, wanted: AnyArray) -> AnyArray:
        """Returns the normalized errors (R,) of commands (R, n, 3), given the normalized wrenches
        (R, 6) that are wanted."""
        return norms(self.missing(command, wanted))

    def feasible(self, command: AnyArray) -> AnyArray:
        """Returns commands (..., n, 3) inside the limits, angles wrapped first."""
        return feasible(command, self.lower, self.upper, self.wraps)


def norms(vectors: AnyArray) -> AnyArray:
    """Returns the Euclidean norms (R,) of vectors (R, 6)."""
    return np.asarray(np.sqrt(np.einsum("ni,ni->n", vectors, vectors)))


def exact_commands(problem: CommandProblem, answer: CoreAnswer) -> Array:
    """Makes commands exact by the plant: steps by the laws where the core's grids leave an error
    (Eq. 11).

    Args:
        problem: the robot under the conditions of the question.
        answer: of the core; its commands are overwritten.

    Returns:
        Commands (N, n, 3) that give the wrenches served, within the limits and rates; or as near to
        them as they come.
    """
    command = answer.command
    wanted = answer.wrench_served / problem.error_scale
    missing = problem.missing(command, wanted)
    all_missing = missing.ravel()
    if all_missing.dot(all_missing) <= EXACT**2:
        return command
    # Where the core's grids say what the laws say, it has done all that steps can do.
    error = norms(missing)
    off_by_grids = error > answer.error + EXACT
    off_within_reach = answer.is_attainable & (error > NEARLY)
    rough = np.flatnonzero(off_by_grids | off_within_reach)
    if not len(rough):
        return command
    refined = refine(problem, wanted[rough], command[rough], ROUNDS, EXACT)
    command[rough] = refined.command
    if problem.box is not None:
        return problem.box.clip_feasible(command, problem.plant)
    unmet = (refined.error > NEARLY) & answer.is_attainable[rough]
    for row in rough[unmet].tolist():
        # Such as idle fins in line, or a least force: no small change of these commands helps.
        starts = _starts_around(problem, command[row])
        other = cheapest_exact(problem, wanted[row], starts)
        command[row] = command[row] if other is None else other
    return problem.plant.rested(command)


def cheapest_exact(problem: CommandProblem, wanted: Array, starts: Array) -> Array | None:
    """Finds the cheapest command that gives a wrench, of those to which steps lead.

    Args:
        problem: the robot.
        wanted: normalized wrench (6,).
        starts: commands (R, n, 3) where the steps begin.

    Returns:
        The command (n, 3); None where no steps lead to one.
    """
    refined = refine(problem, wanted[None], starts, 2 * ROUNDS, EXACT)
    exact = refined.command[refined.error <= NEARLY]
    if len(exact) == 0:
        return None
    power = problem.plant.power(exact).sum(axis=-1)
    return np.asarray(exact[power.argmin()])


def _starts_around(problem: CommandProblem, command: Array) -> Array:
    """Commands (R, n, 3) around one (n, 3), from near to as far as the limits are apart."""
    rng = np.random.default_rng(0)
    change = rng.uniform(-1.0, 1.0, (2 * ROUNDS, *command.shape))
    reach = np.geomspace(10.0 * CLOSE, 1.0, len(change))[:, None, None]
    return np.asarray(command + reach * change * problem.width)


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
