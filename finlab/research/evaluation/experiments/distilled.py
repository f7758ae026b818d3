"""Policies for all robots that were distilled from `dual`: what they miss, what they take, and how
long an answer is that begins at what they propose.

Robots and fins are none that were learned from. Times of a robot are of one run, in which all ways
take turns, each the least of several.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from finlab.allocation import Allocator
from finlab.arrays import Array
from finlab.interaction.jets import Jets
from finlab.layout import load_layout
from finlab.physics.objective import wrench_scale_of
from finlab.physics.plant import Plant, plant_of
from finlab.research.distilled.exact_answers import ExactAnswers, robots_with_answers
from finlab.research.distilled.force_policy import ForcePolicy
from finlab.research.distilled.starts import FittedStart, HeadStart, NearestStart, Start
from finlab.research.distilled.trained_policy import NetworkName, TrainedPolicy, read_policy
from finlab.research.evaluation.document import Column, Row
from finlab.research.evaluation.experiment import Experiment, check_names, progress

POLICIES = ("dual", "nearest", "fitted", "head", "forces", "exact", "exact_1", "exact_10")
"""Where an answer begins: at `dual`'s own multipliers; at those of the nearest stored answer, of a
fit to stored answers, or of the head that a network makes; at a network's forces; at the exact
multipliers, for nothing, or at these with an error of 1 % and 10 %."""
NETWORKS: dict[str, NetworkName] = {"head": "head", "forces": "forces"}
"""Policy -> the network that it needs."""
ERRORS = {"exact": 0.0, "exact_1": 0.01, "exact_10": 0.1}
"""Policy -> relative error of the exact multipliers, a standard deviation for each of them."""
STORED = 64
"""Answers of a robot that `nearest` and `fitted` know."""
STEPS = (0, 1, 2)
"""Of Newton's method, after which errors are read."""
MOST_STEPS = 200
"""Of Newton's method to its end."""
CLOSE = 1e-6
"""Error of the wrench that counts as met."""
PASSES = 5
"""Of which the least time counts."""
FORCE_WRENCHES = 256
"""Wrenches of a robot by which the network of forces is judged and timed."""
JET_ROBOTS = ("bluerov2_heavy", "A")
"""Robots whose answers are timed with and without jets."""


JET_WRENCHES = 64
"""Wrenches of each of them."""


class Judged(NamedTuple):
    """What one policy does on one robot with N wrenches."""

    error: Array
    """Error of the wrench (3, N) after `STEPS`, by the plant, over the wrench scale."""
    residual: Array
    """The same of the forces, by the dual."""
    steps: Array
    """Of Newton's method to its end (N,)."""
    excess: Array
    """Power over the least of what is delivered at last, less 1 (N,)."""
    time: float
    """Time of an answer over that of `dual`."""
    proposing: float
    """Of that, what the policy itself takes."""


def run(
    policies: tuple[str, ...] = POLICIES,
    robots: int = 8,
    wrenches: int = 4096,
    folder: str | None = None,
    preset: str = "default",
    seed: int = 0,
) -> list[Row]:
    """One row for each policy and each group of robots: whole, with losses, with jets.

    Args:
        policies: some of dual, nearest, fitted, head, forces, exact, exact_1, exact_10.
        robots: random ones of thrusters, pods and fins.
        wrenches: of a batch.
        folder: of networks that `finlab train policy` has written; without it they are trained
            first.
        preset: recipe of that training: default, long or smoke.
        seed: of robots and wrenches, and of the training.
    """
    check_names("policies", policies, POLICIES)
    networks = _networks(policies, folder, preset, seed)
    judged: dict[tuple[str, str], list[Judged]] = {}
    drawn = robots_with_answers("judging", robots, wrenches + STORED, seed)
    for answers in progress(drawn, "robot", "distilled"):
        group = "whole" if answers.robot.conditions.lost is None else "lost"
        for policy, result in _judge_robot(answers, policies, networks, seed).items():
            judged.setdefault((group, policy), []).append(result)
    rows = [
        {"group": group, "policy": policy} | _figures(judged[group, policy])
        for group in ("whole", "lost")
        for policy in policies
        if (group, policy) in judged
    ]
    if "exact" in policies:
        rows.append(_row_of_jets(JET_WRENCHES))
    return rows


def _networks(
    policies: Sequence[str], folder: str | None, preset: str, seed: int
) -> dict[str, TrainedPolicy]:
    """The networks of policies, read or trained."""
    needed = {policy: NETWORKS[policy] for policy in policies if policy in NETWORKS}
    if folder is not None or not needed:
        return {key: read_policy(Path(str(folder)), name) for key, name in needed.items()}
    from finlab.research.distilled.train import train_policy

    with TemporaryDirectory() as made:
        for name in needed.values():
            train_policy(Path(made), name, preset, seed)
        return {key: read_policy(Path(made), name) for key, name in needed.items()}


def _judge_robot(
    answers: ExactAnswers, policies: Sequence[str], networks: dict[str, TrainedPolicy], seed: int
) -> dict[str, Judged]:
    """What policies do on one robot. Its first answers are those that may be stored."""
    stored = _rows(answers, slice(STORED))
    tested = _rows(answers, slice(STORED, None))
    robot = answers.robot
    core = robot.compiled.core
    plant = plant_of(robot.layout)
    proposals: dict[str, Callable[[Array], Array | None]] = {"dual": lambda wrench: None}
    rng = np.random.default_rng(seed)
    for policy in policies:
        if policy in ERRORS:
            noise = 1.0 + ERRORS[policy] * rng.normal(size=tested.multipliers.shape)
            proposals[policy] = _same(tested.multipliers * noise)
        elif policy not in ("dual", "forces"):
            proposals[policy] = _start(policy, stored, networks).multipliers

    def answer(policy: str) -> Array:
        first = proposals[policy](tested.wrench)
        return core.answer_many(tested.wrench, None, robot.conditions, first).command

    times = _least_times(proposals, answer)
    proposing = _least_times(proposals, lambda policy: proposals[policy](tested.wrench))
    judged = {}
    for policy, propose in proposals.items():
        error, residual = _errors(tested, plant, propose(tested.wrench))
        points = core.dual_points(
            tested.wrench, propose(tested.wrench), MOST_STEPS, robot.conditions
        )
        judged[policy] = Judged(
            error=error,
            residual=residual,
            steps=points.steps.astype(np.float64),
            excess=_excess(tested, plant, answer(policy)),
            time=times[policy] / times["dual"],
            proposing=proposing[policy] / times["dual"],
        )
    if "forces" in policies:
        per_answer = times["dual"] / len(tested.wrench)
        policy_of_forces = ForcePolicy(robot, networks["forces"], plant)
        judged["forces"] = _judge_forces(policy_of_forces, tested, plant, per_answer)
    return {policy: judged[policy] for policy in policies}


def _judge_forces(
    policy: ForcePolicy, tested: ExactAnswers, plant: Plant, dual_time: float
) -> Judged:
    """What a network of forces does; `dual_time` is that of an answer of `dual` [s]."""
    few = _rows(tested, slice(FORCE_WRENCHES))
    count = len(few.wrench)
    refined = [policy.commands(few.wrench, steps) for steps in STEPS]
    times = _least_times(
        {"whole": 0, "proposing": 0},
        lambda part: (
            policy.commands(few.wrench, STEPS[-1]) if part == "whole" else policy.forces(few.wrench)
        ),
    )
    error = np.array([each.error for each in refined])
    return Judged(
        error=error,
        residual=error,
        steps=np.full(count, np.nan),
        excess=_excess(few, plant, refined[-1].command),
        time=times["whole"] / count / dual_time,
        proposing=times["proposing"] / count / dual_time,
    )


def _start(policy: str, stored: ExactAnswers, networks: dict[str, TrainedPolicy]) -> Start:
    """What gives the multipliers of a policy."""
    if policy == "nearest":
        return NearestStart(stored)
    if policy == "fitted":
        return FittedStart(stored)
    return HeadStart(stored.robot, networks[policy])


def _same(multipliers: Array) -> Callable[[Array], Array]:
    """A proposal that is always the same."""
    return lambda wrench: multipliers


def _rows(answers: ExactAnswers, rows: slice) -> ExactAnswers:
    """Some wrenches of a robot."""
    return ExactAnswers(answers.robot, *(part[rows] for part in answers[1:]))


def _least_times(
    ways: dict[str, Any], do: Callable[[str], object], passes: int = PASSES
) -> dict[str, float]:
    """Least times [s] of the thread that each way takes; the ways take turns."""
    least = dict.fromkeys(ways, np.inf)
    for _ in range(passes):
        for way in ways:
            begin = time.thread_time()
            do(way)
            least[way] = min(least[way], time.thread_time() - begin)
    return least


def _errors(tested: ExactAnswers, plant: Plant, first: Array | None) -> tuple[Array, Array]:
    """Errors of the wrench (3, N) after `STEPS`, over the wrench scale: of commands, by the plant,
    and of the forces, by the dual."""
    robot = tested.robot
    scale = wrench_scale_of(plant.layout)
    by_plant = []
    by_dual = []
    for steps in STEPS:
        points = robot.compiled.core.dual_points(tested.wrench, first, steps, robot.conditions)
        command = robot.compiled.core.commands(points.force)
        missed = (tested.wrench - _wrench(tested, plant, command)) / scale
        by_plant.append(np.linalg.norm(missed, axis=1))
        by_dual.append(np.linalg.norm(points.residual / scale, axis=1))
    return np.array(by_plant), np.array(by_dual)


def _wrench(tested: ExactAnswers, plant: Plant, command: Array) -> Array:
    """Wrenches (N, 6) [N, N m] of commands by the plant, without lost actuators."""
    works = tested.robot.works
    force = plant.force(command)[:, works]
    return np.asarray(np.einsum("tna,nak->tk", force, plant.effectiveness[works]))


def _excess(tested: ExactAnswers, plant: Plant, command: Array) -> Array:
    """Power of commands by the plant over the least, less 1 (N,)."""
    power = plant.power(command)[:, tested.robot.works].sum(axis=1)
    return np.asarray(power / np.maximum(tested.dual_value, 1e-12) - 1.0)


def _figures(judged: Sequence[Judged]) -> Row:
    """Figures of one policy over robots."""
    error = np.concatenate([each.error for each in judged], axis=1)
    residual = np.concatenate([each.residual for each in judged], axis=1)
    steps = np.concatenate([each.steps for each in judged])
    excess = np.concatenate([each.excess for each in judged])
    times = np.array([each.time for each in judged])
    proposing = np.array([each.proposing for each in judged])
    row: Row = {"robots": len(judged), "n": error.shape[1]}
    for k in STEPS:
        row[f"error_{k}"] = float(np.median(error[k]))
    row["error_2_p95"] = float(np.quantile(error[-1], 0.95))
    row["residual_2"] = float(np.median(residual[-1]))
    row["close_2"] = float((residual[-1] <= CLOSE).mean())
    row["steps"] = float(steps.mean())
    row["excess"] = float(np.mean(excess))
    row["time"] = float(np.exp(np.log(times).mean()))
    row["time_least"] = float(times.min())
    row["proposing"] = float(np.median(proposing))
    return row


def _row_of_jets(wrenches: int) -> Row:
    """What is left of an answer's time with jets, if the first answer, by the laws alone, took
    none: no multipliers to begin with save more."""
    shares = []
    for name in JET_ROBOTS:
        layout = load_layout(name)
        plant = plant_of(layout)
        wrench = 0.5 * plant.wrench(plant.sample(np.random.default_rng(0), (wrenches,)))
        allocators = {
            "with": Allocator(replace(layout, interaction=Jets())),
            "without": Allocator(layout),
        }
        answer = partial(_answer_batch, allocators, wrench)
        times = _least_times(allocators, answer)
        shares.append(1.0 - times["without"] / times["with"])
    return {
        "group": "jets",
        "policy": "exact",
        "robots": len(shares),
        "n": wrenches * len(shares),
        "time": float(np.exp(np.log(shares).mean())),
        "time_least": float(min(shares)),
    }


def _answer_batch(allocators: dict[str, Allocator], wrench: Array, key: str) -> object:
    """The answers of one of some allocators."""
    return allocators[key].allocate_batch(wrench)


experiment = Experiment(
    name="distilled",
    question="Is an answer quicker that begins at what a policy for all robots proposes, which was "
    "distilled from `dual`?",
    columns=(
        Column("group", "robots", "code"),
        Column("policy", "begun at", "code"),
        Column("robots", "number", "count"),
        Column("n", "wrenches", "count"),
        Column("error_0", "error", "error"),
        Column("error_1", "after a step", "error"),
        Column("error_2", "after two", "error"),
        Column("error_2_p95", "95th percentile", "error"),
        Column("residual_2", "of the forces", "error"),
        Column("close_2", "within 1e-6", "share"),
        Column("steps", "steps to the end", "three"),
        Column("excess", "excess power at the end", "error"),
        Column("time", "time over `dual`", "ratio"),
        Column("time_least", "best robot", "ratio"),
        Column("proposing", "of that the policy", "ratio"),
    ),
    run=run,
    note=(
        "Errors are over the wrench scale, medians but where it says otherwise: of commands, by "
        "the plant, and of the forces, by the dual, whose share within 1e-6 after two steps "
        "follows. Steps are those of Newton's method on multipliers; of `forces` they are those of "
        "Levenberg and Marquardt on commands, by the laws. `exact`: the exact multipliers, which "
        "cost nothing here; `exact_1`, `exact_10`: these with an error of 1 % and 10 %. Time over "
        "`dual`: of batches, the geometric mean over robots. With jets: what is left of the time "
        "if the answer by the laws alone, with which an answer with jets begins, took none."
    ),
    quick={"robots": 3, "wrenches": 256, "preset": "smoke"},
    pieces=("policies",),
    measures=(
        "finlab/allocation/dual",
        "finlab/core/src",
        "finlab/research/distilled",
        "finlab/research/random_layouts.py",
        "finlab/research/evaluation/experiments/distilled.py",
    ),
    full={"robots": 40},
)
