"""Levenberg-Marquardt for one least-squares problem, or for many side by side (Levenberg, 1944;
Marquardt, 1963).

The allocation methods refine commands with it, `finlab.swim.identification` fits robots to logs.
The caller knows the problem: how to evaluate it, and its Gauss-Newton step at a given damping. Here
is what all share: a step that raises the cost of a problem is undone and its damping is raised;
after any other step the damping is lowered.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar, cast

import numpy as np

from finlab.arrays import AnyArray


class Iterate(Protocol):
    """Where R problems are between two steps: a named tuple of arrays with R rows, so that single
    rows can be undone. Of one problem, any object with a cost (1,)."""

    @property
    def cost(self) -> AnyArray:
        """Sum of squared residuals (R,)."""


IterateT = TypeVar("IterateT", bound=Iterate)


@dataclass(frozen=True)
class DampingRule:
    """How the damping of a problem changes from step to step."""

    initial: float = 1e-6
    """Damping of the first step."""
    accepted_factor: float = 0.3
    """Factor after a step that does not raise the cost."""
    refused_factor: float = 30.0
    """Factor after a step that is undone."""
    refused_increment: float = 1e-4
    """What is added after that factor, so that a damping near 0 grows, too."""
    minimum: float = 0.0
    """Smallest damping after an accepted step."""
    maximum: float = np.inf
    """The search ends where the damping of all problems is above this."""


DEFAULT_RULE = DampingRule()
"""Rule for problems whose step is bounded by limits as well."""


def levenberg_marquardt(
    start: IterateT,
    take_step: Callable[[IterateT, AnyArray, bool], IterateT],
    max_steps: int,
    rule: DampingRule = DEFAULT_RULE,
    gain_tolerance: float = 0.0,
    cost_tolerance: float = 0.0,
) -> IterateT:
    """Lowers the cost of R least-squares problems.

    Args:
        start: where the problems begin.
        take_step: gives the next iterate from an iterate, the damping (R,) of each problem, and
            whether it is the last step, after which no derivatives are needed.
        max_steps: largest number of steps, those included that are undone.
        rule: how the damping changes.
        gain_tolerance: relative decrease of the cost at or below which an accepted step is the last
            one, if all problems are so; 0 to take all steps.
        cost_tolerance: cost at or below which a problem takes no further step.

    Returns:
        The iterate in which each problem has the least cost on its way.
    """
    iterate = start
    damping = np.full(len(iterate.cost), rule.initial)
    for step in range(max_steps):
        is_solved = iterate.cost <= cost_tolerance
        if is_solved.all():
            break
        candidate = take_step(iterate, damping, step == max_steps - 1)
        # Written as a negation, since a cost that is not a number is no decrease.
        is_refused = is_solved | ~(candidate.cost <= iterate.cost)
        is_settled = False
        if gain_tolerance > 0.0 and not is_refused.any():
            gain = iterate.cost - candidate.cost
            is_settled = bool((gain <= gain_tolerance * iterate.cost).all())
        iterate = _undo_rows(iterate, candidate, is_refused)
        if is_settled:
            break
        raised = damping * rule.refused_factor + rule.refused_increment
        lowered = np.maximum(damping * rule.accepted_factor, rule.minimum)
        damping = np.where(is_refused, raised, lowered)
        if (damping > rule.maximum).all():
            break
    return iterate


def _undo_rows(previous: IterateT, candidate: IterateT, is_refused: AnyArray) -> IterateT:
    """The candidate, with the rows (R,) whose step is refused as they were before."""
    if not is_refused.any():
        return candidate
    if is_refused.all():
        return previous
    fields = []
    for before, after in zip(
        cast(tuple[AnyArray, ...], previous), cast(tuple[AnyArray, ...], candidate), strict=True
    ):
        is_refused_row = is_refused.reshape(-1, *(1,) * (before.ndim - 1))
        fields.append(np.where(is_refused_row, before, after))
    return type(previous)(*fields)
