"""Answers within power budgets (Eqs. 28 and 29), where the core's tables do not say powers exactly.

The core keeps budgets by itself (`finlab/core/src/power_budget.c`): by the laws of all actuators
where it knows these, else by its tables. What is left then is done here: it is asked for budgets
that make up for what its tables, or steps on the commands, are off.
"""

from __future__ import annotations

from collections.abc import Set
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.policy import Policy
from finlab.allocation.solution import Solution, Solved
from finlab.arrays import EXACT, Array
from finlab.axes import wrapped
from finlab.core.calls import Conditions, budget_record
from finlab.physics.plant import Plant

if TYPE_CHECKING:
    from finlab.allocation.power_budget import PowerBudget
    from finlab.allocation.question import MethodQuestion
    from finlab.allocation.rates import Rates

SLACK = 1e-9
"""Share by which an answer may exceed a budget and count as within it: rounding."""
NEAR = 1e-3
"""Share within which a power that is to be that of a budget is by the tables of the core."""
SHORT = 5e-7
"""Share of its budget that a bus may leave which would give more if it had more."""
AIM = 1e-7
"""Share of a budget that is left on purpose where another one is asked for."""
CORRECTIONS = 8
"""Budgets at which the core is asked, until powers are exact by the laws."""
LEAST_RISE = 0.2
"""Least slope of powers by the laws over those by tables, both as logarithms."""
HALVES = 40
"""Of the way from commands within a budget to some beyond it."""
LEAST_SHARE = 1e-300
"""Least power over a budget of which a logarithm is taken."""


_EXCEEDS = (
    "takes more power than its budget: no command within it was found, as where rates or actuators "
    "that cannot rest leave none"
)
"""Note of an answer beyond its budget."""


class BudgetMethod(Protocol):
    """What `solve_within` asks of method `dual`, in the flow of a question."""

    @property
    def plant(self) -> Plant:
        """The actuators' own laws."""

    @property
    def rates(self) -> Rates:
        """How far commands may change in a tick."""

    @property
    def knows_power(self) -> bool:
        """Whether the core keeps budgets by the actuators' own laws."""

    def solve_under(
        self,
        conditions: Conditions,
        targets: Array,
        policy: Policy,
        multipliers: Array | None = None,
    ) -> Solved:
        """Solves for targets (N, 6) [N, N m]."""

    def solution_of(
        self,
        conditions: Conditions,
        targets: Array,
        command: Array,
        multipliers: Array,
        is_unreached: NDArray[np.bool_] | None,
        sentences: Set[str] = frozenset(),
    ) -> Solution:
        """Returns the solution that commands (N, n, 3) for targets (N, 6) are."""


def solve_within(
    method: BudgetMethod, conditions: Conditions, question: MethodQuestion, budget: PowerBudget
) -> Solved:
    """Solves for targets within a power budget.

    Args:
        method: in the flow of the question.
        conditions: rates, losses and free axes, without a budget.
        question: targets, policy and multipliers to begin with.
        budget: of the buses.

    Returns:
        Commands, with the lower bound of their power.
    """
    targets = question.targets
    if len(targets) == 1:
        return _solve_one(method, conditions, targets, question, budget)
    solved = method.solve_under(conditions, targets, question.policy)
    power = budget.power_of_buses(method.plant.power(solved.command))
    exceeds = np.asarray((power > (1.0 + SLACK) * budget.watts).any(axis=-1))
    if not exceeds.any():
        return solved
    command = solved.command.copy()
    multipliers = np.zeros((len(targets), 6))
    if solved.multipliers is not None:
        multipliers = solved.multipliers.copy()
    for row in np.flatnonzero(exceeds):
        answer = _solve_one(method, conditions, targets[row : row + 1], question, budget)
        command[row] = answer.command[0]
        if answer.multipliers is not None:
            multipliers[row] = answer.multipliers[0]
    within = conditions._replace(budget=budget.record)
    return method.solution_of(within, targets, command, multipliers, exceeds)


def _solve_one(
    method: BudgetMethod,
    conditions: Conditions,
    targets: Array,
    question: MethodQuestion,
    budget: PowerBudget,
) -> Solved:
    """Solves for one target (1, 6): by the core at once where it knows the power, else by watts
    that make up for what its tables are off."""
    policy = question.policy
    multipliers = question.multipliers
    knows_power = method.knows_power
    asked = conditions._replace(budget=budget.record)
    solved = method.solve_under(asked, targets, policy, multipliers)
    if knows_power and not isinstance(solved, Solution):
        return solved
    first = solved
    correction = _Correction(budget)
    for _ in range(CORRECTIONS):
        power = np.asarray(budget.power_of_buses(method.plant.power(solved.command))[0])
        if not correction.goes_on(solved, power):
            break
        record = budget_record(budget.members, correction.watts)
        asked = conditions._replace(budget=record)
        solved = method.solve_under(asked, targets, policy, multipliers)
    best = correction.best
    is_kept = correction.most_over <= EXACT
    if is_kept and best is first:
        return best
    # What it was asked for is not what holds: bounds are those of the budget itself.
    if is_kept:
        conditions = conditions._replace(budget=budget.record)
    zeros = np.zeros((1, 6))
    found = zeros if best.multipliers is None else best.multipliers
    command = best.command
    if not is_kept and conditions.previous is not None:
        kept = _on_the_way(method, budget, conditions.previous, command[0])
        if kept is not None:
            command = kept[None]
            is_kept = True
    notes = best.notes() if is_kept and best.notes is not None else ()
    sentences = set(notes) if is_kept else {_EXCEEDS}
    return method.solution_of(conditions, targets, command, found, None, sentences)


def _on_the_way(
    method: BudgetMethod, budget: PowerBudget, before: Array, command: Array
) -> Array | None:
    """Commands (n, 3) within a budget as far as it allows from those of the tick before (n, 3)
    towards commands (n, 3) that exceed it, NaN of lost actuators; None where those before exceed
    it, too, or are not known."""
    works = np.isfinite(command).all(axis=-1)
    if not np.isfinite(before[works]).all():
        return None

    box = method.rates.box(before)
    is_angle = box.turns | box.any_angle
    way = np.where(is_angle, wrapped(command - before), command - before)

    def at(share: float) -> Array:
        made: Array = before + share * way
        return made

    def is_within(made: Array) -> bool:
        power = budget.power_of_buses(method.plant.power(made))
        return bool((power <= (1.0 + SLACK) * budget.watts).all())

    low, high = 0.0, 1.0
    if not is_within(at(low)):
        return None
    for _ in range(HALVES):
        middle = (low + high) / 2.0
        if is_within(at(middle)):
            low = middle
        else:
            high = middle
    return at(low)


class _Correction:
    """Budgets that the core is asked for, so that by the laws they are those of a question: secants
    of powers over budgets, both as logarithms, for each bus."""

    best: Solved
    """The answer that exceeds budgets least; of those within them the one that leaves least."""

    def __init__(self, budget: PowerBudget) -> None:
        self._budget = budget
        self.watts = budget.watts
        """What is asked for next (b,) [W]."""
        self.most_over = np.inf
        """By what share the best answer exceeds a budget; 0 of one within all."""
        self._least_left = np.inf
        self._last: tuple[Array, Array] | None = None

    def goes_on(self, solved: Solved, power: Array) -> bool:
        """Takes an answer in which buses take powers (b,) [W]; returns whether another one may
        be better."""
        over = np.log(np.maximum(power / self._budget.watts, LEAST_SHARE))
        asked = np.log(self.watts / self._budget.watts)
        is_short = (over < -SHORT) & (over > -NEAR)
        most_over = max(float(over.max()), 0.0) if (over > SLACK).any() else 0.0
        left = float(np.where(is_short, -over, 0.0).max())
        if (most_over, left) < (self.most_over, self._least_left):
            self.best = solved
            self.most_over = most_over
            self._least_left = left
        is_off = (over > SLACK) | is_short
        if not is_off.any():
            return False
        slope = np.ones(len(over))
        if self._last is not None:
            moved = asked - self._last[1]
            has_moved = np.abs(moved) > EXACT * SHORT
            rise = (over - self._last[0]) / np.where(has_moved, moved, 1.0)
            slope = np.where(has_moved, np.clip(rise, LEAST_RISE, 1.0 / LEAST_RISE), 1.0)
            if np.array_equal(over, self._last[0]):
                return False  # nothing changes it
        self._last = over, asked
        corrected = self.watts * np.exp(-(over + AIM) / slope)
        self.watts = np.where(is_off, corrected, self.watts)
        return True
