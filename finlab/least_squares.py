"""Levenberg-Marquardt for one least-squares problem, or for many side by side.

The caller knows the problem: how to evaluate it, and its Gauss-Newton step at a given damping. Here
is what all share: a step that makes a row worse is undone and that row's damping is raised; else it
is lowered.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar, cast

import numpy as np

from finlab.arrays import AnyArray


class Point(Protocol):
    """R problems at one point of each: a named tuple of arrays with R rows; of one problem, any
    object."""

    @property
    def cost(self) -> AnyArray:
        """Sum of squares (R,)."""


At = TypeVar("At", bound=Point)


@dataclass(frozen=True)
class Damping:
    """How the damping of a row follows from its steps."""

    first: float = 1e-6
    """Of the first step."""
    better: float = 0.3
    """Factor after a step that lowers the cost."""
    worse: tuple[float, float] = (30.0, 1e-4)
    """Factor after another, and what is added."""
    least: float = 0.0
    """Never below this."""
    most: float = np.inf
    """The search ends where all rows are above this."""


USUAL = Damping()
"""For problems whose step is bounded by limits as well."""


def levenberg_marquardt(
    at: At,
    moved: Callable[[At, AnyArray, bool], At],
    steps: int,
    rule: Damping = USUAL,
    settled: float = 0.0,
    enough: float = 0.0,
) -> At:
    """Lower the cost of R problems (Levenberg, 1944; Marquardt, 1963), and return where they end.

    Args:
        at: where they begin.
        moved: the problems after one step, from where they are, the damping (R,) of each, and
            whether it is the last step, after which no derivatives are needed.
        steps: most steps, those included that are undone.
        rule: of the damping.
        settled: relative gain at or below which a step that helps is the last one; 0 to take all
        steps.
        enough: cost at or below which a row takes no further step.
    """
    damping = np.full(len(at.cost), rule.first)
    for step in range(steps):
        finished = at.cost <= enough
        if finished.all():
            break
        new = moved(at, damping, step == steps - 1)
        worse = finished | ~(new.cost <= at.cost)  # a cost that is not a number is no improvement
        done = (
            settled > 0.0
            and not worse.any()
            and bool((at.cost - new.cost <= settled * at.cost).all())
        )
        at = _better(at, new, worse)
        if done:
            break
        factor, added = rule.worse
        damping = np.where(
            worse, damping * factor + added, np.maximum(damping * rule.better, rule.least)
        )
        if (damping > rule.most).all():
            break
    return at


def _better(old: At, new: At, worse: AnyArray) -> At:
    """Of each row the old point where the new one is worse."""
    if not worse.any():
        return new
    if worse.all():
        return old
    fields = [
        np.where(worse.reshape(-1, *(1,) * (kept.ndim - 1)), kept, tried)
        for kept, tried in zip(
            cast(tuple[AnyArray, ...], old), cast(tuple[AnyArray, ...], new), strict=True
        )
    ]
    return type(old)(*fields)
