"""Answers where actuators act on each other, in turns: the dual of the model made linear at the
last answer.

With y the forces and o(y) what the actuators do to each other, a turn takes o(y) for its value and
slope at the last forces. Its answer is exact and cheapest on that linear model; Levenberg-Marquardt
steps make it exact on the whole one, and shorter steps are taken where it is no cheaper. Where the
turns settle, the gradient of the power lies in the range of the slope of the whole model: the
conditions of Karush, Kuhn and Tucker hold there (sequential convex programming). The turns
themselves are in finlab/core/src/sequential_convex.c.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.levenberg_marquardt import refine
from finlab.allocation.policy import Policy
from finlab.allocation.solution import Solution
from finlab.arrays import CLOSE, NEARLY, ROUNDS, Array
from finlab.core.calls import Found, Now
from finlab.core.whole import Beside, Ended, Whole
from finlab.interaction.jets import JetInteraction

ASIDE = 0.38
"""Angle [rad] by which jets are turned aside where an answer begins anew."""
IN_A_TICK, RANDOM = 2, 3
"""Turns of a tick; beginnings at random."""
BACK, FOLLOWED = 2, 1
"""How many beginnings are followed of those where one force is turned back, and of the others."""
WORK = 400_000
"""Steps times actuators after which no other turn is begun: about a tenth of a second."""


_PAIR = np.array([[1.0, 1.0], [1.0, -1.0]])
WALSH = np.kron(_PAIR, np.kron(_PAIR, _PAIR))
"""Signs (8, 8) of the patterns of Walsh, one pattern in each column."""


def whole_of(dual: Any) -> Whole:
    """Returns the robot of a method `Dual` in the core, with what its actuators do to each
    other."""
    plant = dual.plant
    robot = dual.compiled.robot
    known = plant.interaction
    inflow = plant.met_by_all(None)
    frames = robot.axes @ plant.layout.frames
    jets = known.table if isinstance(known, JetInteraction) else None
    return Whole(robot.block, Beside(frames, plant.counts, inflow, jets, known.effect))


def settled(dual: Any, targets: Array, policy: Policy, now: Now, prices: Array | None) -> Solution:
    """Returns the answers of method `dual` to targets (N, 6), with what may be given now; arguments
    as for `Dual.solve`."""
    parts: list[tuple[Array, Array, Array]] = []
    notes: set[str] = set()
    for target in targets:
        found = _settled(dual, target, policy, now, prices)
        command = dual.exact(found, now)
        served = found.wrench_served
        if policy.kind == "direction" and not found.is_attainable.all():
            command, served = _on_the_ray(dual, target[None], command, now)
        if dual.error(command, target[None], now)[0] > NEARLY:
            notes |= dual.not_held(target[None], now)
        parts.append((command, served, found.prices))
    command, served, price = map(np.concatenate, zip(*parts, strict=True))
    solution: Solution = dual.solution(command, served, price, np.zeros(len(served)), notes, now)
    return solution


def _settled(dual: Any, target: Array, policy: Policy, now: Now, prices: Array | None) -> Found:
    """What turns from the previous command, or from several beginnings, come to, for one target
    (6,)."""
    whole: Whole = dual.whole
    if now.previous is not None:
        return whole.settled(target, None, IN_A_TICK, policy, prices, now).found
    laws: Found = dual.forces(target[None], policy, prices, now)
    left = WORK / len(laws.force[0])
    best = whole.settled(
        target, laws.force[0], ROUNDS, policy, laws.prices[0], now, most_steps=left
    )
    left -= best.steps

    def better(starts: Array, followed: int) -> bool:
        """Whether some of other forces (K, n, 2) come to less; then the best is that."""
        nonlocal best, left
        before = best
        tried = [whole.settled(target, start, 0, now=now, worth=best.worth) for start in starts]
        merits = [one.power + one.worth * one.error for one in tried]
        for k in np.argsort(merits)[:followed]:
            if left <= 0:
                break
            force = tried[k].found.force[0]
            other = whole.settled(
                target, force, ROUNDS, policy, laws.prices[0], now, most_steps=left
            )
            left -= other.steps
            best = other if _beats(other, best) else best
        return best.power < (1.0 - 10.0 * CLOSE) * before.power

    works = slice(None) if now.lost is None else ~now.lost
    dearer = (1.0 + 10.0 * CLOSE) * float(dual.plant.power(laws.command)[:, works].sum())
    if best.power > dearer:
        back = 1.0 - 2.0 * np.eye(len(laws.force[0]))[..., None]
        lines = dual.compiled.robot.lines
        for _ in range(ROUNDS):
            if not better(back * best.found.force, BACK):
                break
        better(_turned_aside(laws.force[0], lines), FOLLOWED)
    return best.found


def _beats(one: Ended, other: Ended) -> bool:
    """Whether it comes nearer to the target, or as near at less power."""
    nearer = other.error - one.error
    return nearer > NEARLY or (nearer >= -NEARLY and one.power < other.power)


def _on_the_ray(dual: Any, target: Array, command: Array, now: Now) -> tuple[Array, Array]:
    """The command (1, n, 3) near to another one that gives the largest share of a target (1, 6)
    that steps come to, and that wrench."""
    along = target / dual.scale
    problem = dual.problem_now(now)
    share = float((problem.wrench(command) * along).sum() / max((along * along).sum(), 1e-300))
    low = 0.0
    high = min(max(share * (1.0 + CLOSE), 0.0), 1.0)
    best = command
    for k in range(ROUNDS):
        tried = high if k == 0 else 0.5 * (low + high)
        ends = refine(problem, tried * along, best, ROUNDS, 0.1 * NEARLY)
        if ends.error[0] <= NEARLY:
            low = tried
            best = ends.command
        else:
            high = tried
        if high - low <= CLOSE * high:
            break
    if now.previous is not None:
        best = dual.rates.box(now.previous).held(best, dual.plant)
    return best, low * target


def _turned_aside(force: Array, lines: NDArray[np.bool_]) -> Array:
    """Other forces (12, n, 2) to begin at than (n, 2): those of planes turned one way or the other,
    in the patterns of Walsh, then all of them turned and changed in size at random. A jet that
    meets a neighbour in a symmetric robot has no slope that would turn it aside, and which of two
    jets gives way is a choice between minima."""
    planes = np.flatnonzero(~lines)
    rng = np.random.default_rng(0)
    signs = WALSH[np.arange(len(planes)) % len(WALSH)]
    angle = np.zeros((len(WALSH) + 1 + RANDOM, len(lines)))
    own = np.concatenate([signs, -signs[:, :1], rng.normal(size=(len(planes), RANDOM))], axis=1)
    angle[:, planes] = ASIDE * own.T
    size = np.ones(angle.shape)
    size[len(WALSH) + 1 :] = rng.uniform(0.0, 2.0, (RANDOM, len(lines)))
    size[:, lines] = rng.uniform(0.0, 2.0, (len(size), lines.sum()))
    cos = np.cos(angle)
    sin = np.sin(angle)
    turned = np.stack(
        [cos * force[:, 0] - sin * force[:, 1], sin * force[:, 0] + cos * force[:, 1]], axis=-1
    )
    return np.asarray(size[..., None] * turned)
