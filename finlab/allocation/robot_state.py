"""A robot in one state, and what a method is asked about it.

`Allocator` makes one `RobotState` for each damage and set of free axes, with a method that is ready
for it, and keeps the last ones.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.method import Method
from finlab.allocation.policy import CLOSEST, Policy, PolicyName, as_policy
from finlab.allocation.question import MethodQuestion
from finlab.allocation.solution import PreparedAnswers, Solution, Solved, among_all
from finlab.arrays import Array
from finlab.layout.damage import Damage
from finlab.layout.layout import Layout
from finlab.physics.plant import Plant

if TYPE_CHECKING:
    from finlab.allocation.power_budget import PowerBudget
    from finlab.core.calls import AnswerRow
    from finlab.core.prepared_call import Answer


def working_actuators(damaged: Layout, damage: Damage) -> NDArray[np.bool_]:
    """Returns which actuators of a robot work.

    Args:
        damaged: the robot of n actuators, with the limits that damage has left.
        damage: what is known of it.

    Returns:
        Mask (n,), False for the lost ones.

    Raises:
        LayoutError: an actuator that is lost is unknown, or none is left.
    """
    works = np.ones(damaged.n, bool)
    if not damage.lost:
        return works
    names = damaged.names
    lost = set(damage.lost)
    indices = [i for i, name in enumerate(names) if name in lost]
    if len(indices) == len(names) or len(indices) < len(lost):
        damaged.without(damage.lost, "lost")  # raises the error that says what is wrong
    works[indices] = False
    return works


def without_lost(damaged: Layout, damage: Damage) -> Layout:
    """Takes the lost actuators out of a robot.

    Args:
        damaged: the robot, with the limits that damage has left.
        damage: what is known of it.

    Returns:
        The robot of the actuators that are not lost; itself where none is.
    """
    return damaged.without(damage.lost) if damage.lost else damaged


MAX_POLICIES = 8
"""Policies by which a state keeps prepared questions; where they are more, all are forgotten."""


class PreparedQuestion:
    """A question to the method of a robot in a state, of which all is known but the wrench, and in
    a tick the command before.

    The first such question prepares nothing, since it is mostly the last one.
    """

    __slots__ = ("_prepared", "answer", "budget", "policy", "state")

    def __init__(
        self, state: RobotState, policy: Policy, budget: PowerBudget | None = None
    ) -> None:
        """Takes what is known.

        Args:
            state: of the robot.
            policy: what to give out of reach.
            budget: what actuators may take together; None for no limit.
        """
        self.state = state
        self.policy = policy
        self.budget = budget
        self.answer: Answer = self._answer_first
        """Answers a wrench; None where `RobotState.solve` has to be asked."""
        self._prepared: PreparedAnswers | None = None

    def question_of(self, wrench: Array, previous: Array | None) -> MethodQuestion:
        """Returns the question about a wrench (6,) [N, N m], with the command (n, 3) of the tick
        before; None outside of ticks."""
        return self.state.question(wrench[None], self.policy, None, 0, previous, budget=self.budget)

    def solved(self, row: AnswerRow, question: MethodQuestion) -> Solved:
        """Returns the solution of a question that was answered in a row."""
        assert self._prepared is not None
        return self._prepared.solved(row, question)

    def bound(self, row: AnswerRow) -> float | None:
        """Returns the lower bound of the power [W] of what was answered in a row; None where the
        bound of its solution has to be asked."""
        assert self._prepared is not None
        return self._prepared.bound(row)

    def _answer_first(self, wrench: object, previous: object, multipliers: Array | None) -> None:
        self.answer = self._answer_second

    def _answer_second(
        self, wrench: object, previous: object, multipliers: Array | None
    ) -> AnswerRow | None:
        state = self.state
        self._prepared = state.method.prepared_answers(
            self.policy, state.lost, state.free, self.budget
        )
        self.answer = _left_to_method if self._prepared is None else self._prepared.answer
        return self.answer(wrench, previous, multipliers)


def _left_to_method(wrench: object, previous: object, multipliers: Array | None) -> None:
    """Answers nothing."""


@dataclass(frozen=True, eq=False)
class RobotState:
    """A robot as damage has left it, asked for some axes of the wrench, with a method that is ready
    for it."""

    layout: Layout
    """All n actuators, with the limits that damage has left."""
    damage: Damage
    """What is known of those that are damaged."""
    works: NDArray[np.bool_]
    """Mask (n,) of the actuators that are not lost."""
    method: Method
    """Made for the m actuators that work, or for all n where it takes losses with the question."""
    plant: Plant
    """Of all n actuators at rest in the water; judges answers."""
    free: NDArray[np.bool_] | None
    """Axes (6,) of the wrench that may take any value; None where all are commanded."""

    _prepared: dict[Policy | PolicyName, PreparedQuestion] = field(default_factory=dict)
    """Prepared questions by their policies, as these were given."""
    _prepared_within: dict[tuple[Policy | PolicyName, float], PreparedQuestion] = field(
        default_factory=dict
    )
    """The same with power budgets of all actuators."""

    def prepared_question(self, policy: Policy | PolicyName) -> PreparedQuestion:
        """Returns the question with a policy.

        Raises:
            CommandError: no policy is called so.
            AllocationError: the method does not know the policy.
        """
        try:
            prepared = self._prepared.get(policy)
        except TypeError:  # weights in a list, which cannot be looked up; or no policy at all
            return self._prepare(as_policy(policy), self.budget)
        if prepared is None:
            checked = as_policy(policy)
            prepared = self._prepare(checked, self.budget)
            if len(self._prepared) >= MAX_POLICIES:
                self._prepared.clear()
            self._prepared[policy] = prepared
        return prepared

    @cached_property
    def closest(self) -> PreparedQuestion:
        """The question with the usual policy."""
        return self._prepare(CLOSEST, self.budget)

    def prepared_within(self, policy: Policy | PolicyName, power: object) -> PreparedQuestion:
        """Returns the question with a policy, and a power budget in place of the layout's.

        Args:
            policy: what to give out of reach.
            power: as `power` of `Allocator.allocate`.

        Raises:
            CommandError: no policy is called so.
            AllocationError: the method does not know the policy, or keeps no such budget.
        """
        if type(power) is not float and type(power) is not int:
            return self._prepare(as_policy(policy), self.budget_of(power))
        key = (policy, power)
        try:
            prepared = self._prepared_within.get(key)
        except TypeError:  # as in `prepared_question`
            return self._prepare(as_policy(policy), self.budget_of(power))
        if prepared is None:
            prepared = self._prepare(as_policy(policy), self.budget_of(power))
            if len(self._prepared_within) >= MAX_POLICIES:
                self._prepared_within.clear()
            self._prepared_within[key] = prepared
        return prepared

    def _prepare(self, policy: Policy, budget: PowerBudget | None) -> PreparedQuestion:
        """A question that is not kept."""
        if policy is not CLOSEST:  # which every method knows
            self.method.check_policy(policy)
        if budget is not None:
            self.method.check_budget(budget, policy)
        return PreparedQuestion(self, policy, budget)

    @cached_property
    def budget(self) -> PowerBudget | None:
        """What the layout lets actuators take together; None for no limit."""
        if not self.layout.has_budget:
            return None
        from finlab.allocation.power_budget import budget_of

        return budget_of(self.layout)

    def budget_of(self, power: object) -> PowerBudget | None:
        """Returns the budget of a question.

        Args:
            power: as `power` of `Allocator.allocate`.

        Raises:
            AllocationError: it is none.
        """
        if power is None:
            return self.budget
        from finlab.allocation.power_budget import check_power

        return check_power(power, self.layout)

    @cached_property
    def healthy(self) -> Layout:
        """The robot of the m actuators that work alone."""
        return without_lost(self.layout, self.damage)

    @cached_property
    def fields_of_results(self) -> dict[str, Any]:
        """Fields of a result, by name, that are those of the robot and of the method."""
        method = self.method
        networks = method.networks
        return {
            "layout": self.layout,
            "damage": self.damage,
            "scale": method.scale,
            "method": method.name,
            "checkpoint": None if networks is None else networks.name,
            "unknown_fins": method.unknown_fins,
        }

    @cached_property
    def lost(self) -> NDArray[np.bool_] | None:
        """Mask (n,) of the actuators that are lost; None where none is."""
        return ~self.works if self.damage.lost else None

    def among_all(self, command: Array) -> Array:
        """Returns commands (..., m, 3) of the actuators that work as those (..., n, 3) of all, NaN
        for the lost ones; read-only."""
        if not self.damage.lost:
            return command
        command = among_all(command, self.works)
        command.setflags(write=False)
        return command

    @cached_property
    def _counts(self) -> Array:
        """1 along the axes (6,) that are commanded, 0 along the free ones."""
        free = np.zeros(6, bool) if self.free is None else self.free
        return np.where(free, 0.0, 1.0)

    @cached_property
    def freed(self) -> NDArray[np.bool_] | None:
        """Mask (6,) of the free axes that the layout commands; None where there is none."""
        if self.free is None:
            return None
        freed = self.free & self.layout.commanded
        return freed if freed.any() else None

    @cached_property
    def _not_asked(self) -> Array:
        """0 along the axes (6,) that are commanded, NaN along the free ones."""
        return np.where(self._counts == 0.0, np.nan, 0.0)

    def without_free_axes(self, wrench: Array) -> Array:
        """Returns wrenches (..., 6) [N, N m] with 0 along the free axes, as methods take them."""
        return wrench if self.free is None else wrench * self._counts

    def shown(self, wrench: Array) -> Array:
        """Returns wrenches (..., 6) [N, N m] with NaN along the free axes, as results show them."""
        return wrench if self.free is None else wrench + self._not_asked

    def question(
        self,
        wrenches: Array,
        policy: Policy,
        flow: Array | None,
        seed: int,
        previous: Array | None = None,
        multipliers: Array | None = None,
        reference: Array | None = None,
        budget: PowerBudget | None = None,
    ) -> MethodQuestion:
        """Returns a question to the method, with what it reads of these arguments. Losses and free
        axes are told to a method that reads them; any other is made for the actuators that work
        alone, and is told their commands.

        Args:
            wrenches: desired (N, 6) [N, N m], whatever they hold along free axes.
            policy: what to give for those out of reach.
            flow: velocity (6,) of the body relative to the water [m/s, rad/s]; None at rest.
            seed: makes the answer repeatable.
            previous: command (n, 3) of all actuators in the tick before, for a single wrench; None
                outside of ticks.
            multipliers: (6,) [W/N, W/(N m)] of an earlier answer, for a single wrench.
            reference: wrenches (K, 6) of the next ticks [N, N m].
            budget: what actuators may take together; None for no limit.

        Raises:
            AllocationError: the method does not know the policy, or keeps no budget.
        """
        method = self.method
        if policy is not CLOSEST:  # which every method knows
            method.check_policy(policy)
        if budget is not None:
            method.check_budget(budget, policy)
        reads = method.reads
        lost: NDArray[np.bool_] | None = None
        free: NDArray[np.bool_] | None = None
        if "losses" in reads:
            lost = self.lost
            free = self.free
        elif previous is not None:
            previous = previous[self.works]
        if reference is not None:
            reference = self.without_free_axes(reference) if "reference" in reads else None
        if "multipliers" not in reads:
            multipliers = None
        targets = self.without_free_axes(wrenches)
        # By position, in the order of the fields: every tick pays for it.
        return MethodQuestion(
            targets, policy, previous, flow, seed, lost, free, multipliers, reference, budget
        )

    def solve(self, question: MethodQuestion) -> Solved:
        """Asks the method.

        Args:
            question: made by `question` of this state.

        Returns:
            The method's solution. In a tick its commands lie within the limits and rates of the
            drives; outside of ticks actuators that have nothing to do are at rest.
        """
        method = self.method
        solution = method.solve(question)
        if method.keeps_limits:
            return solution
        if question.previous is None:
            command = method.plant.rested(solution.command)
        else:
            box = method.rates.box(question.previous)
            command = box.clip_feasible(solution.command, method.plant)
        command.setflags(write=False)
        return Solution.with_command(solution, command)
