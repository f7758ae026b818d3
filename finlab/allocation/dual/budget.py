"""The most wrench that a power budget allows, and the least power within it (Eqs. 28 and 29).

A budget limits the power of each bus, which feeds some of the actuators. At its multiplier zeta the
costs of a bus become (1 + zeta) c, which the core is told by the scale of power in its block. What
a wrench beyond reach lacks is the force of actuators that no robot has, one for each axis and one
along the ray of the wrench: with the square of what is missing for their power, the core answers
beyond reach as within.

Method `dual` asks only where an answer takes more power than a bus has.
"""

from __future__ import annotations

from collections.abc import Set
from dataclasses import replace
from threading import Lock
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.response import Form, Line, RadialTable, price_grid
from finlab.allocation.dual.block import BlockContents, block_of
from finlab.allocation.policy import Policy
from finlab.allocation.solution import Solution, Solved
from finlab.arrays import CLOSE, EXACT, NEARLY, NOTHING, AnyArray, Array
from finlab.core.calls import Conditions, Core, CoreAnswer, budget_record
from finlab.core.fields import actuators_of
from finlab.layout.effectiveness import wrench_of_forces
from finlab.physics.plant import Plant

if TYPE_CHECKING:
    from finlab.allocation.power_budget import PowerBudget
    from finlab.allocation.question import MethodQuestion

AXES_MISSING = 6
"""Actuators that stand for what is missing along each axis; one along the ray follows them."""
MISS_COST = 1e5
"""Power of a miss of the wrench scale, over the robot's largest power, while budgets are kept: so
much dearer that what binds no budget costs a miss of its inverse."""
HELD = 1e4
"""Weight of an axis that has been served over those that are served after it, and of what is
across a ray over what is along it."""
SLACK = 1e-9
"""Share by which an answer may exceed a budget and count as within it: rounding."""
NEAR = 1e-3
"""Share within which a power that is to be that of a budget is by the tables of the core."""
CORRECTIONS = 8
"""Budgets at which the core is asked, until powers are exact by the laws."""
LEAST_RISE = 0.2
"""Least slope of powers by the laws over those by tables, both as logarithms."""
ENOUGH = 1e-8
"""Share of its power to which a bus is brought to its budget from outside of the core."""
SHORT = 2e-7
"""Share of its budget that a bus may leave which would give more if it had more."""
MOST_STEPS = 60
"""Steps of Newton's method on the multipliers of budgets."""
LARGEST_STEP = 4.0
"""Change of the logarithm of 1 + zeta in a step."""
LEAST_SLOPE = 1e-3
"""By how much at least the logarithm of a power counts as falling with that of 1 + zeta."""
LEAST_SQUARE = 1e-300
"""Least size or square by which is divided."""
SHARES_OF_STEP = (1.0, 0.4, 0.16, 0.06)
"""Of a step, tried until one is better."""
SLOPE_STEP = 1e-4
"""Change of the logarithm of 1 + zeta by which slopes are found."""
MOST_LOGARITHM = 46.0
"""Largest logarithm of 1 + zeta: what is dearer is not used."""
MOST_LOGARITHM_MET = 16.0
"""The same where a wrench is to be met: beyond it the budget is the least that meets it."""


_EXCEEDS = (
    "takes more power than its budget: no command within it was found, as where rates or actuators "
    "that cannot rest leave none"
)
"""Note of an answer beyond its budget."""


class BudgetAnswer(NamedTuple):
    """Answer to one target under a budget."""

    command: Array
    """(n, 3)."""
    multipliers: Array
    """Multipliers (6,) [W/N, W/(N m)] of the wrench that is given."""
    factors: Array
    """1 + zeta of each bus (b,)."""
    is_attainable: bool
    """Whether the wrench that was asked for is given."""


class _Trial(NamedTuple):
    """What the core answers at factors 1 + zeta of the buses."""

    answer: CoreAnswer
    power: Array
    """Of each bus (b,) [W]."""
    power_of_all: float
    """Of all actuators [W]."""
    miss_cost: float
    """What is missing costs so much [W]."""


class _Point(NamedTuple):
    """What is known at some multipliers of the buses."""

    trial: _Trial
    logarithm: Array
    """Of 1 + zeta (b,), at least 0."""
    excess: Array
    """Of the power that each bus takes over what it has (b,): the logarithm above 0, the share
    below."""
    size: float
    """Largest excess, or multiplier of a bus that takes less than it has."""
    value: float
    """Of the dual, concave in the multipliers [W]."""


class BudgetedCore:
    """A robot in the core, whose powers have a scale and whose wrenches may miss."""

    def __init__(self, contents: BlockContents, plant: Plant, wrench_scale: Array) -> None:
        """Prepares it.

        Args:
            contents: of the block of the robot, of n actuators.
            plant: of the same, which judges powers.
            wrench_scale: (6,) [N, N m].
        """
        n = len(contents.responses)
        self._n = n
        self._plant = plant
        self._scale = wrench_scale
        self._axis_scale = contents.axis_scale
        self._counts = contents.is_commanded > 0.0
        self._reach = float(np.max(contents.axis_scale / wrench_scale))
        block = block_of(_with_missing_forces(contents, wrench_scale))
        self._miss_costs = np.zeros(AXES_MISSING + 1)
        """Costs k [W] of what may miss."""
        self._lock = Lock()
        """Held during an answer: the block is the same for all threads."""
        self._core = Core(block, n + AXES_MISSING + 1)
        self._actuators = actuators_of(block)
        self._own_power_scale = self._actuators["power_scale"].copy()
        self._own_secant = self._actuators["secant"].copy()
        ends = np.abs(contents.force_range).max(axis=1)
        largest = [
            float(response.table.cost(np.array(min(end, response.table.largest))))
            for response, end in zip(contents.responses, ends, strict=True)
        ]
        self._largest_power = max(sum(largest), NOTHING)

    def answer(
        self, target: Array, policy: Policy, conditions: Conditions, budget: PowerBudget
    ) -> BudgetAnswer:
        """Answers one target within a budget.

        Args:
            target: (6,) [N, N m].
            policy: what to give where the budget, or what the robot can give, is too small.
            conditions: what holds of the robot.
            budget: of its buses.
        """
        with self._lock:
            return self._answer(target, policy, _Asked(self, conditions, budget))

    def _answer(self, target: Array, policy: Policy, asked: _Asked) -> BudgetAnswer:
        met = asked.met(target)
        if met is not None:
            return met
        asked.forget_multipliers()
        if policy.kind == "direction":
            return asked.along_ray(target)
        if policy.kind == "priority":
            return asked.by_priority(target, policy)
        weights = np.maximum(np.array(policy.axis_weights) / max(policy.axis_weights), CLOSE)
        return asked.nearest(target, weights)

    def _power_of(self, command: Array, works: NDArray[np.bool_]) -> Array:
        """Power of each actuator (n,) [W] at a command (n, 3), 0 of a lost one."""
        finite_command = np.where(works[:, None], command, self._plant.lower)
        return np.where(works, self._plant.power(finite_command), 0.0)

    def _wrench_of(self, trial: _Trial, works: NDArray[np.bool_]) -> Array:
        """Wrench (6,) [N, N m] of a trial's command, by the plant."""
        command = np.where(works[:, None], trial.answer.command[0, : self._n], np.nan)
        figures = self._plant.figures(command)
        if figures is not None:
            return figures.wrench
        force = self._plant.force(np.where(works[:, None], command, self._plant.lower))
        force = np.where(works[:, None], force, 0.0)
        return np.asarray(wrench_of_forces(force, self._plant.effectiveness))

    def _asked(
        self,
        target: Array,
        weights: Array | None,
        logarithms: Array,
        conditions: Conditions,
        free: NDArray[np.bool_],
        multipliers: Array | None,
    ) -> CoreAnswer:
        """Asks the core, with each actuator's costs times the exponential of a logarithm (n,);
        weights (7,) are those of what may miss, 0 for what may not."""
        n = self._n
        actuators = self._actuators
        may_miss = np.zeros(AXES_MISSING + 1, bool)
        factor = np.exp(logarithms)
        actuators["power_scale"][:n] = self._own_power_scale[:n] * factor
        actuators["secant"][:n] = self._own_secant[:n] / factor[:, None]
        if weights is not None:
            may_miss = weights > 0.0
            may_miss[:AXES_MISSING] &= self._counts & ~free
            self._set_missing(target, weights, may_miss)
        self._core.prepare_again()
        lost = np.zeros(n, bool) if conditions.lost is None else conditions.lost
        asked_free = free if conditions.free is None else free | conditions.free
        previous = None
        angles_wanted = None
        if conditions.previous is not None:
            previous = np.concatenate([conditions.previous, np.full((len(may_miss), 3), np.nan)])
        calm = 0.0
        if weights is None and conditions.calm > 0.0:
            calm = conditions.calm / float(np.mean(factor))
            if conditions.angles_wanted is not None:
                unknown = np.full(len(may_miss), np.nan)
                angles_wanted = np.concatenate([conditions.angles_wanted, unknown])
        asked = Conditions(
            previous,
            np.concatenate([lost, ~may_miss]),
            asked_free if asked_free.any() else None,
            calm,
            conditions.ticks,
            angles_wanted,
        )
        return self._core.answer_one(np.where(asked_free, 0.0, target), None, multipliers, asked)

    def _set_missing(self, target: Array, weights: Array, may_miss: NDArray[np.bool_]) -> None:
        """Writes cost, limits and the ray of what may miss: k T^2 / 2 of a force T."""
        n = self._n
        missing = self._actuators[n:]
        normalized = target / self._scale
        size = 2.0 * (float(np.abs(normalized).max()) + self._reach)
        limit = np.full(len(missing), size)
        limit[-1] = 1.0
        cost = MISS_COST * self._largest_power * np.where(may_miss, weights, 1.0) ** 2
        cost[-1] *= max(float(normalized @ normalized), NOTHING)
        self._miss_costs = np.where(may_miss, cost, 0.0)
        missing["force_scale"] = limit
        missing["power_scale"] = cost * limit**2
        missing["row_force_max"] = limit[:, None]
        missing["secant"] = 1.0 / cost[:, None]
        missing["force_max"] = limit
        missing["force_min"] = -limit
        missing["force_min"][-1] = 0.0
        missing["force_min_needed"] = missing["force_min"]
        missing["command_max"][:, 0] = limit
        missing["command_min"][:, 0] = missing["force_min"]
        reduced = (target / self._axis_scale)[self._counts]
        missing["effectiveness_reduced"][-1, 0, : len(reduced)] = reduced
        missing["effectiveness_normalized"][-1, 0] = normalized


class BudgetMethod(Protocol):
    """What `solve_within` asks of method `dual`, in the flow of a question."""

    @property
    def plant(self) -> Plant:
        """The actuators' own laws."""

    @property
    def knows_power(self) -> bool:
        """Whether the core keeps budgets by the actuators' own laws."""

    @property
    def budgeted(self) -> BudgetedCore:
        """The robot in the core with powers that have a scale."""

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
    return method.solution_of(conditions, targets, command, multipliers, exceeds)


def _solve_one(
    method: BudgetMethod,
    conditions: Conditions,
    targets: Array,
    question: MethodQuestion,
    budget: PowerBudget,
) -> Solved:
    """Solves for one target (1, 6): by the core at once where its tables say the power exactly,
    else by watts that make up for what they are off, and else by `BudgetedCore`."""
    policy = question.policy
    multipliers = question.multipliers
    asked = conditions._replace(budget=budget.record)
    knows_power = method.knows_power
    solved = method.solve_under(asked, targets, policy, multipliers)
    if knows_power and not isinstance(solved, Solution):
        return solved
    correction = _Correction(budget)
    for _ in range(CORRECTIONS):
        if not correction.goes_on(solved, _power_of_buses(method, solved, budget)):
            break
        record = budget_record(budget.members, correction.watts)
        asked = conditions._replace(budget=record)
        solved = method.solve_under(asked, targets, policy, multipliers)
    if correction.best is not None:
        return correction.best
    solved = method.solve_under(conditions, targets, policy, multipliers)
    power = _power_of_buses(method, solved, budget)
    if not (power > (1.0 + SLACK) * budget.watts).any():
        return solved
    answer, most_over = _answer_kept(method, conditions, targets[0], policy, budget)
    sentences = {_EXCEEDS} if most_over > 1.0 + EXACT else set()
    return method.solution_of(
        conditions, targets, answer.command[None], answer.multipliers[None], None, sentences
    )


class _Correction:
    """Budgets that the core is asked for by its tables, so that by the laws they are those of a
    question: secants of powers over budgets, both as logarithms, for each bus."""

    def __init__(self, budget: PowerBudget) -> None:
        self._budget = budget
        self.watts = budget.watts
        """What is asked for next (b,) [W]."""
        self.best: Solved | None = None
        """The answer within the budgets that leaves least of one."""
        self._least_left = np.inf
        self._last: tuple[Array, Array] | None = None

    def goes_on(self, solved: Solved, power: Array) -> bool:
        """Takes an answer in which buses take powers (b,) [W]; returns whether another one may
        be better."""
        over = np.log(np.maximum(power / self._budget.watts, LEAST_SQUARE))
        asked = np.log(self.watts / self._budget.watts)
        is_short = (over < -SHORT) & (over > -NEAR)
        left = float(np.where(is_short, -over, 0.0).max())
        if (over <= SLACK).all() and left < self._least_left:
            self.best = solved
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
        self._last = over, asked
        self.watts = np.where(is_off, self.watts * np.exp(-(over + SHORT / 2.0) / slope), self.watts)
        return True


def _answer_kept(
    method: BudgetMethod, conditions: Conditions, target: Array, policy: Policy, budget: PowerBudget
) -> tuple[BudgetAnswer, float]:
    """The answer by `BudgetedCore` to a target (6,), and the largest power of a bus over what it
    has. Where its multipliers end a little above a budget, it is asked for as much less."""
    answer = method.budgeted.answer(target, policy, conditions, budget)
    power = budget.power_of_buses(method.plant.power(answer.command))
    most = float((power / budget.watts).max())
    watts = budget.watts
    for _ in range(CORRECTIONS):
        if not 1.0 + SLACK < most < 1.0 + NEAR:
            break
        watts = np.minimum(watts, watts * budget.watts / np.maximum(power, LEAST_SQUARE))
        lower = replace(budget, watts=watts * (1.0 - SLACK))
        again = method.budgeted.answer(target, policy, conditions, lower)
        power = budget.power_of_buses(method.plant.power(again.command))
        if not float((power / budget.watts).max()) < most:
            break
        answer = again
        most = float((power / budget.watts).max())
    return answer, most


def _power_of_buses(method: BudgetMethod, solved: Solved, budget: PowerBudget) -> Array:
    """Power (b,) [W] of the buses at the command of a solution of one target."""
    return np.asarray(budget.power_of_buses(method.plant.power(solved.command))[0])


class _Asked:
    """One question to a budgeted core: which buses, actuators and axes count."""

    def __init__(self, core: BudgetedCore, conditions: Conditions, budget: PowerBudget) -> None:
        self._core = core
        self._conditions = conditions
        self._budget = budget
        n = core._n
        works = np.ones(n, bool) if conditions.lost is None else ~conditions.lost
        self._works: NDArray[np.bool_] = works
        counts = core._counts
        self._counts = counts if conditions.free is None else counts & ~conditions.free
        self._multipliers: Array | None = None
        """Of the last trial (6,), at which Newton's method begins in the next one."""

    def forget_multipliers(self) -> None:
        """Begins anew, as for another question."""
        self._multipliers = None

    def met(self, target: Array) -> BudgetAnswer | None:
        """Least power for the target (6,) within the budget; None where there is none.

        One bus for all takes the least power of any answer, so that the budget is too small where
        that is too much. With several, what one lacks others may have; and where turning costs,
        less calm takes less.
        """
        budget = self._budget
        feeds_all = len(budget.watts) == 1 and bool(budget.members.all())
        if feeds_all and not self._conditions.calm > 0.0:
            return None
        trial, factors, is_kept = self._keep(target, None, self._counts)
        if not is_kept:
            return None
        answer = self._answered(target, trial, factors)
        return answer if answer.is_attainable else None

    def nearest(self, target: Array, weights: Array) -> BudgetAnswer:
        """Policy `closest`: the nearest wrench, by the weights (6,) of the axes."""
        trial, factors, _ = self._keep(target, np.append(weights, 0.0), self._counts)
        return self._answered(target, trial, factors)

    def along_ray(self, target: Array) -> BudgetAnswer:
        """Policy `direction`: the largest share of the target; where there is none, what is nearest
        to any share."""
        on_ray = np.zeros(AXES_MISSING + 1)
        on_ray[-1] = 1.0
        trial, factors, _ = self._keep(target, on_ray, self._counts)
        if not trial.answer.is_attainable[0]:
            near_ray = np.append(np.full(6, HELD), 1.0)
            trial, factors, _ = self._keep(target, near_ray, self._counts)
        return self._answered(target, trial, factors)

    def by_priority(self, target: Array, policy: Policy) -> BudgetAnswer:
        """Policy `priority`: groups of axes in order, each as near as those before it allow."""
        wanted = target.copy()
        held = np.zeros(6, bool)
        trial: _Trial | None = None
        factors = np.ones(len(self._budget.watts))
        for group in policy.groups:
            served = group & self._counts
            if not served.any():
                continue
            weights = np.where(held, HELD, np.where(served, 1.0, 0.0))
            trial, factors, _ = self._keep(wanted, np.append(weights, 0.0), held | served)
            got = self._core._wrench_of(trial, self._works)
            missed = np.abs((wanted - got) / self._core._scale)[served].max()
            held |= served
            binds = bool((factors > 1.0).any())
            if missed <= CLOSE and not binds:
                continue  # what is missing is what a miss costs too little
            wanted[served] = got[served]
            feeds_all = len(factors) == 1 and bool(self._budget.members.all())
            if binds and feeds_all and missed > NEARLY:
                break  # no power is left, so that all else follows
        assert trial is not None
        return self._answered(target, trial, factors)

    def _answered(self, target: Array, trial: _Trial, factors: Array) -> BudgetAnswer:
        core = self._core
        command = trial.answer.command[0, : core._n]
        missing = np.where(self._counts, target - core._wrench_of(trial, self._works), 0.0)
        power = np.maximum(trial.power, 0.0)
        # The price of the power itself: buses share it by what they take.
        mean = float(power @ factors / power.sum()) if power.sum() > 0.0 else 1.0
        return BudgetAnswer(
            command.copy(),
            trial.answer.multipliers[0] / mean,
            factors,
            bool(np.abs(missing / core._scale).max() <= EXACT),
        )

    def _trial(
        self, target: Array, weights: Array | None, counts: NDArray[np.bool_], logarithm: Array
    ) -> _Trial:
        """Asks at logarithms (b,) of 1 + zeta; weights (7,) of what may miss, None for nothing."""
        core = self._core
        answer = core._asked(
            target,
            weights,
            self._budget.members.T @ logarithm,
            self._conditions,
            self._counts & ~counts,
            self._multipliers,
        )
        self._multipliers = answer.multipliers[0]
        power = core._power_of(answer.command[0, : core._n], self._works)
        missing = answer.command[0, core._n :, 0]
        miss_cost = 0.0 if weights is None else float(core._miss_costs @ missing**2) / 2.0
        return _Trial(answer, self._budget.members @ power, float(power.sum()), miss_cost)

    def _keep(
        self, target: Array, weights: Array | None, counts: NDArray[np.bool_]
    ) -> tuple[_Trial, Array, bool]:
        """Finds the multipliers at which each bus takes what it has, or less at a multiplier of 0:
        Newton's method on the logarithms x of 1 + zeta, with slopes by differences and then by
        Broyden's formula. Returns the answer, 1 + zeta (b,), and whether budgets are kept."""
        self.forget_multipliers()
        most = MOST_LOGARITHM if weights is not None else MOST_LOGARITHM_MET
        first = np.zeros(len(self._budget.watts))
        if weights is not None:
            # There a miss of the wrench scale costs what the robot takes at most, so that Newton's
            # method begins with actuators within their limits.
            first += np.log(MISS_COST)
        at = self._point(target, weights, counts, first)
        slope: Array | None = None
        is_fresh = False
        for _ in range(MOST_STEPS):
            if at.size <= ENOUGH or (at.logarithm >= most).any():
                break
            if slope is None:
                slope = self._slope(target, weights, counts, at)
                is_fresh = True
            after = self._stepped(target, weights, counts, at, slope, most)
            if after is None:
                if is_fresh:
                    break
                slope = None
                continue
            # Broyden's formula
            moved = after.logarithm - at.logarithm
            left = after.excess - at.excess - slope @ moved
            slope = slope + np.outer(left, moved) / max(float(moved @ moved), LEAST_SQUARE)
            is_fresh = False
            at = after
        return at.trial, np.exp(at.logarithm), bool((at.excess <= NEARLY).all())

    def _point(
        self, target: Array, weights: Array | None, counts: NDArray[np.bool_], logarithm: Array
    ) -> _Point:
        """What is known at logarithms (b,) of 1 + zeta."""
        trial = self._trial(target, weights, counts, logarithm)
        watts = self._budget.watts
        share = trial.power / watts
        excess = np.where(share > 1.0, np.log(np.maximum(share, 1.0)), share - 1.0)
        size = float(np.abs(np.maximum(excess, -logarithm)).max())
        factor = np.exp(logarithm)
        value = trial.miss_cost + trial.power_of_all - float(np.sum(trial.power))
        value += float(factor @ trial.power - (factor - 1.0) @ watts)
        return _Point(trial, logarithm, excess, size, value)

    def _slope(
        self, target: Array, weights: Array | None, counts: NDArray[np.bool_], at: _Point
    ) -> Array:
        """Derivatives (b, b) of the excesses by the logarithms, by differences."""
        buses = len(at.logarithm)
        slope = np.empty((buses, buses))
        for bus in range(buses):
            beside = at.logarithm.copy()
            beside[bus] += SLOPE_STEP
            moved = self._point(target, weights, counts, beside)
            slope[:, bus] = (moved.excess - at.excess) / SLOPE_STEP
        return slope

    def _stepped(
        self,
        target: Array,
        weights: Array | None,
        counts: NDArray[np.bool_],
        at: _Point,
        slope: Array,
        most: float,
    ) -> _Point | None:
        """The point after a step of Newton's method, shortened until it is a better one; None where
        none is."""
        is_active = (at.logarithm > 0.0) | (at.excess > 0.0)
        count = int(is_active.sum())
        # The excess falls with the logarithm; where actuators are at their limits, hardly.
        of_active = slope[np.ix_(is_active, is_active)] - min(LEAST_SLOPE, at.size) * np.eye(count)
        step = np.zeros(len(at.logarithm))
        step[is_active] = np.linalg.lstsq(of_active, -at.excess[is_active], rcond=None)[0]
        step = np.clip(step, -LARGEST_STEP, LARGEST_STEP)
        # Where Newton's method leads nowhere, each multiplier goes where its bus wants it, or one
        # alone does: the value of the dual rises along each.
        plain = np.clip(at.excess, -LARGEST_STEP, LARGEST_STEP)
        alone = np.eye(len(plain)) * plain if len(plain) > 1 else ()
        for direction in (step, plain, *alone):
            for share in SHARES_OF_STEP:
                logarithm = np.clip(at.logarithm + share * direction, 0.0, most)
                after = self._point(target, weights, counts, logarithm)
                rises = after.value > at.value + NOTHING * abs(at.value)
                if after.size < 0.5 * at.size or rises:
                    return after
                if after.size < at.size and after.value > at.value - NOTHING * abs(at.value):
                    return after
        return None


def _with_missing_forces(contents: BlockContents, wrench_scale: Array) -> BlockContents:
    """The robot with actuators of what is missing behind its own: one for each axis, whose newton
    is the wrench scale, and one along a ray, which each question sets."""
    count = AXES_MISSING + 1
    grid = price_grid(1.0)
    table = RadialTable(1.0, grid, np.ones_like(grid), 0.0)
    columns = np.vstack([np.diag(wrench_scale), wrench_scale])
    responses = [*contents.responses, *(Line(each, table, table) for each in columns)]
    forms = [*contents.forms, *(Form("thruster") for _ in columns)]
    effectiveness = np.zeros((count, 2, 6))
    effectiveness[:, 0] = columns
    of_laws = np.zeros((count, 3, 6))
    of_laws[:, 0] = columns
    ones = np.zeros((count, 3))
    ones[:, 0] = 1.0

    def extended(numbers: AnyArray, others: AnyArray) -> AnyArray:
        return np.concatenate([numbers, others])

    return contents._replace(
        responses=responses,
        forms=forms,
        command_min=extended(contents.command_min, -ones),
        command_max=extended(contents.command_max, ones),
        max_change=extended(contents.max_change, np.full((count, 3), np.inf)),
        is_free_angle=extended(contents.is_free_angle, np.zeros(count, np.bool_)),
        force_range=extended(contents.force_range, np.tile([-1.0, 1.0], (count, 1))),
        row_force_max=extended(contents.row_force_max, np.ones((count, 2))),
        flow_speed=extended(contents.flow_speed, np.zeros(count)),
        uncertainty_cost=extended(contents.uncertainty_cost, np.zeros(count)),
        effectiveness=extended(contents.effectiveness, effectiveness),
        effectiveness_of_laws=extended(contents.effectiveness_of_laws, of_laws),
        basis=np.eye(6)[:, contents.is_commanded > 0.0],
    )
