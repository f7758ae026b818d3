"""The default method: least watts by the dual, exact by the actuators' own laws.

The core in C (`finlab.core`) finds prices, forces and commands for a robot that Python has compiled. What its
tables leave undone, by the actuators' own laws, is removed by Levenberg-Marquardt steps on the commands.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Self

import numpy as np

from finlab.allocation.dual.compiled import Compiled, price_of_doubt, proved_power
from finlab.allocation.dual.price_ascent import raised_price
from finlab.allocation.dual.rates import Rates
from finlab.allocation.dual.turns import settled, whole_of
from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.allocation.method import Method
from finlab.allocation.policy import Policy
from finlab.allocation.settings import Settings, number
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.axes import axes_in, mask_of
from finlab.core.calls import Found
from finlab.core.whole import Whole
from finlab.layout.effectiveness import wrench_of_forces
from finlab.precision import CLOSE, NEARLY, NOTHING, ROUNDING, ROUNDS

EXACT = 1e-8
"""Error, on the yardstick, up to which commands need no further step."""
TICK_STEPS = 5
"""Steps of a command of a tick that is not exact."""
_ENDED = "the search for a better answer was ended by its limit of steps"


@dataclass(frozen=True)
class DualSettings(Settings):
    """What can be set of the default method."""

    robust: float = number(
        0.0, 0.0, 1e9, "what an expected miss of 1 % of the yardstick is worth, growing with its square", "W"
    )
    period_s: float = number(0.1, 0.0, 1000.0, "time between ticks", "s", above=True)


class Dual(Method):
    """Exact and cheapest on any actuators whose laws are known, without a network."""

    name = "dual"
    # A smaller wrench in the same direction still turns a robot to where it should go; the nearest one may
    # only push it on.
    policy_under_way = "direction"
    begins_at_prices = True
    settings_class = DualSettings
    settings: DualSettings

    def prepare(self) -> None:
        doubt = price_of_doubt(self.layout, self.scale, self.settings.robust)
        self.compiled = Compiled(self.layout, self.plant, self.scale, self.settings.period_s, doubt)
        self._last: tuple[bytes, Self] | None = None

    @cached_property
    def problem(self) -> CommandProblem:
        """The robot by its own laws."""
        return CommandProblem.of(self.plant, self.scale)

    @cached_property
    def rates(self) -> Rates:
        return Rates(self.plant, self.layout.rates * self.settings.period_s)

    @cached_property
    def whole(self) -> Whole:
        return whole_of(self)

    def at(self, flow: Array | None) -> Self:
        if flow is None:
            return self
        key = flow.tobytes()
        if self._last is not None and self._last[0] == key:
            return self._last[1]
        other = super().at(flow)
        if other is not self:
            other.compiled, other._last = self.compiled.at(other.plant.inflow(None)), None
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
    ) -> Solution:
        """See `Method`. For a single target, Newton's method may begin at `prices` (6,) [W/N, W/(N m)]."""
        if len(targets) == 0:
            return Solution(np.empty((0, self.layout.n, 3)), lambda _: np.empty(0))
        if (moved := self.at(flow)) is not self:
            return moved.solve(targets, policy=policy, previous=previous, seed=seed, prices=prices)
        if self.plant.interaction is not None:
            return settled(self, targets, policy, previous, prices)
        found = self.forces(targets, policy, self.begin(prices), previous)
        # A search of bytes, in a third of the time of numpy's `all`.
        beyond = self._beyond(found, targets) if 0 in found.within.tobytes() else []
        command, aim = self.exact(found, previous), found.aim if beyond else targets
        notes = {_ENDED} if found.ended else set()
        if policy.kind == "direction":
            for row in beyond:
                notes.add(self._kept_on_the_ray(targets[row], row, found, command))
        if beyond:
            notes |= self.not_held(targets[beyond])
        bound: Callable[[Array], Array] = partial(self.bound, aim, found.price, found.value)
        return Solution(
            command, None if self.unproved else bound, prices=found.price, notes=tuple(sorted(notes - {""}))
        )

    def _beyond(self, found: Found, targets: Array) -> list[int]:
        """Places of the targets (N, 6) out of reach. Those that take the last share of a force, which tables
        leave out, are met first: steps by the laws lead there from what is nearest."""
        beyond = np.flatnonzero(~found.within)
        near = beyond[_sizes((found.aim[beyond] - targets[beyond]) / self.scale) <= 10.0 * CLOSE]
        if len(near):
            ends = refine(self.problem, targets[near] / self.scale, found.command[near], ROUNDS, EXACT)
            met = ends.error <= NEARLY
            rows = near[met]
            found.command[rows], found.aim[rows] = ends.command[met], targets[rows]
            found.value[rows], found.within[rows] = 0.0, True
        return np.flatnonzero(~found.within).tolist()

    def begin(self, prices: Array | None) -> Array | None:
        """Prices (6,) [W/N, W/(N m)] in the robot's basis (6,)."""
        robot = self.compiled.robot
        return None if prices is None else np.asarray(robot.rows.dot(robot.scale * prices))

    def _kept_on_the_ray(self, target: Array, row: int, found: Found, command: Array) -> str:
        """Replaces a row of aims (N, 6) and commands (N, n, 3) that are to lie along a target (6,) and do
        not, by the largest share that does; the sentence where there is none."""
        along, aim = target / self.scale, found.aim
        low, high, size = 0.0, float(aim[row] / self.scale @ along), max(float(along @ along), 1e-300)
        if self.error(command[row : row + 1], aim[row : row + 1])[0] <= NEARLY:
            return ""
        kept = False
        while high > low + NEARLY * size:
            share = 0.5 * (low + high)
            tried = share / size * target[None]
            one = self.forces(tried, None)
            its = self.exact(one)
            if self.error(its, tried)[0] <= NEARLY:
                low, kept, command[row], aim[row] = share, True, its[0], tried[0]
                found.price[row], found.value[row] = one.price[0], one.value[0]
            else:
                high = share
        if not kept and (rest := self._cancelled) is not None:
            kept, command[row], aim[row], found.price[row], found.value[row] = True, rest, 0.0, 0.0, 0.0
        return "" if kept else "no share of the target was found that the actuators can give alone"

    @cached_property
    def _cancelled(self) -> Array | None:
        """A command (n, 3) of actuators that cannot rest whose least forces, nearly, cancel; None without
        any."""
        lower, upper = self.layout.lower, self.layout.upper
        share = np.random.default_rng(0).random((ROUNDS, *lower.shape))
        share[..., :-1] **= 4
        start = lower + share * (upper - lower)
        return self._meeting(np.zeros(6), start)

    def _meeting(self, wrench: Array, starts: Array) -> Array | None:
        """The cheapest command (n, 3) that gives a normalized wrench (6,) where steps from starts (R, n, 3)
        lead; None where none does."""
        ends = refine(self.problem, wrench[None], starts, 2 * ROUNDS, EXACT)
        met = ends.command[ends.error <= NEARLY]
        return met[self.plant.power(met).sum(axis=-1).argmin()] if len(met) else None

    def not_held(self, targets: Array) -> set[str]:
        """The sentence about axes that come together only, and that targets (N, 6) ask for apart."""
        robot = self.compiled.robot
        if not len(targets):
            return set()
        scaled = targets / robot.scale
        left = np.abs(scaled - (scaled @ robot.basis) @ robot.basis.T)
        left = left > NEARLY * np.abs(scaled).max(initial=0.0)
        axes = axes_in(left.any(axis=0) & ~mask_of(self.undriven))
        if not axes:
            return set()
        return {
            f"no actuators give {', '.join(axes)} apart as is asked: where one of them does not count, leave "
            "it out of the layout's axes, or ask nan of it"
        }

    @cached_property
    def undriven(self) -> tuple[str, ...]:
        size = np.abs(self.compiled.robot.effectiveness).max(axis=(0, 1))
        return axes_in(size <= NOTHING * size.max())

    def bound(self, aim: Array, price: Array, value: Array, command: Array) -> Array:
        """Power (N,) [W] that no answer undercuts which gives the wrenches that commands (N, n, 3) give."""
        wrench = wrench_of_forces(self.plant.force(command), self.plant.effectiveness)
        bound = proved_power(self.compiled, wrench, price)
        power = self.plant.power(command).sum(axis=-1)
        if not self._measured:
            bound = np.where(_sizes((wrench - aim) / self.scale) <= NEARLY, np.maximum(bound, value), bound)
        elif len(rows := np.flatnonzero(bound < (1.0 - 10.0 * CLOSE) * power)):
            # The prices are those of the smooth shapes that stand for tables.
            questions = zip(wrench[rows], price[rows], command[rows], strict=True)
            raised = np.stack([raised_price(self.plant, self.scale, *one) for one in questions])
            for tried in (raised, np.zeros_like(raised)):  # the latter prove the power at rest
                other = proved_power(self.compiled, wrench[rows], tried)
                bound[rows] = np.maximum(0.0, np.maximum(bound[rows], other))
        slack = power * (1.0 + NEARLY) + NOTHING * self.compiled.robot.largest_power
        return np.where((bound > power) & (bound <= slack), power, bound) * (1.0 - ROUNDING)

    @cached_property
    def _measured(self) -> bool:
        return any(part.reads for part in self.layout.actuators)

    @property
    def unproved(self) -> bool:
        """Whether the bound would be one of something else than the power of the answer: with what doubt
        costs."""
        return self.compiled.doubt is not None

    def forces(
        self, targets: Array, policy: Policy | None, inner: Array | None = None, previous: Array | None = None
    ) -> Found:
        """Forces of least power for wrenches (N, 6), or for those that a policy gives in their place; for a
        single one the search begins at prices `inner` (6,) in the basis, and commands may follow `previous`
        ones (n, 3)."""
        core = self.compiled.robot.core
        if len(targets) == 1:
            return core.one(targets[0], policy, inner, previous)
        return core.many(targets, policy)

    def exact(self, found: Found, previous: Array | None = None) -> Array:
        """Commands (N, n, 3) that give what was found exactly, by the plant; from tick to tick as near as
        what may follow the `previous` ones (n, 3) comes."""
        command, missing = found.command, self._missing(found.command, found.aim)
        if (each := missing.ravel()).dot(each) <= EXACT**2:
            return command
        rough = np.flatnonzero(_sizes(missing) > EXACT)
        if not len(rough):
            return command
        if previous is not None:
            return self._follow(found, previous)
        ends = refine(self.problem, found.aim[rough] / self.scale, command[rough], ROUNDS, EXACT)
        command[rough] = ends.command
        for row in rough[(ends.error > NEARLY) & found.within[rough]].tolist():
            # Such as idle fins in line, or a least force: no small change of these commands helps.
            draw = np.random.default_rng(0).uniform(-1.0, 1.0, (2 * ROUNDS, *command.shape[1:]))
            shares = np.geomspace(10.0 * CLOSE, 1.0, len(draw))[:, None, None]
            starts = command[row] + shares * draw * self.problem.width
            other = self._meeting(found.aim[row] / self.scale, starts)
            command[row] = command[row] if other is None else other
        return self.plant.rested(command)

    def _follow(self, found: Found, previous: Array) -> Array:
        """Steps by the laws on a command of a tick, in the box of what may follow the previous one (n, 3)."""
        if self.rates.allow(previous, found.command[0]):
            free = self.exact(found._replace(command=found.command.copy()))
            if self.rates.allow(previous, free[0]):
                return free
        box = self.rates.box(previous)
        full = box.free[:, 2] & self.plant.full_turn
        problem = replace(self.problem, lower=box.lower, upper=box.upper, full_turn=full)
        start = box.clipped(found.command)
        command = refine(problem, found.aim / self.scale, start, TICK_STEPS, EXACT).command
        command = self.plant.feasible(box.clipped(command))
        rested = self.plant.rested(command)
        return np.where(box.clipped(rested) == rested, rested, command)

    def error(self, command: Array, aim: Array) -> Array:
        return _sizes(self._missing(command, aim))

    def _missing(self, command: Array, aim: Array) -> Array:
        """What commands (N, n, 3) give beside wrenches (N, 6) that they are to give, normalized."""
        return np.asarray(self.problem.wrench(command) - aim / self.scale)


def _sizes(missing: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("ni,ni->n", missing, missing)))
