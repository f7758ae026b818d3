"""One question to an allocator: the state of the robot, what is asked of it, and the answer to it.

`Allocator` makes a `RobotState` for each damage and set of free axes, a `CheckedQuestion` for each
call, and an `AnsweredQuestion` for each result, which computes from it what is first read later.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.method import Method
from finlab.allocation.policy import Policy
from finlab.allocation.report import answer_notes
from finlab.allocation.solution import Candidates, Solution, among_all
from finlab.arrays import Array
from finlab.layout.damage import Damage
from finlab.layout.layout import Layout
from finlab.physics.plant import Plant


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
    lost = set(damage.lost)
    works = np.array([name not in lost for name in damaged.names])
    lost_here = damaged.n - int(works.sum())
    if lost and (not works.any() or len(lost) > lost_here):
        damaged.without(damage.lost, "lost")  # raises the error that says what is wrong
    return works


def without_lost(damaged: Layout, damage: Damage) -> Layout:
    """Returns the robot of the actuators that are not lost; itself where none is."""
    return damaged.without(damage.lost) if damage.lost else damaged


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

    @cached_property
    def healthy(self) -> Layout:
        """The robot of the m actuators that work alone."""
        return without_lost(self.layout, self.damage)

    @property
    def lost(self) -> NDArray[np.bool_] | None:
        """Mask (n,) of the actuators that are lost; None where none is."""
        return ~self.works if self.damage.lost else None

    def among_all(self, command: Array) -> Array:
        """Returns commands (..., m, 3) of the actuators that work as those (..., n, 3) of all, NaN
        for the lost ones."""
        return among_all(command, self.works)

    def with_free_axes(self, wrench: Array, value: float) -> Array:
        """Returns wrenches (..., 6) [N, N m] with a value along the free axes: methods take 0
        there, results show NaN."""
        return wrench if self.free is None else np.where(self.free, value, wrench)


class CheckedQuestion(NamedTuple):
    """A question but for its wrenches, all of whose arguments were checked."""

    state: RobotState
    """Of the robot that is asked."""
    policy: Policy
    """What to give for a wrench out of reach."""
    flow: Array | None
    """Velocity (6,) of the body relative to the water [m/s, rad/s], body frame; None at rest."""
    seed: int
    """Makes the answer repeatable."""

    def solve(
        self, targets: Array, previous: Array | None = None, offset: int = 0, **options: Any
    ) -> Solution:
        """Asks the method.

        Args:
            targets: desired wrenches (N, 6) [N, N m], 0 along free axes.
            previous: command (n, 3) of the tick before; None outside of ticks.
            offset: index of the first target among all of the question, which shifts the seed, so
                that a target gets the same answer in any batch.
            options: further arguments of `Method.solve` that this method takes.

        Returns:
            The method's solution. In a tick its commands lie within the limits and rates of the
            drives; outside of ticks actuators that have nothing to do are at rest.
        """
        state = self.state
        method = state.method
        previous_of_method = previous
        if method.takes_losses:
            options["lost"] = state.lost
            options["free"] = state.free
        elif previous is not None:
            previous_of_method = previous[state.works]
        if previous_of_method is not None:
            options["previous"] = previous_of_method
        solution = method.solve(
            targets, policy=self.policy, flow=self.flow, seed=self.seed + offset, **options
        )
        if previous_of_method is None:
            return solution._replace(command=method.plant.rested(solution.command))
        box = method.rates.box(previous_of_method)
        return solution._replace(command=box.clip_feasible(solution.command, method.plant))


class AnsweredQuestion(NamedTuple):
    """A question with its answer: what a result computes when it is first read."""

    question: CheckedQuestion
    """All but the wrenches."""
    wrenches: Array
    """Desired wrenches as they came, (6,) or (N, 6) [N, N m]."""
    solution: Solution
    """What the method answered."""

    @property
    def plant(self) -> Plant:
        """Judge of commands: the laws of all actuators, lost ones included, in the question's
        flow."""
        return self.question.state.plant.at(self.question.flow)

    def notes(self) -> tuple[str, ...]:
        """Returns sentences about the robot and the method, not about single answers."""
        state = self.question.state
        asked = self.wrenches
        if state.free is not None:
            # What was asked of an axis that the layout does not command stays: a note tells of it.
            asked = np.where(state.free & state.layout.commanded, 0.0, asked)
        return answer_notes(
            state.healthy, state.method, self.question.flow, asked, self.solution.notes
        )

    def candidates(self) -> Candidates | None:
        """Returns the refined candidates of all n actuators; None where the method has none."""
        return self._candidates_of_all(self.solution.candidates)

    def samples(self) -> Candidates | None:
        """Returns the candidates before refinement; None where the method has none."""
        return self._candidates_of_all(self.solution.samples)

    def bound(self) -> Array | None:
        """Returns the lower bound (N,) of the power [W]; None where the method proves none."""
        bound = self.solution.bound
        return None if bound is None else bound(self.solution.command)

    def calm_power(self) -> Array | None:
        """Returns the part (N,) of the power [W] that goes into less turning; None where the method
        weighs no turning."""
        calm_power = self.solution.calm_power
        return None if calm_power is None else calm_power(self.solution.command)

    def _candidates_of_all(self, make: Callable[[], Candidates] | None) -> Candidates | None:
        """Candidates of the actuators that work, with rows for all n."""
        if make is None:
            return None
        candidates = make()
        state = self.question.state
        if not candidates or not state.damage.lost:
            return candidates
        return replace(candidates, command=state.among_all(candidates.command))
