"""The default method: least watts by the dual, exact by the actuators' own laws.

Prices give forces (`newton`, `branch`), forces give commands (`compiled`), and what the compiled laws leave
undone is asked for on top and removed by Levenberg-Marquardt steps on the commands. A wrench out of reach
becomes the one that the policy asks for (`policies`); from tick to tick, commands stay within what may follow
the previous ones (`rates`).
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.branch import HOLLOW, STEPS_AT_KINK, gaps, least_power, may_have_gaps
from finlab.allocation.dual.compiled import Compiled, price_of_doubt, proved_power
from finlab.allocation.dual.drag import EXACT, Search
from finlab.allocation.dual.newton import MOST_STEPS, Deadline, Prices, dual_value, solve, start
from finlab.allocation.dual.policies import Nearest, Rates, nearest, within_tick
from finlab.allocation.dual.sets import Sets
from finlab.allocation.dual.turns import Linear, settled
from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.allocation.method import Method
from finlab.allocation.policy import Policy
from finlab.allocation.settings import Settings, number
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.axes import axes_in, mask_of
from finlab.layout.effectiveness import wrench_of_forces
from finlab.precision import CLOSE, FINE, NEARLY, NOTHING, ROUNDING, ROUNDS

TICK_STEPS = 5
"""Steps of a command of a tick that is not exact."""
STEPS_WITH_DRAG = 2 * ROUNDS
"""Newton's steps from the prices of commands near to a target."""


@dataclass(frozen=True)
class DualSettings(Settings):
    """What can be set of the default method."""

    robust: float = number(
        0.0, 0.0, 1e9, "what an expected miss of 1 % of the yardstick is worth, growing with its square", "W"
    )
    period_s: float = number(0.1, 0.0, 1000.0, "time between ticks", "s", above=True)


class Forces(NamedTuple):
    """What the dual gives for N targets."""

    force: Array
    """Forces (k, N) [N]."""
    price: Array
    """Prices (N, 6) of the wrench [W/N, W/(N m)]."""
    within: NDArray[np.bool_]
    """Targets within reach (N,)."""
    prices: Array
    """The same as `price` (r, N) in the robot's basis [W]."""
    value: Array
    """Power (N,) [W] that branches on gaps have proved to be needed; 0 where there was none."""
    aim: Array
    """The wrenches (N, 6) [N, N m] that they give: the targets, or those that the policy gives."""
    command: Array | None = None
    """Commands (N, n, 3) that give the targets, drag and all, NaN where there are none; None without drag."""

    @classmethod
    def joined(cls, each: Sequence["Forces"]) -> "Forces":
        """Those of single targets."""
        along = [1 if name in ("force", "prices") else 0 for name in cls._fields]
        columns: Any = zip(zip(*each, strict=True), along, strict=True)
        return cls(*(np.concatenate(parts, axis) for parts, axis in columns))


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
        self.compiled = Compiled(self.layout, self.plant, doubt)
        self._last: tuple[bytes, Self] | None = None

    @cached_property
    def search(self) -> Search:
        return Search(CommandProblem.of(self.plant, self.scale), self.compiled.weight)

    @cached_property
    def rates(self) -> Rates:
        return Rates(self.plant, self.layout.rates * self.settings.period_s)

    def at(self, flow: Array | None) -> Self:
        key = b"" if flow is None else flow.tobytes()
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
        return self._solve(targets, policy, previous, prices)

    def _solve(
        self, targets: Array, policy: Policy, previous: Array | None, prices: Array | None = None
    ) -> Solution:
        if self.plant.interaction is not None:
            return settled(self, targets, policy, previous, prices)
        resting, deadline = self.compiled.beside, Deadline(len(targets))
        forces = self.forces(targets - resting, policy, deadline, self.begin(prices))
        aim = targets if forces.within.all() else forces.aim + resting
        command = self.commands(aim, forces, previous)
        notes = set()
        if policy.kind == "direction":
            for row in np.flatnonzero(~forces.within):
                notes.add(self._kept_on_the_ray(targets[row], int(row), aim, forces, command, deadline))
        if previous is not None and not self.rates.allow(previous, command[0]):
            command = self.in_a_tick(aim, forces, previous)
        bound: Callable[[Array], Array] = partial(self.bound, aim, forces.price, forces.value)
        notes |= self.not_held(targets[~forces.within]) | deadline.notes
        return Solution(
            command, None if self.unproved else bound, prices=forces.price, notes=tuple(sorted(notes - {""}))
        )

    def begin(self, prices: Array | None) -> Array | None:
        """Prices (6,) [W/N, W/(N m)] in the robot's basis (r, 1)."""
        robot = self.compiled.robot
        return None if prices is None else robot.basis.T @ (robot.scale * prices)[:, None]

    def linear(self, model: Linear) -> Self:
        """The same on a linear model; its search, in commands, is that of the whole one."""
        other = copy(self)
        other.compiled = self.compiled.tilted(model.effectiveness, model.beside)
        other.__dict__["search"], other.__dict__["rates"] = self.search, self.rates
        return other

    def _kept_on_the_ray(
        self, target: Array, row: int, aim: Array, forces: Forces, command: Array, deadline: Deadline
    ) -> str:
        """Replaces a row of aims (N, 6) and commands (N, n, 3) that are to lie along a target (6,) and do
        not, by the largest share that does; the sentence where there is none."""
        along = target / self.scale
        low, high, size = 0.0, float(aim[row] / self.scale @ along), max(float(along @ along), 1e-300)
        if self.error(command[row : row + 1], aim[row : row + 1])[0] <= NEARLY:
            return ""
        kept = False
        while high > low + CLOSE * size and not deadline.passed():
            share = 0.5 * (low + high)
            tried = share / size * target[None]
            one = self.forces(tried - self.compiled.beside, None, deadline)
            its = self.commands(tried, one)
            if self.error(its, tried)[0] <= NEARLY:
                low, kept, command[row], aim[row] = share, True, its[0], tried[0]
                forces.price[row], forces.value[row] = one.price[0], one.value[0]
            else:
                high = share
        if not kept and (rest := self._cancelled) is not None:
            kept, command[row], aim[row], forces.price[row], forces.value[row] = True, rest, 0.0, 0.0, 0.0
        return "" if kept else "no share of the target was found that the actuators can give alone"

    @cached_property
    def _cancelled(self) -> Array | None:
        """A command (n, 3) of actuators that cannot rest whose least forces, nearly, cancel; None without
        any."""
        lower, upper = self.layout.lower, self.layout.upper
        share = np.random.default_rng(0).random((ROUNDS, *lower.shape))
        share[..., :-1] **= 4
        start = lower + share * (upper - lower)
        best = self.search.exact(np.zeros(6), start)
        return None if best is None else best.command

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
        size = np.abs(self.compiled.robot.effectiveness).max(axis=0)
        return axes_in(size <= NOTHING * size.max())

    def bound(self, aim: Array, price: Array, value: Array, command: Array) -> Array:
        """Power (N,) [W] that no answer undercuts which gives the wrenches that commands (N, n, 3) give."""
        wrench = wrench_of_forces(self.plant.force(command), self.plant.effectiveness)
        bound = proved_power(self.compiled, wrench, price)
        bound = np.where(self._missing(wrench, aim) <= NEARLY, np.maximum(bound, value), bound)
        power = self.plant.power(command).sum(axis=-1)
        slack = power * (1.0 + NEARLY) + NOTHING * self.compiled.robot.largest_power
        return np.where((bound > power) & (bound <= slack), power, bound) * (1.0 - ROUNDING)

    @cached_property
    def unproved(self) -> bool:
        """Whether the bound would be one of something else than the power of the answer: with what doubt
        costs, or of the smooth shape that stands for a measured table."""
        measured = any(part.reads for part in self.layout.actuators)
        return measured or self.compiled.doubt is not None

    def forces(
        self, targets: Array, policy: Policy | None, deadline: Deadline, prices: Array | None = None
    ) -> Forces:
        """Forces of least power for wrenches (N, 6), or for those that a policy gives in their place."""
        robot, sets = self.compiled.robot, self.compiled.robot.sets
        target, drags = robot.target(targets), len(robot.answers.dragging) > 0
        if drags and len(targets) > 1:
            return Forces.joined([self.forces(one[None], policy, deadline) for one in targets])
        if not len(target):  # nothing pushes, such as foils at rest
            nothing = np.zeros((len(robot.effectiveness), len(targets)))
            none = np.zeros((len(targets), 6))
            return Forces(nothing, none, np.all(targets == 0.0, axis=1), target, np.zeros(len(targets)), none)
        torn = drags or len(sets.forked) + len(sets.reversing) > 0
        steps, first = STEPS_AT_KINK if torn else MOST_STEPS, None
        if drags:
            first = robot.answers(robot.matrix @ start(robot, target, sets)[0], sets).force
            steps, near = STEPS_WITH_DRAG, self.compiled.commands(first)[0]
            if prices is None:
                prices = self.search.prices(near, self._directions)
        root = solve(robot, target, sets, prices, steps)
        within = root.solved | (~root.beyond & torn)
        if robot.basis.shape[1] < 6:
            rest = targets / robot.scale - (robot.basis @ target).T
            size = np.linalg.norm(targets / robot.scale, axis=1)
            within &= np.linalg.norm(rest, axis=1) <= NEARLY * (1e-3 + size)
        force, prices, value, aim = root.force, root.prices, np.zeros(len(targets)), targets
        if may_have_gaps(robot, sets, force):
            force, value = self._in_gaps(target, sets, root, within, deadline)
        command = None
        if first is not None:
            # What the tables prove leaves out what foils do beyond them.
            value = np.zeros(1)
            command, prices = self._with_drag(targets[0], force, first, root, deadline)
            within[0] = not np.isnan(command).any()
        if not within.all() and policy is not None:
            force, prices, value, aim = force.copy(), prices.copy(), value.copy(), aim.copy()
            for row in np.flatnonzero(~within):
                at = np.array([row])
                near = nearest(robot, sets.take(at), targets[row], policy, self.scale, deadline)
                aim[row], force[:, row], prices[:, row] = near.wrench, near.force, near.prices
                if may_have_gaps(robot, sets, near.force[:, None]):
                    self._cheaper_in_gaps(sets.take(at), near, force[:, row], deadline)
        return Forces(force, robot.price(prices), within, prices, value, aim, command)

    def _with_drag(
        self, wrench: Array, force: Array, first: Array, root: Prices, deadline: Deadline
    ) -> tuple[Array, Array]:
        """A command (1, n, 3) for a wrench (6,) from forces (k, 1) near to it, or the first ones, NaN where
        there is none; and its prices (r, 1)."""
        robot, search = self.compiled.robot, self.search
        aim, prices, begin = wrench + self.compiled.beside, root.prices, self.compiled.commands(force)
        if root.solved[0] and self.error(begin, aim[None])[0] <= EXACT:
            return begin, prices
        value, best_of = root.value, partial(search.cheapest, aim / self.scale)
        best = best_of(np.concatenate([begin, self.compiled.commands(first)]))
        if best is not None:
            if not root.solved[0]:
                tried = search.prices(best.command, self._directions)
                prices = np.concatenate([prices, tried], axis=1)
                value = dual_value(robot, robot.target(wrench[None]), robot.sets, prices)
                prices = prices[:, value.argmax()][:, None]
            # Else others may be far cheaper, as the dual leaves out the doubt of what drags.
            if self.compiled.doubt is None and best.cost <= 2.0 * value.max():
                return best.command[None], prices
        starts = self.plant.sample(np.random.default_rng(0), (ROUNDS,))
        for places, group in self.compiled.groups:
            if not group.feels_flow:
                starts[::2, places] = begin[0, places]
        other = None if root.beyond[0] or deadline.passed() else best_of(starts)
        ways = [way for way in (best, other) if way is not None]
        command = min(ways, key=lambda way: way.cost).command if ways else np.full_like(begin[0], np.nan)
        return command[None], prices

    @property
    def _directions(self) -> Array:
        """The basis' directions (6, r) on the yardstick."""
        robot = self.compiled.robot
        return np.asarray(self.scale[:, None] * robot.basis / robot.scale[:, None])

    def _cheaper_in_gaps(self, sets: Sets, near: Nearest, force: Array, deadline: Deadline) -> None:
        """Replaces forces (k,) of one part of sets with gaps by those of least power in all of it."""
        robot = self.compiled.robot
        target = robot.target(near.wrench[None])
        root = solve(robot, target, sets, deadline=deadline)
        within = ~root.beyond
        cheaper, _ = self._in_gaps(target, sets, root, within, deadline)
        if within[0]:
            force[:] = cheaper[:, 0]

    def _in_gaps(
        self, target: Array, sets: Sets, root: Prices, within: NDArray[np.bool_], deadline: Deadline
    ) -> tuple[Array, Array]:
        """Forces (k, N) in sets with gaps, and the power (N,) [W] that is proved to be needed there; `within`
        loses the targets that they do not meet."""
        robot = self.compiled.robot
        inside = gaps(robot, root.force, sets, root.prices) > 0.0
        rows = np.flatnonzero(within & inside.any(axis=0))
        within &= root.solved | inside.any(axis=0)
        if not len(rows):
            return root.force, np.broadcast_to(0.0, len(within))
        value = np.zeros(len(within))
        cut = least_power(robot, target[:, rows], sets.take(rows), root.take(rows), deadline)
        force = root.force.copy()
        force[:, rows] = cut.force
        within[rows[~cut.met]] = False
        value[rows] = np.where(cut.met, cut.value * (1.0 - FINE), 0.0)
        return force, value

    def commands(self, aim: Array, forces: Forces, previous: Array | None = None) -> Array:
        """Commands (N, n, 3) that give wrenches (N, 6) exactly, by the plant."""
        if previous is None and forces.command is not None and not np.isnan(forces.command).any():
            return self.plant.rested(forces.command)
        command = self.compiled.commands(forces.force, previous)
        error = self.error(command, aim)
        rough = np.flatnonzero(error > EXACT)
        if not len(rough):
            return self.plant.rested(command)
        if forces.command is not None:
            own = forces.command[rough]
            command[rough] = np.where(np.isnan(own), command[rough], own)
        # Steps that lead nowhere depend on the last bit: with drag each target goes its way alone.
        for rows in [rough] if forces.command is None else np.split(rough, range(1, len(rough))):
            ends = refine(self.search.problem, aim[rows] / self.scale, command[rows], ROUNDS, EXACT)
            command[rows] = ends.command
            for row in rows[(ends.error > NEARLY) & forces.within[rows]].tolist():
                # Such as idle fins in line, or a least force: no small change of these commands helps.
                draw = np.random.default_rng(0).uniform(-1.0, 1.0, (2 * ROUNDS, *command.shape[1:]))
                shares = np.geomspace(HOLLOW, 1.0, len(draw))[:, None, None]
                starts = command[row] + shares * draw * self.search.problem.width
                other = self.search.exact(aim[row] / self.scale, starts)
                command[row] = command[row] if other is None else other.command
        return self.plant.rested(command)

    def error(self, command: Array, aim: Array) -> Array:
        return self._missing(self.plant.wrench_of(self.plant.force(command)), aim)

    def _missing(self, wrench: Array, aim: Array) -> Array:
        missing = (wrench - aim) / self.scale
        return np.asarray(np.sqrt(np.einsum("ni,ni->n", missing, missing)))

    def in_a_tick(self, aim: Array, forces: Forces, previous: Array) -> Array:
        """The command (1, n, 3) that gives a wrench (1, 6) or comes nearest to it among those that may follow
        a previous one (n, 3); `forces` is the answer without limits of that kind."""
        box = self.rates.box(previous)
        sets, full = self.compiled.within(box.lower, box.upper), box.free[:, 2] & self.plant.full_turn
        problem = replace(self.search.problem, lower=box.lower, upper=box.upper, full_turn=full)
        wrench = aim - self.compiled.beside
        force = within_tick(self.compiled.robot, sets, wrench, forces.prices, 1.0 / self.scale)
        command = self.plant.feasible(box.clipped(self.compiled.commands(force, previous)))
        if self.error(command, aim)[0] > EXACT:
            command = refine(problem, aim / self.scale, box.clipped(command), TICK_STEPS, EXACT).command
            command = self.plant.feasible(box.clipped(command))
        rested = self.plant.rested(command)
        return np.where(box.clipped(rested) == rested, rested, command)
