"""The default method: least watts by the dual, exact by the actuators' own laws.

The core in C (`finlab.core`) finds multipliers, forces and commands for a robot that Python has
compiled, under the conditions of a question: limits, rates from the command before, losses. What
its tables leave undone, by the actuators' own laws, is removed by Levenberg-Marquardt steps on the
commands, within the same limits.
"""

from collections.abc import Callable, Set
from dataclasses import dataclass
from functools import cache, cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.response import power_of
from finlab.allocation.dual.compiled import Compiled, core_policy
from finlab.allocation.method import Method, Settings, number
from finlab.allocation.policy import CLOSEST, Policy
from finlab.allocation.question import MAX_WRENCH, MethodQuestion
from finlab.allocation.solution import PreparedAnswers, Solution, Solved
from finlab.arrays import EXACT, NEARLY, NOTHING, ROUNDING, Array
from finlab.axes import axes_in
from finlab.core.calls import NOMINAL, AnswerRow, Conditions, CoreAnswer
from finlab.errors import AllocationError
from finlab.layout.effectiveness import wrench_of_forces
from finlab.physics.objective import judged_power

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

    from finlab.allocation.levenberg_marquardt import CommandProblem
    from finlab.allocation.power_budget import PowerBudget
    from finlab.core.coupled_core import CoupledCore

LAW_SAMPLES = 64
"""Random commands of each actuator at which the core's grids are compared with the laws."""
EXACT_POWER = 1e-11
"""Share of a power by which the core's table may be off and count as the law."""
NOT_MEASURED = -1.0
"""Stands for the error up to which the core's grids are exact where they were not measured."""
MAX_BASES = 32
"""States of losses and free axes of which the basis of what is driven is kept."""
_TRUNCATED = (
    "the search for a better answer was ended by its limit of steps: the power may be above the "
    "least, by no more than it is above bound"
)
"""Note of an answer whose search ended early."""


@dataclass(frozen=True)
class DualSettings(Settings):
    """What can be set of the default method."""

    robust: float = number(
        0.0,
        0.0,
        1e9,
        "what an expected miss of 1 % of the wrench scale is worth, growing with its square",
        "W",
    )
    period_s: float = number(0.1, 0.0, 1000.0, "time between ticks", "s", above=True)
    calm: float = number(
        2.0, 0.0, 10.0, "what turning costs in a tick: 0 nothing, 2 some power for half the turning"
    )


class FinishedSolution:
    """A `Solved` of one target, whose command is the best as the core gives it; all else is found
    when it is read."""

    __slots__ = ("_conditions", "_method", "_row", "_targets", "command")

    def __init__(
        self, method: "Dual", conditions: Conditions, targets: Array, row: AnswerRow
    ) -> None:
        """Takes what the core has answered.

        Args:
            method: in the flow of the question.
            conditions: under which it was asked.
            targets: (1, 6) [N, N m].
            row: the answer, which is finished.
        """
        self._method = method
        self._conditions = conditions
        self._targets = targets
        self._row = row
        self.command = row.command[None]
        """Command (1, n, 3)."""

    @property
    def bound(self) -> Callable[[Array, Array], Array] | None:
        """Proves the lower bound of the power, see `Dual.bound`; None where it proves none."""
        if self._method.has_no_bound:
            return None
        row = self._row
        return partial(
            self._method.bound,
            row.wrench_served,
            row.multipliers,
            row.gap_power_bound,
            self._conditions,
        )

    @property
    def calm_power(self) -> Callable[[Array], Array] | None:
        """Gives what less turning takes, see `Dual.calm_power`; None outside of ticks."""
        if self._conditions.calm == 0.0:
            return None
        return partial(self._method.calm_power, self._conditions)

    @property
    def multipliers(self) -> Array:
        """Multipliers (1, 6) [W/N, W/(N m)]."""
        return self._row.multipliers

    def notes(self) -> tuple[str, ...]:
        """Returns sentences about the answer."""
        if self._row.is_met:
            return ()
        return self._method.notes_of(set(), self._targets, self._conditions)

    @property
    def wrench(self) -> None:
        """The method has no model of its own."""

    @property
    def candidates(self) -> None:
        """It has no candidates."""

    @property
    def samples(self) -> None:
        """It draws none."""


class Dual(Method):
    """Exact and cheapest on any actuators whose laws are known, without a network."""

    name = "dual"
    # A smaller wrench in the same direction still turns a robot to where it should go; the nearest
    # one may only push it on.
    policy_under_way = "direction"
    # Of each target there are a few hundred bytes; the fewer calls, the less do threads of a batch
    # wait for each other.
    most_targets = 4096
    reads = frozenset({"policy", "losses", "multipliers", "reference"})
    keeps_limits = True
    keeps_arcs = True
    settings_class = DualSettings
    settings: DualSettings

    def prepare(self) -> None:
        """Compiles the robot for the core."""
        miss_cost: Array | None = None
        if self.settings.robust > 0.0:
            from finlab.physics.expected_miss import miss_cost_of

            miss_cost = miss_cost_of(self.layout, self.scale, self.settings.robust)
        self.compiled = Compiled(
            self.layout, self.plant, self.scale, self.settings.period_s, miss_cost
        )
        """The robot as the core reads it."""
        self._in_last_flow: Dual | None = None
        """The method in the flow of the last question: a control loop asks in the same flow for
        many ticks, or in another one at each."""
        self._flow_key = b""
        """Bytes of the flow that this method is for; none at rest."""
        self._bases: dict[bytes, Array] = {}
        self._conditions = NOMINAL
        """Those of the last question outside of ticks."""
        self._was_asked = True
        """Whether the core's grids are worth to be measured: not for the first question in a flow,
        which is mostly the last one in it."""

    @cached_property
    def problem(self) -> "CommandProblem":
        """Steps on the commands, by the laws themselves."""
        from finlab.allocation.levenberg_marquardt import CommandProblem

        return CommandProblem.of(self.plant, self.scale)

    @cached_property
    def coupled(self) -> "CoupledCore":
        """The robot in the core with what its actuators do to each other, where they do."""
        from finlab.allocation.dual.outer_iterations import coupled_core

        return coupled_core(self.plant, self.compiled)

    def at(self, flow: Array | None) -> "Self":
        """Returns the method in a flow; see `Method.at`. The last flow's is kept."""
        if flow is None:
            return self
        key = flow.tobytes()
        last = self._in_last_flow  # read once: threads may share the method
        if last is not None and last._flow_key == key:
            return last  # type: ignore[return-value]
        other = super().at(flow)
        if other is not self:
            other.compiled = self.compiled.at(other.plant.inflow(None))
            other._in_last_flow = None
            other._bases = {}
            other._flow_key = key
            other._was_asked = False
            self._in_last_flow = other
        return other

    def solve(self, question: MethodQuestion) -> Solved:
        """Solves for targets; see `Method.solve`. In a tick pods turn in time for the reference.

        Returns:
            Commands (N, n, 3), NaN for lost actuators, and the lower bound of their power.
        """
        if len(question.targets) == 0:
            return Solution(np.empty((0, self.layout.n, 3)), lambda *_: np.empty(0))
        previous = question.previous
        reference = question.reference
        calm = self.settings.calm
        conditions = self._conditions
        if previous is not None:
            conditions = Conditions(previous, question.lost, question.free, calm)
        elif question.lost is not conditions.lost or question.free is not conditions.free:
            conditions = Conditions(None, question.lost, question.free)
            self._conditions = conditions  # those of the next question, mostly
        method = self.at(question.flow)
        if reference is not None and len(reference) and method.turns_ahead and previous is not None:
            from finlab.allocation.dual.ahead import conditions_ahead

            conditions = conditions_ahead(
                method.compiled, method.turn_rates, method.period_s, reference, conditions
            )
        if question.budget is not None:
            from finlab.allocation.dual.budget import solve_within

            return solve_within(method, conditions, question, question.budget)
        return method.solve_under(
            conditions, question.targets, question.policy, question.multipliers
        )

    def check_budget(self, budget: "PowerBudget", policy: Policy) -> None:
        """Refuses budgets where the core's power is not that of the actuators alone; see
        `Method.check_budget`."""
        refused = ""
        if self.plant.interaction is not None:
            refused = "robots whose actuators act on each other"
        elif any(actuator.KIND.driven_by_flow for actuator in self.layout.actuators):
            refused = "robots with rudders"
        elif self.compiled.miss_cost is not None:
            refused = "answers with the setting robust"
        elif policy.kind == "falling":
            refused = "policy 'falling'"
        if refused:
            raise AllocationError(
                f"power: no budget is kept yet for {refused}; leave out `power`, or scale the "
                "wrench down until `result.power` is small enough"
            )

    @cached_property
    def has_exact_power(self) -> bool:
        """Whether the core's tables say the powers of all actuators as their laws do: of
        propellers with a power law. Of others budgets are corrected."""
        rng = np.random.default_rng(0)
        command = self.plant.sample(rng, (LAW_SAMPLES,))
        power = self.plant.power(command)
        rows = zip(self.layout.actuators, self.compiled.responses, strict=True)
        for i, (actuator, response) in enumerate(rows):
            number = actuator.KIND.force_number
            if number is None:
                return False
            force = command[:, i, number]
            is_given = np.abs(force) >= getattr(actuator, "dead_band", 0.0)
            off = np.abs(power_of(response, force) - power[:, i])[is_given]
            if off.max(initial=0.0) > EXACT_POWER * power[:, i].max():
                return False
        return True

    @cached_property
    def knows_power(self) -> bool:
        """Whether the core keeps budgets by the actuators' own laws, or by tables that say the
        same; of others Python asks for corrected budgets."""
        if self.has_exact_power:
            return True
        laws = self.plant.power_formulas
        if laws is None:
            return False
        self.compiled.core.use_laws(laws)
        return True

    def prepared_answers(
        self,
        policy: Policy,
        lost: NDArray[np.bool_] | None,
        free: NDArray[np.bool_] | None,
        budget: "PowerBudget | None" = None,
    ) -> PreparedAnswers | None:
        """Prepares questions about single wrenches; see `Method.prepared_answers`."""
        if not self._most_core_error >= 0.0:
            return None
        if budget is not None and not self.knows_power:
            return None
        from finlab.core.prepared_call import RowBound, prepared_call

        conditions = Conditions(None, lost, free)
        core = self.compiled.core if self.plant.interaction is None else self.coupled
        record = None if budget is None else budget.record
        call = prepared_call(
            core,
            core_policy(policy),
            conditions._replace(budget=record),
            self.settings.calm,
            MAX_WRENCH,
            self._most_core_error,
        )
        if call is None:
            return None

        def solved(row: AnswerRow, question: MethodQuestion) -> FinishedSolution:
            asked = conditions._replace(budget=record)
            if question.previous is not None:
                asked = asked._replace(previous=question.previous, calm=self.settings.calm)
            return FinishedSolution(self, asked, question.targets, row)

        @cache
        def bounds() -> RowBound | None:
            formulas = self.plant.formulas
            if self.has_no_bound or formulas is None or not self.compiled.is_certified:
                return None
            if budget is not None:  # whose prices are looked for in Python
                return None
            return call.power_bounds(formulas, self.compiled.conjugate_margins)

        def bound(row: AnswerRow) -> float | None:
            bound_of_row = bounds()
            by_core = None if bound_of_row is None else bound_of_row(row)
            return None if by_core is None else by_core * (1.0 - ROUNDING)

        return PreparedAnswers(call.answer, solved, bound)

    @cached_property
    def turn_rates(self) -> Array:
        """Rates (n,) [rad/s] at which pods turn whose turning costs; NaN of other actuators."""
        turn_rate = self.layout.rates[:, 0]
        turns_slowly = self.compiled.turning_costs & np.isfinite(turn_rate)
        return np.where(turns_slowly, turn_rate, np.nan)

    @property
    def turns_ahead(self) -> bool:
        """Whether wrenches to come tell where pods are to turn."""
        return self.settings.calm > 0.0 and bool(np.isfinite(self.turn_rates).any())

    def in_time(self, target: Array, reference: Array) -> Array:
        """Returns which wrench is answered; see `Method.in_time`."""
        # Turning is what makes pods late, and they turn ahead: what is asked for is given at once.
        return target if self.turns_ahead else super().in_time(target, reference)

    def solve_under(
        self,
        conditions: Conditions,
        targets: Array,
        policy: Policy,
        multipliers: Array | None = None,
    ) -> Solved:
        """Solves for targets in the flow of this method.

        Args:
            conditions: rates, losses and free axes.
            targets: desired wrenches (N, 6), at least one [N, N m].
            policy: what to give out of reach.
            multipliers: lambda (6,) [W/N, W/(N m)] at which Newton's method begins, for a single
                target; None for its own.

        Returns:
            Commands, with the lower bound of their power.
        """
        if self.plant.interaction is not None:
            return self._solve_coupled(conditions, targets, policy, multipliers)
        if len(targets) == 1:
            most_error = self._error_allowed()
            row = self.compiled.answer_row(targets[0], policy, multipliers, conditions, most_error)
            if row.is_finished:
                return FinishedSolution(self, conditions, targets, row)
            answer = row.copied()
        else:
            answer = self.compiled.forces(targets, policy, None, conditions)
            if self._are_finished(answer, conditions):
                return self._solution_of_finished(answer, targets, conditions)
        from finlab.allocation.levenberg_marquardt import exact_commands

        problem = self.problem_under(conditions)
        command = exact_commands(problem, answer)
        # A search of bytes takes a third of the time of numpy's `all`, and every tick pays for it.
        all_reachable = 0 not in answer.is_attainable.tobytes()
        wrench_served = targets if all_reachable else answer.wrench_served
        sentences = {_TRUNCATED} if answer.is_truncated else set()
        # Within a budget what is nearer to the ray may take more.
        is_on_ray = policy.kind != "direction" or conditions.budget is not None
        if not all_reachable and not is_on_ray:
            from finlab.allocation.dual.ray import keep_on_rays

            sentences |= keep_on_rays(self.compiled, problem, conditions, targets, answer, command)
        return self.solution(
            command,
            wrench_served,
            answer.multipliers,
            answer.gap_power_bound,
            partial(self.notes_of, sentences, targets[~answer.is_attainable], conditions),
            conditions,
        )

    def _are_finished(self, answer: CoreAnswer, conditions: Conditions) -> bool:
        """Whether all targets are met by the commands as the core gives them, outside of ticks."""
        if conditions.previous is not None or answer.is_truncated:
            return False
        largest_error = float(answer.error.max())
        return largest_error <= self._most_core_error and bool(answer.is_attainable.all())

    def _solution_of_finished(
        self, answer: CoreAnswer, targets: Array, conditions: Conditions
    ) -> Solution:
        """The solution for targets (N, 6) that the core's commands meet; there is nothing to say of
        them."""
        if conditions.lost is not None:
            answer.command[:, conditions.lost] = np.nan
        bound = partial(self.bound, targets, answer.multipliers, answer.gap_power_bound, conditions)
        return Solution(
            answer.command,
            bound=None if self.has_no_bound else bound,
            multipliers=answer.multipliers,
        )

    def _error_allowed(self) -> float:
        """Error by the core's grids up to which the answer to a single target is exact."""
        if self._was_asked:
            return self._most_core_error
        self._was_asked = True
        return NOT_MEASURED

    @cached_property
    def _most_core_error(self) -> float:
        """Error by the core's grids of the laws up to which it is at most `EXACT` by the laws
        themselves; below 0 where grids are too coarse to say so.

        What a grid is off is measured at random commands, and doubled.
        """
        rng = np.random.default_rng(0)
        command = self.plant.sample(rng, (LAW_SAMPLES,))
        by_grids = np.einsum(
            "knf,nfa->kna", self.compiled.core.forces_of(command), self.compiled.axes
        )
        off_force = self.plant.force(command) - by_grids
        off_wrench = np.einsum("kna,naw->knw", off_force, self.plant.effectiveness)
        for i, is_this in enumerate(np.eye(self.layout.n, dtype=bool)):
            off_wrench[:, i] -= self.compiled.wrench_offset_of(is_this)
        largest_off = np.abs(off_wrench / self.scale).max(axis=0).sum(axis=0)
        return EXACT - 2.0 * float(np.linalg.norm(largest_off))

    def _solve_coupled(
        self, conditions: Conditions, targets: Array, policy: Policy, multipliers: Array | None
    ) -> Solved:
        """Solves as `solve_under`, for a robot whose actuators act on each other."""
        record = core_policy(policy)
        if len(targets) == 1:
            most_error = self._error_allowed()
            row = self.coupled.answer_row(targets[0], record, multipliers, conditions, most_error)
            if row.is_finished:
                return FinishedSolution(self, conditions, targets, row)
            answer = row.copied()
        else:
            answer = self.coupled.answer_many(targets, record, None, conditions)
            if self._are_finished(answer, conditions):
                return self._solution_of_finished(answer, targets, conditions)
        from finlab.allocation.dual.outer_iterations import finished_answer

        problem = self.problem_under(conditions)
        answer = finished_answer(problem, targets, policy, answer)
        notes = partial(self.notes_of, set(), targets[~answer.is_attainable], conditions)
        return self.solution(
            answer.command,
            answer.wrench_served,
            answer.multipliers,
            answer.gap_power_bound,
            notes,
            conditions,
        )

    def solution(
        self,
        command: Array,
        wrench_served: Array,
        multipliers: Array,
        gap_power_bound: Array,
        notes: Callable[[], tuple[str, ...]],
        conditions: Conditions,
    ) -> Solution:
        """Puts an answer together.

        Args:
            command: (N, n, 3), which the drives may not follow yet; its rows of lost actuators
                become NaN.
            wrench_served: (N, 6) [N, N m] that the commands give.
            multipliers: lambda (N, 6) [W/N, W/(N m)], which prove the bound.
            gap_power_bound: power (N,) [W] that gaps are proved to need.
            notes: gives sentences about the answer.
            conditions: under which the commands were found.

        Returns:
            The solution, whose bound is computed when it is asked for.
        """
        if conditions.previous is None:
            command = self.plant.rested(command)
        else:
            command = self.rates.box(conditions.previous).clip_feasible(command, self.plant)
        if conditions.lost is not None:
            command[:, conditions.lost] = np.nan
        command.setflags(write=False)
        bound: Callable[[Array, Array], Array] = partial(
            self.bound, wrench_served, multipliers, gap_power_bound, conditions
        )
        return Solution(
            command,
            bound=None if self.has_no_bound else bound,
            calm_power=partial(self.calm_power, conditions) if conditions.calm > 0.0 else None,
            multipliers=multipliers,
            notes=notes,
        )

    def solution_of(
        self,
        conditions: Conditions,
        targets: Array,
        command: Array,
        multipliers: Array,
        is_unreached: NDArray[np.bool_] | None,
        sentences: Set[str] = frozenset(),
    ) -> Solution:
        """Returns the solution that commands are which were found within power budgets.

        Args:
            conditions: under which they were found.
            targets: (N, 6) [N, N m].
            command: (N, n, 3).
            multipliers: lambda (N, 6) [W/N, W/(N m)].
            is_unreached: which targets (N,) are out of reach; None for all.
            sentences: about the commands.
        """
        problem = self.problem_under(conditions)
        _, finite_command = self._without_nan(command, conditions)
        unreached = targets if is_unreached is None else targets[is_unreached]
        return self.solution(
            command,
            problem.wrench(finite_command) * problem.error_scale,
            multipliers,
            np.zeros(len(targets)),
            partial(self.notes_of, set(sentences), unreached, conditions),
            conditions,
        )

    def notes_of(
        self, sentences: set[str], unreached: Array, conditions: Conditions
    ) -> tuple[str, ...]:
        """Returns what there is to say of answers.

        Args:
            sentences: about how they were found.
            unreached: targets (N, 6) [N, N m] that are out of reach.
            conditions: under which they were.
        """
        of_axes: set[str] = set()
        for target in unreached:
            of_axes |= self.undriven_notes(target[None], conditions)
        return tuple(sorted(sentences | of_axes))

    def calm_power(self, conditions: Conditions, command: Array) -> Array:
        """Returns the power that commands take beyond those that give the same wrenches where
        turning costs nothing.

        Args:
            conditions: of the tick.
            command: (N, n, 3), NaN for lost actuators.

        Returns:
            (N,) [W].
        """
        works, finite_command = self._without_nan(command, conditions)
        wrench = self.problem_under(conditions).wrench(finite_command) * self.scale
        for_nothing = conditions._replace(calm=0.0)
        other_command = self.solve_under(for_nothing, wrench, CLOSEST).command
        power = self.plant.power(finite_command)[:, works].sum(axis=-1)
        least_power = self.plant.power(other_command)[:, works].sum(axis=-1)
        return np.asarray(np.maximum(power - least_power, 0.0))

    def _without_nan(
        self, command: Array, conditions: Conditions
    ) -> tuple[NDArray[np.bool_], Array]:
        """Returns which actuators (n,) work, and commands (N, n, 3) with numbers in place of the
        lost ones' NaN, whose forces and powers do not count."""
        works = np.ones(self.layout.n, bool) if conditions.lost is None else ~conditions.lost
        return works, np.where(works[:, None], command, self.plant.lower)

    def problem_under(self, conditions: Conditions) -> "CommandProblem":
        """Returns the problem of steps on commands under some conditions: within the rates, with
        the actuators that work, in the axes that count."""
        problem = self.problem
        if conditions.lost is not None or conditions.free is not None:
            works = None if conditions.lost is None else ~conditions.lost
            counts = None if conditions.free is None else ~conditions.free
            problem = problem.restricted(works, counts)
        if conditions.previous is None:
            return problem
        return problem.in_tick(self.rates.box(conditions.previous))

    def _basis_under(self, conditions: Conditions) -> Array:
        """Directions (6, r) of scaled wrenches that the actuators drive, orthonormal."""
        compiled = self.compiled
        if conditions.lost is None and conditions.free is None:
            return compiled.basis
        works = np.ones(self.layout.n, bool) if conditions.lost is None else ~conditions.lost
        counts = np.ones(6, bool) if conditions.free is None else ~conditions.free
        key = works.tobytes() + counts.tobytes()
        if key not in self._bases:
            while len(self._bases) >= MAX_BASES:
                self._bases.pop(next(iter(self._bases)), None)
            self._bases[key] = compiled.span(works, counts)
        return self._bases[key]

    def undriven_notes(self, targets: Array, conditions: Conditions) -> set[str]:
        """Tells of axes that come together only, and that targets ask for apart.

        Args:
            targets: desired wrenches (N, 6) [N, N m], out of reach.
            conditions: what holds of the robot.

        Returns:
            One sentence, or none.
        """
        basis = self._basis_under(conditions)
        scaled = targets / self.compiled.axis_scale
        if conditions.free is not None:
            scaled = np.where(conditions.free, 0.0, scaled)
        outside_span = np.abs(scaled - (scaled @ basis) @ basis.T)
        is_outside = (outside_span > NEARLY * np.abs(scaled).max(initial=0.0)).any(axis=0)
        axes = axes_in(np.asarray(is_outside & self._driven(conditions)))
        if not axes:
            return set()
        return {
            f"no actuators give {', '.join(axes)} apart as is asked: where one of them does not "
            "count, leave it out of the layout's axes, or name it in free"
        }

    @cached_property
    def undriven(self) -> tuple[str, ...]:
        """Names of the axes of a wrench that no actuator gives."""
        return axes_in(~self._driven(NOMINAL))

    def _driven(self, conditions: Conditions) -> NDArray[np.bool_]:
        """Which axes (6,) of the wrench some actuator gives, whatever it gives along others."""
        effectiveness = np.abs(self.compiled.effectiveness)
        if conditions.lost is not None:
            effectiveness = effectiveness[~conditions.lost]
        size = effectiveness.max(axis=(0, 1))
        driven = size > NOTHING * size.max()
        return np.asarray(driven if conditions.free is None else driven & ~conditions.free)

    @property
    def has_no_bound(self) -> bool:
        """Whether the bound would be one of something else than the power of the answer: with what
        an expected miss costs."""
        return self.compiled.miss_cost is not None

    def bound(
        self,
        wrench_served: Array,
        multipliers: Array,
        gap_power_bound: Array,
        conditions: Conditions,
        command: Array,
        force: Array,
    ) -> Array:
        """Proves a lower bound of the power by weak duality (Eq. 3).

        Args:
            wrench_served: (N, 6) [N, N m] for which the core found forces.
            multipliers: its lambda (N, 6) [W/N, W/(N m)].
            gap_power_bound: power (N,) [W] that gaps of the actuators' sets are proved to need for
                these wrenches, by the core's tables.
            conditions: under which they were found.
            command: (N, n, 3), whose wrenches count: they are the served ones to rounding, or as
                near as the laws come.
            force: their forces (N, n, 3) [N] by the plant, own frames, 0 of lost actuators.

        Returns:
            Power (N,) [W] that no answer undercuts which gives these wrenches under the conditions;
            never above theirs.
        """
        wrench = self._wrench_of(command, force)
        if conditions.free is not None:  # its multiplier is 0
            wrench = np.where(conditions.free, 0.0, wrench)
        compiled = self.compiled
        if compiled.is_certified:
            margins = compiled.conjugate_margins
            bound = compiled.core.power_bounds(multipliers, wrench, margins, conditions)
            bound = self._bound_within_budgets(bound, multipliers, conditions, command, wrench)
            if np.count_nonzero(gap_power_bound) == 0:
                return np.asarray(bound * (1.0 - ROUNDING))
        else:
            from finlab.allocation.dual.bound import bound_by_laws

            bound = bound_by_laws(compiled, wrench, multipliers, conditions)
            bound = self._bound_within_budgets(bound, multipliers, conditions, command, wrench)
        return self._bound_below_power(
            bound, wrench_served, multipliers, gap_power_bound, conditions, command, wrench
        )

    def _wrench_of(self, command: Array, force: Array) -> Array:
        """Wrenches (N, 6) [N, N m] of commands (N, n, 3) with these forces (N, n, 3) [N]; of one
        command with the bits that `PreparedCall.power_bounds` has."""
        if len(command) == 1:
            figures = self.plant.figures(command[0])
            if figures is not None:
                return figures.wrench[None]
        wrench: Array = wrench_of_forces(force, self.plant.effectiveness)
        return wrench

    def _bound_within_budgets(
        self,
        bound: Array,
        multipliers: Array,
        conditions: Conditions,
        command: Array,
        wrench: Array,
    ) -> Array:
        """Raises bounds (N,) [W] of answers that budgets may have made dearer (Eq. 28); arguments
        as of `_bound_below_power`."""
        budget = conditions.budget
        if budget is None:
            return bound
        from finlab.allocation.dual.bound import TABLE_ERROR
        from finlab.allocation.dual.budget_bound import bounds_within_budgets

        power = judged_power(self.plant, command)
        low = np.flatnonzero(bound < (1.0 - TABLE_ERROR) * power)
        if len(low) == 0:
            return bound
        within = bounds_within_budgets(self.compiled, wrench[low], multipliers[low], conditions)
        raised = bound.copy()
        raised[low] = np.maximum(bound[low], np.minimum(within, power[low]))
        return raised

    def _bound_below_power(
        self,
        bound: Array,
        wrench_served: Array,
        multipliers: Array,
        gap_power_bound: Array,
        conditions: Conditions,
        command: Array,
        wrench: Array,
    ) -> Array:
        """Raises bounds (N,) [W] by what gaps and measured tables prove, and cuts them at the
        power; the other arguments are those of `bound`, and the wrenches (N, 6) [N, N m] that
        count."""
        from finlab.allocation.dual.bound import TABLE_ERROR, bound_by_measured_tables

        power = judged_power(self.plant, command)
        if not self._reads_tables and np.count_nonzero(gap_power_bound):
            missed = (wrench - wrench_served) / self.scale
            is_served = np.linalg.norm(missed, axis=-1) <= NEARLY
            by_gaps = (1.0 - TABLE_ERROR) * gap_power_bound - self._least_table_error
            with_gaps = np.maximum(bound, np.minimum(by_gaps, power))
            bound = np.where(is_served, with_gaps, bound)
        if self._reads_tables and conditions.lost is None:
            # The multipliers are those of the smooth shapes that stand for measured tables.
            low = np.flatnonzero(bound < (1.0 - TABLE_ERROR) * power)
            by_measurements = bound_by_measured_tables(
                self.compiled,
                self.plant,
                self.scale,
                wrench[low],
                multipliers[low],
                command[low],
                conditions,
            )
            bound[low] = np.maximum(bound[low], by_measurements)

        # Above the power it is off by what tables are off; by more than that it proves nothing.
        largest_by_tables = (1.0 + TABLE_ERROR) * power + self._least_table_error
        within = np.minimum(np.maximum(bound, 0.0), power)
        bound = np.where(bound > largest_by_tables, 0.0, within)
        return np.asarray(bound * (1.0 - ROUNDING))

    @cached_property
    def _least_table_error(self) -> float:
        """By how much [W] the core's tables, which are off by a share of full power, may be off at
        the least forces by more."""
        return NEARLY * self.compiled.largest_power

    @cached_property
    def _reads_tables(self) -> bool:
        """Whether an actuator's law is a measured table."""
        return any(actuator.reads for actuator in self.layout.actuators)
