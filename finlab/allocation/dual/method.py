"""The default method: least watts by the dual, exact by the actuators' own laws.

Prices give forces (`newton`, `branch`), forces give commands (`compiled`), and what the compiled laws leave
undone is asked for on top and removed by Levenberg-Marquardt steps on the commands. A wrench out of reach
becomes the one that the policy asks for (`policies`); from tick to tick, commands stay within what may follow
the previous ones (`rates`).
"""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.answers import Sets
from finlab.allocation.dual.bounds import proved_power
from finlab.allocation.dual.branch import gaps, least_power, may_have_gaps
from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.dual.doubt import price_of_doubt
from finlab.allocation.dual.drag import at_the_price_of_drag
from finlab.allocation.dual.newton import Prices, solve
from finlab.allocation.dual.policies import nearest
from finlab.allocation.dual.rates import Rates, within_tick
from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.allocation.method import Method
from finlab.allocation.policy import AXES, Policy
from finlab.allocation.settings import Settings, number
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.networks.trained import TrainedWeights
from finlab.physics.wrench import wrench_of_forces
from finlab.precision import FINE, NEARLY, NOTHING, ROUNDS

EXACT = 1e-8
"""Error, on the robot's yardstick, up to which commands need no further step."""
TICK_STEPS = 5
"""The same where a command of a tick is not exact."""


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
    """Which targets are within reach (N,)."""
    prices: Array
    """The same (r, N) in the robot's basis [W]."""
    value: Array
    """Power (N,) [W] that branches on gaps have proved to be needed; 0 where there was none."""


class Dual(Method):
    """Exact and cheapest on any actuators whose laws are known, without a network."""

    name = "dual"
    # A smaller wrench in the same direction still turns a robot to where it should go; the nearest one may
    # only push it on.
    policy_under_way = "direction"
    begins_at_prices = True
    settings_class = DualSettings
    settings: DualSettings

    def __init__(
        self, layout: Any, settings: Settings, scale: Array, weights: TrainedWeights | None = None
    ) -> None:
        super().__init__(layout, settings, scale, weights)
        doubt = price_of_doubt(layout, scale, self.settings.robust)
        self.compiled = Compiled(layout, self.plant, doubt)

    @cached_property
    def _problem(self) -> CommandProblem:
        return CommandProblem.of(self.plant, self.scale)

    @cached_property
    def _rates(self) -> Rates:
        return Rates.of(self.plant, self.layout.rates, self.settings.period_s)

    def at(self, flow: Array | None) -> Self:
        """See `Method`."""
        other = super().at(flow)
        if other is not self:
            inflow = other.plant.inflow(None)
            other.compiled = self.compiled.at(inflow)
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
        """See `Method`. For a single target, Newton's method begins at `prices` (6,) [W/N, W/(N m)], where
        they are given."""
        if len(targets) == 0:
            return Solution(np.empty((0, self.layout.n, 3)), lambda: np.empty(0))
        if (moved := self.at(flow)) is not self:
            return moved.solve(targets, policy=policy, previous=previous, seed=seed, prices=prices)
        if self.compiled.drags:
            return self._one_by_one(targets, policy, previous)
        return self._solve(targets, policy, previous, prices)

    def _one_by_one(self, targets: Array, policy: Policy, previous: Array | None) -> Solution:
        """Answers of a robot whose drag has another price for each target."""
        commands, bounds = [], np.empty(len(targets))
        for i, target in enumerate(targets):
            other = copy(self)
            other.compiled, bounds[i] = at_the_price_of_drag(self.compiled, target)
            if bounds[i] == 0.0 and policy.kind == "direction":
                low, high = 0.0, 1.0
                for _ in range(ROUNDS):  # halve the share of the target that is within reach
                    share = 0.5 * (low + high)
                    found, bound = at_the_price_of_drag(self.compiled, share * target)
                    if bound > 0.0:
                        low, other.compiled, bounds[i] = share, found, bound
                    else:
                        high = share
                target = low * target
            commands.append(other._solve(target[None], policy, previous).command)
        return Solution(np.concatenate(commands), None if self._unproved else lambda: bounds)

    def _solve(
        self, targets: Array, policy: Policy, previous: Array | None, prices: Array | None = None
    ) -> Solution:
        robot = self.compiled.robot
        begin = None if prices is None else robot.basis.T @ (robot.scale * prices)[:, None]
        aim, found = self._aimed(targets, policy, begin)
        command = self._commands(aim, found, previous)
        bound: Callable[[], Array] = partial(self._bound, aim, found)
        if len(targets) > 1:
            bound = partial(self._bound_again, targets, policy)
        if previous is not None and not self._rates.allow(previous, command[0]):
            command = self._in_a_tick(aim, found, previous)
        return Solution(command, None if self._unproved else bound, prices=found.price)

    def _aimed(self, targets: Array, policy: Policy, prices: Array | None = None) -> tuple[Array, Forces]:
        """What is given for targets (N, 6): themselves, or what the policy asks for; and by which forces."""
        robot = self.compiled.robot
        asked = targets - self.compiled.beside
        found = self._forces(asked, robot.sets, policy, prices)
        aim = targets
        if not found.within.all():
            aim = np.where(found.within[:, None], asked, robot.wrench(found.force)) + self.compiled.beside
        return aim, found

    @property
    def undriven(self) -> tuple[str, ...]:
        """See `Method`."""
        size = np.abs(self.compiled.robot.effectiveness).max(axis=0)
        return tuple(axis for axis, most in zip(AXES, size, strict=True) if most <= NOTHING * size.max())

    def _bound(self, aim: Array, found: Forces) -> Array:
        """Power (N,) [W] that no answer for wrenches (N, 6) undercuts."""
        return np.maximum(proved_power(self.compiled, aim, found.price), found.value)

    def _bound_again(self, targets: Array, policy: Policy) -> Array:
        """The same of many targets (N, 6), whose prices are found again, so that nothing of them is kept."""
        return self._bound(*self._aimed(targets, policy))

    @property
    def _unproved(self) -> bool:
        """Whether the bound would be one of something else than the power of the answer: with what doubt
        costs, or of the smooth shape that stands for a measured table."""
        measured = any(fin.model.type == "table" for fin in self.layout.fins)
        return measured or self.compiled.doubt is not None

    def _forces(self, targets: Array, sets: Sets, policy: Policy, prices: Array | None = None) -> Forces:
        """Forces of least power for wrenches (N, 6), or for those that the policy gives in their place."""
        robot = self.compiled.robot
        target = robot.target(targets)
        if not len(target):  # nothing pushes, such as rudders at rest
            nothing = np.zeros((len(robot.effectiveness), len(targets)))
            return Forces(
                nothing,
                np.zeros((len(targets), 6)),
                np.asarray(~targets.any(axis=1)),
                target,
                np.zeros(len(targets)),
            )
        root = solve(robot, target, sets, prices)
        within = root.solved.copy()
        if robot.basis.shape[1] < 6:
            rest = targets / robot.scale - (robot.basis @ target).T
            within &= np.linalg.norm(rest, axis=1) <= NEARLY * (
                1e-3 + np.linalg.norm(targets / robot.scale, axis=1)
            )
        force, prices, value = root.force, root.prices, np.zeros(len(targets))
        if may_have_gaps(robot, sets, force):
            force, value = self._in_gaps(target, sets, root, within)
        if not within.all():
            force, prices = force.copy(), prices.copy()
            for row in np.flatnonzero(~within):
                near = nearest(robot, sets.take(np.array([row])), targets[row], policy, self.scale)
                force[:, row], prices[:, row] = near.force, near.prices
        return Forces(force, robot.price(prices), within, prices, value)

    def _in_gaps(
        self, target: Array, sets: Sets, root: Prices, within: NDArray[np.bool_]
    ) -> tuple[Array, Array]:
        """Forces (k, N) in sets with gaps, and the power (N,) [W] that is proved to be needed there; `within`
        loses the targets that they do not meet."""
        robot = self.compiled.robot
        rows = np.flatnonzero(within & (gaps(robot, root.force, sets) > 0.0).any(axis=0))
        if not len(rows):
            return root.force, np.broadcast_to(0.0, len(within))
        value = np.zeros(len(within))
        cut = least_power(robot, target[:, rows], sets.take(rows), root.take(rows))
        force = root.force.copy()
        force[:, rows] = cut.force
        within[rows[~cut.found]] = False
        value[rows] = np.where(cut.found, cut.value * (1.0 - FINE), 0.0)
        return force, value

    def _commands(self, aim: Array, found: Forces, previous: Array | None = None) -> Array:
        """Commands (N, n, 3) that give wrenches (N, 6) exactly, by the plant."""
        command = self.compiled.commands(found.force, previous)
        error = self._error(command, aim)
        rough = np.flatnonzero(error > EXACT)
        if len(rough):
            asked = aim[rough] / self.scale
            command[rough] = refine(self._problem, asked, command[rough], ROUNDS, EXACT).command
        return command

    def _error(self, command: Array, aim: Array) -> Array:
        given = wrench_of_forces(self.plant.force(command), self.plant.effectiveness)
        missing = (given - aim) / self.scale
        error: Array = np.sqrt(np.einsum("ni,ni->n", missing, missing))
        return error

    def _in_a_tick(self, aim: Array, found: Forces, previous: Array) -> Array:
        """The command (1, n, 3) that gives a wrench (1, 6) or comes nearest to it among those that may follow
        a previous one (n, 3); `found` is the answer without limits of that kind."""
        box = self._rates.box(previous)
        sets, asked = self.compiled.within(box.lower, box.upper), aim - self.compiled.beside
        problem = replace(
            self._problem, lower=box.lower, upper=box.upper, full_turn=box.free[:, 2] & self.plant.full_turn
        )

        force = within_tick(self.compiled.robot, sets, asked, found.prices, 1.0 / self.scale)
        command = self.plant.feasible(box.clipped(self.compiled.commands(force, previous)))
        if self._error(command, aim)[0] > EXACT:
            command = refine(problem, aim / self.scale, box.clipped(command), TICK_STEPS, EXACT).command
            command = self.plant.feasible(box.clipped(command))
        return command
