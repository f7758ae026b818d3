"""Answers where actuators act on each other, in turns: the dual of the model made linear at the last answer.

With y the forces and o(y) what the actuators do to each other, a turn takes o(y) for its value and slope at
the last forces. Its answer is exact and cheapest on that linear model; Levenberg-Marquardt steps make it
exact on the whole one, and shorter steps are taken where it is no cheaper. Where the turns settle, the
gradient of the power lies in the range of the slope of the whole model: the conditions of Karush, Kuhn and
Tucker hold there (sequential convex programming).
"""

from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.levenberg_marquardt import refine
from finlab.allocation.policy import Policy
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.physics.plant import Plant
from finlab.precision import CLOSE, NEARLY, ROUNDS

HALVINGS, SHORTER = 4, 0.3
"""Most times that a step is made shorter, and by how much."""
ASIDE = 0.38
"""Angle [rad] by which jets are turned aside where an answer begins anew."""
IN_A_TICK, RANDOM, FOLLOWED = 2, 3, 2
"""Turns of a tick; other beginnings at random, and how many of all are followed."""


_PAIR = np.array([[1.0, 1.0], [1.0, -1.0]])
WALSH = np.kron(_PAIR, np.kron(_PAIR, _PAIR))
"""Signs (8, 8) of the patterns of Walsh, one pattern in each column."""


class Linear(NamedTuple):
    """A model made linear at some forces."""

    beside: Array
    """Wrench (6,) [N, N m] that comes on top of what the forces give."""
    effectiveness: Array
    """Wrench (n, 3, 6) per newton along own axes."""


def linear_at(plant: Plant, force: Array) -> Linear:
    """Returns the model of a plant near forces (n, 3) [N] in own axes."""
    offset, effectiveness = plant.effect(force)
    change = effectiveness - plant.effectiveness
    return Linear(offset - np.einsum("na,naw->w", force, change), effectiveness)


class Settled(NamedTuple):
    """What turns end with."""

    command: Array
    """(1, n, 3)."""
    aim: Array
    """Wrench (1, 6) [N, N m] that it gives."""
    price: Array
    """(1, 6) [W/N, W/(N m)]."""
    power: float
    """[W]."""
    worth: float
    """What an error as large as the yardstick counts [W]."""
    error: float
    """Distance of the wrench from the target, on the yardstick."""

    def beats(self, other: "Settled") -> bool:
        """Whether it comes nearer to the target, or as near at less power."""
        nearer = other.error - self.error
        return nearer > NEARLY or (nearer >= -NEARLY and self.power < other.power)


def settled(
    dual: Any, targets: Array, policy: Policy, previous: Array | None, prices: Array | None
) -> Solution:
    """Returns the answers of method `dual` to targets (N, 6); arguments as for `Dual.solve`."""
    each = [Turns(dual, target[None], policy, previous).settled(prices) for target in targets]
    command, aim, price = (np.concatenate(parts) for parts in list(zip(*each, strict=True))[:3])
    missed = np.array([one.error > NEARLY for one in each])
    notes = dual.not_held(targets[missed])
    bound = None if dual.unproved else partial(dual.bound, aim, price, np.zeros(len(aim)))
    return Solution(command, bound, prices=price, notes=tuple(sorted(notes - {""})))


class Turns:
    """The turns for one target."""

    def __init__(self, dual: Any, target: Array, policy: Policy, previous: Array | None) -> None:
        """Takes a method `Dual` and a target (1, 6); the rest as for `Dual.solve`."""
        self.dual, self.target, self.policy, self.previous = dual, target, policy, previous

    def settled(self, prices: Array | None) -> Settled:
        """Returns the best answer that turns from the previous command, or from several beginnings, come
        to."""
        dual = self.dual
        if self.previous is not None:
            return self._from(self.previous[None], prices)
        laws = dual.forces(self.target, self.policy, dual.begin(prices))
        best = self._from(self._exact(laws.force), laws.price[0])
        if best.power > (1.0 + 10.0 * CLOSE) * self._power(laws.command):
            tried = self._exact(_turned_aside(laws.force[0], dual.compiled.robot.lines))
            merits = np.array([self._merit(one[None], best.worth) for one in tried])
            for k in np.argsort(merits)[:FOLLOWED]:
                other = self._from(tried[k : k + 1], laws.price[0])
                best = other if other.beats(best) else best
        return best

    def _from(self, command: Array, price: Array | None) -> Settled:
        dual, worth, merit, last = self.dual, 0.0, np.inf, None
        for _ in range(ROUNDS if self.previous is None else IN_A_TICK):
            force = dual.plant.force(command)
            linear = dual.linear(linear_at(dual.plant, force[0]))
            start = None if price is None else linear.begin(price)
            own = linear.forces(self.target, self.policy, start)
            price = own.price[0]
            # Twice what an error is worth at these prices: an exact penalty.
            worth = max(worth, 2.0 * float(np.linalg.norm(price * dual.scale)))
            before = self._merit(command, worth) if last is None else merit
            last = last or (linear, own)
            command, merit = self._shorter(command, force[0], own.force[0], before, worth)
            if merit < before:
                last = linear, own
            if before - merit <= 2.0 * CLOSE * before:
                break
        assert last is not None
        linear, own = last
        return self._ended(command, linear, own, worth)

    def _shorter(
        self, command: Array, force: Array, there: Array, merit: float, worth: float
    ) -> tuple[Array, float]:
        """A command on the way from forces (n, 3) to forces (n, 2) that has less merit, and that; the old
        ones where none is found."""
        here, size = self.dual.compiled.forces_along(force), 1.0
        for _ in range(HALVINGS):
            tried = self._exact((here + size * (there - here))[None])
            new = self._merit(tried, worth)
            if new < merit:
                return tried, new
            size *= SHORTER
        return command, merit

    def _ended(self, command: Array, linear: Any, own: Any, worth: float) -> Settled:
        dual, found, aim = self.dual, own._replace(command=command), own.aim
        command = linear.exact(found, self.previous)
        if self.policy.kind == "direction" and not found.within.all():
            command, aim = _on_the_ray(dual, self.target, command)
        return Settled(command, aim, found.price, self._power(command), worth, self._error(command))

    def _exact(self, force: Array) -> Array:
        """Commands (K, n, 3) near to forces (K, n, 2) that give the target, nearly."""
        command = self.dual.compiled.robot.core.commands(force, self.previous)
        wanted = self.target / self.dual.scale
        return np.asarray(refine(self.dual.problem, wanted, command, ROUNDS // 3, 0.1 * NEARLY).command)

    def _merit(self, command: Array, worth: float) -> float:
        return self._power(command) + worth * self._error(command)

    def _power(self, command: Array) -> float:
        return float(self.dual.plant.power(command).sum())

    def _error(self, command: Array) -> float:
        return float(self.dual.error(command, self.target)[0])


def _on_the_ray(dual: Any, target: Array, command: Array) -> tuple[Array, Array]:
    """The command (1, n, 3) near to another one that gives the largest share of a target (1, 6) that steps
    come to, and that wrench."""
    along = target / dual.scale
    share = float(
        (dual.plant.wrench(command) / dual.scale * along).sum() / max((along * along).sum(), 1e-300)
    )
    low, high, best = 0.0, min(max(share * (1.0 + CLOSE), 0.0), 1.0), command
    for k in range(ROUNDS):
        tried = high if k == 0 else 0.5 * (low + high)
        ends = refine(dual.problem, tried * along, best, ROUNDS, 0.1 * NEARLY)
        if ends.error[0] <= NEARLY:
            low, best = tried, ends.command
        else:
            high = tried
        if high - low <= CLOSE * high:
            break
    return best, low * target


def _turned_aside(force: Array, lines: NDArray[np.bool_]) -> Array:
    """Other forces (12, n, 2) to begin at than (n, 2): those of planes turned one way or the other, in the
    patterns of Walsh, then all of them turned and changed in size at random. A jet that meets a neighbour in
    a symmetric robot has no slope that would turn it aside, and which of two jets gives way is a choice
    between minima."""
    planes, rng = np.flatnonzero(~lines), np.random.default_rng(0)
    signs = WALSH[np.arange(len(planes)) % len(WALSH)]
    angle = np.zeros((len(WALSH) + 1 + RANDOM, len(lines)))
    own = np.concatenate([signs, -signs[:, :1], rng.normal(size=(len(planes), RANDOM))], axis=1)
    angle[:, planes] = ASIDE * own.T
    size = np.ones(angle.shape)
    size[len(WALSH) + 1 :] = rng.uniform(0.0, 2.0, (RANDOM, len(lines)))
    size[:, lines] = rng.uniform(0.0, 2.0, (len(size), lines.sum()))
    cos, sin = np.cos(angle), np.sin(angle)
    turned = np.stack([cos * force[:, 0] - sin * force[:, 1], sin * force[:, 0] + cos * force[:, 1]], axis=-1)
    return np.asarray(size[..., None] * turned)
