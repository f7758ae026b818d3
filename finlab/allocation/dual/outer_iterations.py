"""Answers where actuators act on each other: outer iterations on the dual of the model made linear
at the last forces.

With y the forces and o(y) the wrench offset that they cause (Eq. 18), an iteration takes o(y) for
its value and slope at the last forces. Its answer is exact and cheapest on that linear model;
Levenberg-Marquardt steps make it exact on the whole one, and shorter steps are taken where it is
no cheaper. Where the iterations converge, the gradient of the power lies in the range of the slope
of the whole model: the conditions of Karush, Kuhn and Tucker hold there (sequential convex
programming). The iterations themselves are in finlab/core/src/outer_iterations.c. Here is where
they begin: the whole model is not convex, so several starts are tried.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.compiled import Compiled, core_policy
from finlab.allocation.levenberg_marquardt import CommandProblem, exact_commands, refine
from finlab.allocation.policy import Policy
from finlab.arrays import CLOSE, NEARLY, ROUNDS, Array
from finlab.core.calls import Conditions, CoreAnswer
from finlab.core.coupled_core import CoupledCore, OuterResult, WrenchOffset
from finlab.physics.plant import Plant

JET_ROTATION = 0.38
"""Angle [rad] by which jets are rotated where an answer begins anew: the half width of a jet."""
ITERATIONS_IN_TICK = 2
"""Outer iterations of a tick; the next tick goes on from there."""
RANDOM_STARTS = 3
"""Starts whose forces are rotated, and changed in size, at random."""
REVERSED_FOLLOWED = 2
"""How many starts are followed, the cheapest first, of those with one force reversed."""
ROTATED_FOLLOWED = 1
"""How many starts are followed, the cheapest first, of those with rotated forces."""
MAX_WORK = 400_000
"""Steps times actuators after which no other iteration is begun: about a tenth of a second."""
CHEAPER = 10.0 * CLOSE
"""Share of the power by which an answer has to be cheaper for others like it to be tried."""

_PAIR = np.array([[1.0, 1.0], [1.0, -1.0]])
"""Signs of two: the same, and opposite."""
WALSH = np.kron(_PAIR, np.kron(_PAIR, _PAIR))
"""Signs (8, 8) of the patterns of Walsh, one pattern in each column."""


def coupled_core(plant: Plant, compiled: Compiled) -> CoupledCore:
    """Returns a robot in the core, with what its actuators do to each other.

    Args:
        plant: of a layout with an interaction, in its flow.
        compiled: the same robot by its laws alone.

    Returns:
        What runs outer iterations for it.
    """
    interaction = plant.interaction
    assert interaction is not None
    return CoupledCore(
        compiled.block,
        WrenchOffset(
            frames=compiled.axes @ plant.layout.frames,
            counts=plant.counts,
            inflow=plant.met_by_all(None),
            core_constants=interaction.core_constants,
            effect=interaction.effect,
        ),
    )


def outer_answers(
    coupled: CoupledCore,
    compiled: Compiled,
    problem: CommandProblem,
    targets: Array,
    policy: Policy,
    conditions: Conditions,
    multipliers: Array | None,
) -> CoreAnswer:
    """Answers targets, one after the other, by outer iterations.

    Args:
        coupled: the robot in the core, with what its actuators do to each other.
        compiled: the same by its laws alone.
        problem: of steps on its commands, under the conditions.
        targets: desired wrenches (N, 6) [N, N m], at least one.
        policy: what to give out of reach.
        conditions: what holds of the robot.
        multipliers: lambda (6,) [W/N, W/(N m)] at which Newton's method begins; None for its own.

    Returns:
        Answers of the last iterations, with commands that are exact by the laws. A target is
        attainable where its command gives it; nothing is proved of gaps.
    """
    answers = [
        _outer_answer(coupled, compiled, problem, target, policy, conditions, multipliers)
        for target in targets
    ]
    return CoreAnswer(
        force=np.concatenate([answer.force for answer in answers]),
        multipliers=np.concatenate([answer.multipliers for answer in answers]),
        wrench_served=np.concatenate([answer.wrench_served for answer in answers]),
        gap_power_bound=np.zeros(len(targets)),
        is_attainable=np.concatenate([answer.is_attainable for answer in answers]),
        command=np.concatenate([answer.command for answer in answers]),
        error=np.concatenate([answer.error for answer in answers]),
        is_truncated=any(answer.is_truncated for answer in answers),
    )


def _outer_answer(
    coupled: CoupledCore,
    compiled: Compiled,
    problem: CommandProblem,
    target: Array,
    policy: Policy,
    conditions: Conditions,
    multipliers: Array | None,
) -> CoreAnswer:
    """The answer to one target (6,); arguments as of `outer_answers`."""
    answer = _best_of_starts(
        coupled, compiled, problem, target, policy, conditions, multipliers
    ).answer
    assert answer is not None  # all starts that are kept were followed by iterations
    command = exact_commands(problem, answer)
    wrench_served = answer.wrench_served
    if policy.kind == "direction" and not answer.is_attainable.all():
        command, wrench_served = _on_the_ray(problem, target[None], command)
    error = problem.error(command, target[None] / problem.error_scale)
    return answer._replace(
        command=command, wrench_served=wrench_served, is_attainable=error <= NEARLY
    )


def _best_of_starts(
    coupled: CoupledCore,
    compiled: Compiled,
    problem: CommandProblem,
    target: Array,
    policy: Policy,
    conditions: Conditions,
    multipliers: Array | None,
) -> OuterResult:
    """What outer iterations come to for one target (6,): in a tick from the command before, else
    from the forces by the laws alone and, where the whole model takes more power, from others."""
    record = core_policy(policy)
    if conditions.previous is not None:
        return coupled.iterate(target, None, ITERATIONS_IN_TICK, record, multipliers, conditions)
    by_laws = compiled.core.answer_one(target, record, multipliers, conditions)
    force_by_laws = by_laws.force[0]
    multipliers_by_laws = by_laws.multipliers[0]
    steps_left = MAX_WORK / len(force_by_laws)
    best = coupled.iterate(
        target,
        force_by_laws,
        ROUNDS,
        record,
        multipliers_by_laws,
        conditions,
        most_steps=steps_left,
    )
    steps_left -= best.steps

    def follow_cheapest(starts: Array, followed: int) -> bool:
        """Follows the cheapest of some starts (K, n, 2), and keeps what comes out better; returns
        whether that is cheaper."""
        nonlocal best, steps_left
        power_before = best.power
        # Without an iteration: the nearest forces that give the target, with what they cost.
        tried = [
            coupled.iterate(target, start, 0, conditions=conditions, penalty_least=best.penalty)
            for start in starts
        ]
        merits = [one.power + one.penalty * one.error for one in tried]
        for k in np.argsort(merits)[:followed]:
            if steps_left <= 0:
                break
            other = coupled.iterate(
                target,
                tried[k].force,
                ROUNDS,
                record,
                multipliers_by_laws,
                conditions,
                most_steps=steps_left,
            )
            steps_left -= other.steps
            best = other if _is_better(other, best) else best
        return best.power < (1.0 - CHEAPER) * power_before

    works = slice(None) if conditions.lost is None else ~conditions.lost
    power_by_laws = float(problem.plant.power(by_laws.command)[:, works].sum())
    if best.power <= (1.0 + CHEAPER) * power_by_laws:
        return best
    one_reversed = 1.0 - 2.0 * np.eye(len(force_by_laws))[..., None]
    for _ in range(ROUNDS):
        is_cheaper = follow_cheapest(one_reversed * best.force, REVERSED_FOLLOWED)
        if not is_cheaper:
            break
    rotated = _rotated_starts(force_by_laws, compiled.is_line).all()
    follow_cheapest(rotated, ROTATED_FOLLOWED)
    return best


def _is_better(one: OuterResult, other: OuterResult) -> bool:
    """Whether one comes nearer to the target, or as near at less power."""
    nearer = other.error - one.error
    return nearer > NEARLY or (nearer >= -NEARLY and one.power < other.power)


def _on_the_ray(problem: CommandProblem, target: Array, command: Array) -> tuple[Array, Array]:
    """Finds the largest share of a target that steps on the commands come to (Eq. 14), by
    bisection.

    Args:
        problem: of steps on the commands, under the conditions of the question.
        target: desired wrench (1, 6) [N, N m].
        command: (1, n, 3) where the steps begin.

    Returns:
        The command (1, n, 3), and the wrench (1, 6) [N, N m] on the ray that it gives.
    """
    target_normalized = target / problem.error_scale
    along = float((problem.wrench(command) * target_normalized).sum())
    ray_share = along / max((target_normalized * target_normalized).sum(), 1e-300)
    low = 0.0
    high = min(max(ray_share * (1.0 + CLOSE), 0.0), 1.0)
    best = command
    for k in range(ROUNDS):
        tried = high if k == 0 else 0.5 * (low + high)
        refined = refine(problem, tried * target_normalized, best, ROUNDS, 0.1 * NEARLY)
        if refined.error[0] <= NEARLY:
            low = tried
            best = refined.command
        else:
            high = tried
        if high - low <= CLOSE * high:
            break
    if problem.box is not None:
        best = problem.box.clip_feasible(best, problem.plant)
    return best, low * target


class _RotatedStarts(NamedTuple):
    """Forces at which iterations begin anew, with those of planes rotated: a jet that meets a
    neighbour in a symmetric robot has no slope that would turn it aside, and which of two jets
    gives way is a choice between minima."""

    walsh: Array
    """(8, n, 2) [N], rotated one way or the other in the patterns of Walsh."""
    opposite: Array
    """(1, n, 2) [N], all rotated the other way than in the first pattern, which is one sign."""
    random: Array
    """(RANDOM_STARTS, n, 2) [N], rotated by random angles, and changed in size."""

    def all(self) -> Array:
        """All of them (12, n, 2) [N]."""
        return np.concatenate(self)


def _rotated_starts(force: Array, is_line: NDArray[np.bool_]) -> _RotatedStarts:
    """Makes starts of forces (n, 2) [N]; forces of lines (n,) are changed in size at random, since
    they cannot rotate."""
    planes = np.flatnonzero(~is_line)
    n = len(is_line)
    rng = np.random.default_rng(0)
    walsh_signs = WALSH[np.arange(len(planes)) % len(WALSH)].T
    random_turns = rng.normal(size=(len(planes), RANDOM_STARTS)).T
    turns = np.concatenate([walsh_signs, -walsh_signs[:1], random_turns])

    angle = np.zeros((len(turns), n))
    angle[:, planes] = JET_ROTATION * turns
    size = np.ones(angle.shape)
    size[-RANDOM_STARTS:] = rng.uniform(0.0, 2.0, (RANDOM_STARTS, n))
    size[:, is_line] = rng.uniform(0.0, 2.0, (len(size), is_line.sum()))

    cos = np.cos(angle)
    sin = np.sin(angle)
    x = cos * force[:, 0] - sin * force[:, 1]
    y = sin * force[:, 0] + cos * force[:, 1]
    starts = size[..., None] * np.stack([x, y], axis=-1)
    walsh, opposite, random = np.split(starts, [len(WALSH), len(WALSH) + 1])
    return _RotatedStarts(walsh, opposite, random)
