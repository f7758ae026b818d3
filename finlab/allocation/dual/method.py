"""The default method: least watts by the dual, exact by the actuators' own laws.

The core in C (`finlab.core`) finds prices, forces and commands for a robot that Python has
compiled, within what may be given now: limits, rates from the command before, losses. What its
tables leave undone, by the actuators' own laws, is removed by Levenberg-Marquardt steps on the
commands, within the same limits.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.compiled import Compiled, price_of_doubt, proved_power
from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.allocation.method import Method
from finlab.allocation.policy import CLOSEST, Policy
from finlab.allocation.settings import Settings, number
from finlab.allocation.solution import Solution
from finlab.arrays import CLOSE, NEARLY, NOTHING, ROUNDING, ROUNDS, Array
from finlab.axes import axes_in
from finlab.core.calls import STILL, Found, Now
from finlab.layout.effectiveness import wrench_of_forces

if TYPE_CHECKING:
    from finlab.core.whole import Whole

EXACT = 1e-8
"""Error, on the yardstick, up to which commands need no further step."""
MOST_SPANS = 32
"""States of losses and free axes whose driven directions are kept."""
_ENDED = "the search for a better answer was ended by its limit of steps"


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


class Dual(Method):
    """Exact and cheapest on any actuators whose laws are known, without a network."""

    name = "dual"
    # A smaller wrench in the same direction still turns a robot to where it should go; the nearest
    # one may only push it on.
    policy_under_way = "direction"
    begins_at_prices = True
    takes_losses = True
    looks_ahead = True
    settings_class = DualSettings
    settings: DualSettings

    def prepare(self) -> None:
        doubt = price_of_doubt(self.layout, self.scale, self.settings.robust)
        self.compiled = Compiled(self.layout, self.plant, self.scale, self.settings.period_s, doubt)
        self._last: tuple[bytes, Self] | None = None
        self._spans: dict[bytes, Array] = {}

    @cached_property
    def problem(self) -> CommandProblem:
        """The robot by its own laws."""
        return CommandProblem.of(self.plant, self.scale)

    @cached_property
    def whole(self) -> "Whole":
        from finlab.allocation.dual.turns import whole_of

        return whole_of(self)

    def at(self, flow: Array | None) -> Self:
        if flow is None:
            return self
        key = flow.tobytes()
        if self._last is not None and self._last[0] == key:
            return self._last[1]
        other = super().at(flow)
        if other is not self:
            other.compiled = self.compiled.at(other.plant.inflow(None))
            other._last = None
            other._spans = {}
            self._last = key, other
        return other

    def solve(
        self,
        targets: Array,
        *,
        policy: Policy,
        previous: Array | None = None,
        flow: Array | None = None,
        seed: int = 0,
        prices: Array | None = None,
        lost: NDArray[np.bool_] | None = None,
        free: NDArray[np.bool_] | None = None,
        reference: Array | None = None,
    ) -> Solution:
        """Solves for targets; see `Method.solve`.

        Args:
            targets: as for `Method`.
            policy: as for `Method`.
            previous: as for `Method`.
            flow: as for `Method`.
            seed: as for `Method`.
            prices: (6,) [W/N, W/(N m)] at which Newton's method begins, for a single target.
            lost: which actuators (n,) do not work; None where all do.
            free: which axes (6,) may take any wrench; None for none.
            reference: wrenches (K, 6) of the next ticks [N, N m]; pods turn in time for them.
        """
        if len(targets) == 0:
            return Solution(np.empty((0, self.layout.n, 3)), lambda _: np.empty(0))
        now = Now(previous, lost, free, 0.0 if previous is None else self.settings.calm)
        method = self.at(flow)
        if reference is not None and len(reference) and method.turns_ahead and previous is not None:
            from finlab.allocation.dual.ahead import turning_ahead

            now = turning_ahead(method, reference, now)
        return method.solve_now(targets, policy, now, prices)

    @cached_property
    def turning(self) -> NDArray[np.bool_]:
        """Which actuators (n,) are pods whose turning costs."""
        is_pod = self.compiled.robot.pods
        return np.asarray(is_pod & np.isfinite(self.layout.rates[:, 0]))

    @property
    def turns_ahead(self) -> bool:
        """Whether wrenches to come tell where pods are to turn."""
        return self.settings.calm > 0.0 and bool(self.turning.any())

    def in_time(self, target: Array, reference: Array) -> Array:
        # Turning is what makes pods late, and they turn ahead: what is asked for is given now.
        return target if self.turns_ahead else super().in_time(target, reference)

    def solve_now(
        self, targets: Array, policy: Policy, now: Now, prices: Array | None = None
    ) -> Solution:
        """Solves for targets with what may be given now, in the water of `flow`.

        Args:
            targets: wrenches (N, 6), at least one [N, N m].
            policy: what to give beyond reach.
            now: limits, rates, losses and free axes that hold now.
            prices: (6,) [W/N, W/(N m)] at which Newton's method begins, for a single target.

        Returns:
            Commands, with the lower bound of their power.
        """
        if self.plant.interaction is not None:
            from finlab.allocation.dual.turns import settled

            return settled(self, targets, policy, now, prices)
        found = self.forces(targets, policy, prices, now)
        # A search of bytes, in a third of the time of numpy's `all`.
        beyond = (
            np.flatnonzero(~found.is_attainable).tolist()
            if 0 in found.is_attainable.tobytes()
            else []
        )
        wrench_served = found.wrench_served if beyond else targets
        notes = {_ENDED} if found.is_truncated else set()
        command = self.exact(found, now)
        if policy.kind == "direction":
            for row in beyond:
                notes.add(self._kept_on_the_ray(targets[row], row, found, command, now))
        if beyond:
            notes |= self.not_held(targets[beyond], now)
        return self.solution(
            command, wrench_served, found.prices, found.gap_power_bound, notes, now
        )

    def solution(
        self,
        command: Array,
        wrench_served: Array,
        price: Array,
        gap_power_bound: Array,
        notes: set[str],
        now: Now,
    ) -> Solution:
        """Returns commands (N, n, 3) for wrenches (N, 6) as a solution, with the bound that prices
        (N, 6) and values (N,) [W] prove, and sentences."""
        if now.lost is not None:
            command[:, now.lost] = np.nan
        bound: Callable[[Array], Array] = partial(
            self.bound, wrench_served, price, gap_power_bound, now
        )
        return Solution(
            command,
            bound=None if self.unproved else bound,
            calm_power=partial(self.calm_power, now) if now.calm > 0.0 else None,
            prices=price,
            notes=tuple(sorted(notes - {""})),
        )

    def calm_power(self, now: Now, command: Array) -> Array:
        """Power (N,) [W] that commands (N, n, 3) take now beyond those that give the same wrenches
        where turning costs nothing."""
        works, given = self._working(command, now)
        wrench = self.problem_now(now).wrench(given) * self.scale
        other = self.solve_now(wrench, CLOSEST, now._replace(calm=0.0)).command
        power = self.plant.power(given)[:, works].sum(axis=-1)
        least = self.plant.power(other)[:, works].sum(axis=-1)
        return np.asarray(np.maximum(power - least, 0.0))

    def _working(self, command: Array, now: Now) -> tuple[NDArray[np.bool_], Array]:
        """Returns which actuators (n,) work, and commands (N, n, 3) with numbers in place of the
        lost ones' NaN, whose forces and powers do not count."""
        works = np.ones(self.layout.n, bool) if now.lost is None else ~now.lost
        return works, np.where(works[:, None], command, self.plant.lower)

    def problem_now(self, now: Now) -> CommandProblem:
        """Returns the problem of steps on commands within what may be given now."""
        problem = self.problem
        if now.lost is not None or now.free is not None:
            works = None if now.lost is None else ~now.lost
            counts = None if now.free is None else ~now.free
            problem = problem.standing(works, counts)
        return problem if now.previous is None else problem.after(self.rates.box(now.previous))

    def _kept_on_the_ray(
        self, target: Array, row: int, found: Found, command: Array, now: Now
    ) -> str:
        """Keeps one answer on the ray of its target, where the laws differ from the core's tables.

        Args:
            target: wrench (6,) [N, N m] along which the answer is to lie.
            row: of the answer in `found` and `command`, which are overwritten by the largest share
                of the target that the laws give (Eq. 14), found by bisection.
            found: aims (N, 6), prices and values of all answers.
            command: (N, n, 3).
            now: what may be given.

        Returns:
            The sentence where no share can be given; else none.
        """
        ray = target / self.scale
        wrench_served = found.wrench_served
        size_squared = max(float(ray @ ray), 1e-300)
        projection = float(wrench_served[row] / self.scale @ ray)
        error = self.error(command[row : row + 1], wrench_served[row : row + 1], now)[0]
        off_ray = wrench_served[row] / self.scale - projection / size_squared * ray
        if error <= NEARLY and np.abs(off_ray).max() <= NEARLY:
            return ""
        if now.previous is not None:
            return ""  # what the drives' rates leave is nearest to the ray already

        low = 0.0
        high = projection
        is_kept = False
        while high > low + NEARLY * size_squared:
            middle = 0.5 * (low + high)
            tried = middle / size_squared * target[None]
            answer = self.forces(tried, None, None, now)
            answer_command = self.exact(answer, now)
            if self.error(answer_command, tried, now)[0] > NEARLY:
                high = middle
                continue
            low = middle
            is_kept = True
            command[row] = answer_command[0]
            wrench_served[row] = tried[0]
            found.prices[row] = answer.prices[0]
            found.gap_power_bound[row] = answer.gap_power_bound[0]
        if is_kept:
            return ""
        cancelled = self._cancelled(now)
        if cancelled is None:
            return "no share of the target was found that the actuators can give alone"
        command[row] = cancelled
        wrench_served[row] = 0.0
        found.prices[row] = 0.0
        found.gap_power_bound[row] = 0.0
        return ""

    def _cancelled(self, now: Now) -> Array | None:
        """A command (n, 3) of actuators that cannot rest whose least forces, nearly, cancel; None
        without any."""
        lower = self.layout.lower
        width = self.layout.upper - lower
        share = np.random.default_rng(0).random((ROUNDS, *lower.shape))
        share[..., :-1] **= 4  # most of them near the least forces
        start = lower + share * width
        return self._meeting(self.problem_now(now), np.zeros(6), start)

    def _meeting(self, problem: CommandProblem, wrench: Array, starts: Array) -> Array | None:
        """The cheapest command (n, 3) that gives a normalized wrench (6,) where steps from starts
        (R, n, 3) lead; None where none does."""
        ends = refine(problem, wrench[None], starts, 2 * ROUNDS, EXACT)
        met = ends.command[ends.error <= NEARLY]
        if len(met) == 0:
            return None
        power = self.plant.power(met).sum(axis=-1)
        return np.asarray(met[power.argmin()])

    def _span(self, now: Now) -> Array:
        """Directions (6, r) of scaled wrenches that the actuators drive now, orthonormal."""
        robot = self.compiled.robot
        if now.lost is None and now.free is None:
            return robot.basis
        works = np.ones(self.layout.n, bool) if now.lost is None else ~now.lost
        counts = np.ones(6, bool) if now.free is None else ~now.free
        key = works.tobytes() + counts.tobytes()
        if key not in self._spans:
            while len(self._spans) >= MOST_SPANS:
                self._spans.pop(next(iter(self._spans)), None)
            self._spans[key] = robot.span(works, counts)
        return self._spans[key]

    def not_held(self, targets: Array, now: Now) -> set[str]:
        """The sentence about axes that come together only, and that targets (N, 6) ask for
        apart."""
        robot = self.compiled.robot
        basis = self._span(now)
        scaled = targets / robot.scale
        if now.free is not None:
            scaled = np.where(now.free, 0.0, scaled)
        left = np.abs(scaled - (scaled @ basis) @ basis.T)
        beside = (left > NEARLY * np.abs(scaled).max(initial=0.0)).any(axis=0)
        axes = axes_in(np.asarray(beside & self._driven(now)))
        if not axes:
            return set()
        return {
            f"no actuators give {', '.join(axes)} apart as is asked: where one of them does not "
            "count, leave "
            "it out of the layout's axes, or name it in free"
        }

    @cached_property
    def undriven(self) -> tuple[str, ...]:
        return axes_in(~self._driven(STILL))

    def _driven(self, now: Now) -> NDArray[np.bool_]:
        """Which axes (6,) of the wrench some actuator gives, whatever it gives along others."""
        effectiveness = np.abs(self.compiled.robot.effectiveness)
        if now.lost is not None:
            effectiveness = effectiveness[~now.lost]
        size = effectiveness.max(axis=(0, 1))
        driven = size > NOTHING * size.max()
        return np.asarray(driven if now.free is None else driven & ~now.free)

    def bound(
        self, wrench_served: Array, price: Array, gap_power_bound: Array, now: Now, command: Array
    ) -> Array:
        """Proves a lower bound of the power by weak duality (Eq. 3).

        Args:
            wrench_served: wrenches (N, 6) that were found [N, N m].
            price: multipliers (N, 6) of them [W/N, W/(N m)].
            gap_power_bound: power (N,) [W] that gaps of the actuators' sets are proved to need for
                them.
            now: what may be given.
            command: (N, n, 3), whose wrenches count: they are the aims to rounding, or as near as
                the laws come.

        Returns:
            Power (N,) [W] that no answer undercuts which gives these wrenches now; never above
            theirs.
        """
        works, command = self._working(command, now)
        force = np.where(works[:, None], self.plant.force(command), 0.0)
        wrench = wrench_of_forces(force, self.plant.effectiveness)
        if now.free is not None:  # its price is 0
            wrench = np.where(now.free, 0.0, wrench)
        is_finite = np.isfinite(price).all(axis=-1, keepdims=True)
        price = np.where(is_finite, price, 0.0)
        power = self.plant.power(command)[:, works].sum(axis=-1)

        at_rest = proved_power(self.compiled, wrench, np.zeros_like(price), now)
        bound = np.maximum(proved_power(self.compiled, wrench, price, now), at_rest)
        largest_power = self.compiled.robot.largest_power
        if not self._measured:
            # The value is one of tables, which are off by a share of full power, at the least
            # forces by more.
            value_by_laws = (1.0 - 10.0 * CLOSE) * gap_power_bound - NEARLY * largest_power
            value_by_laws = np.minimum(value_by_laws, power)
            is_of_served = _sizes((wrench - wrench_served) / self.scale) <= NEARLY
            bound = np.where(is_of_served, np.maximum(bound, value_by_laws), bound)
        elif works.all():
            # The prices are those of the smooth shapes that stand for tables.
            rows = np.flatnonzero(bound < (1.0 - 10.0 * CLOSE) * power)
            bound[rows] = np.maximum(
                bound[rows], self._bound_of_tables(wrench, price, command, rows, now)
            )

        # Above the power it is off by what tables are off; by more than that it proves nothing.
        above_by_tables = (1.0 + 10.0 * CLOSE) * power + NEARLY * largest_power
        bound = np.where(bound > above_by_tables, 0.0, np.clip(bound, 0.0, power))
        return np.asarray(bound * (1.0 - ROUNDING))

    def _bound_of_tables(
        self, wrench: Array, price: Array, command: Array, rows: NDArray[np.intp], now: Now
    ) -> Array:
        """Lower bounds (R,) [W] for some rows (R,) of answers, at prices that are raised by the
        measured tables themselves."""
        from finlab.allocation.dual.price_ascent import raised_price

        if len(rows) == 0:
            return np.empty(0)
        questions = zip(wrench[rows], price[rows], command[rows], strict=True)
        raised = np.stack(
            [raised_price(self.plant, self.scale, *question) for question in questions]
        )
        return proved_power(self.compiled, wrench[rows], raised, now)

    @cached_property
    def _measured(self) -> bool:
        return any(part.reads for part in self.layout.actuators)

    @property
    def unproved(self) -> bool:
        """Whether the bound would be one of something else than the power of the answer: with what
        doubt costs."""
        return self.compiled.doubt is not None

    def forces(
        self, targets: Array, policy: Policy | None, prices: Array | None = None, now: Now = STILL
    ) -> Found:
        """Forces of least power for wrenches (N, 6), or for those that a policy gives in their
        place, of what may be given now; for a single one the search begins at prices (6,) of the
        wrench."""
        core = self.compiled.robot.core
        if len(targets) == 1:
            return core.one(targets[0], policy, prices, now)
        return core.many(targets, policy, now)

    def exact(self, found: Found, now: Now = STILL) -> Array:
        """Commands (N, n, 3) that give what was found exactly, by the plant, within what may be
        given now; or as near to it as they come."""
        command = found.command
        problem = self.problem_now(now)
        missing = problem.wrench(command) - found.wrench_served / self.scale
        if problem.counts is not None:
            missing = np.where(problem.counts, missing, 0.0)
        if (each := missing.ravel()).dot(each) <= EXACT**2:
            return command
        # Where the core's tables say what the laws say, it has done all that steps on commands can
        # do.
        error = _sizes(missing)
        rough = np.flatnonzero(
            (error > found.error + EXACT) | (found.is_attainable & (error > NEARLY))
        )
        if not len(rough):
            return command
        ends = refine(
            problem, found.wrench_served[rough] / self.scale, command[rough], ROUNDS, EXACT
        )
        command[rough] = ends.command
        if now.previous is not None:
            return self.rates.box(now.previous).held(command, self.plant)
        for row in rough[(ends.error > NEARLY) & found.is_attainable[rough]].tolist():
            # Such as idle fins in line, or a least force: no small change of these commands helps.
            draw = np.random.default_rng(0).uniform(-1.0, 1.0, (2 * ROUNDS, *command.shape[1:]))
            shares = np.geomspace(10.0 * CLOSE, 1.0, len(draw))[:, None, None]
            starts = command[row] + shares * draw * self.problem.width
            other = self._meeting(problem, found.wrench_served[row] / self.scale, starts)
            command[row] = command[row] if other is None else other
        return self.plant.rested(command)

    def error(self, command: Array, wrench_served: Array, now: Now = STILL) -> Array:
        """Distance (N,), on the yardstick, of what commands (N, n, 3) give now from wrenches (N,
        6)."""
        missing = self.problem_now(now).wrench(command) - wrench_served / self.scale
        return _sizes(missing if now.free is None else np.where(now.free, 0.0, missing))


def _sizes(missing: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("ni,ni->n", missing, missing)))
