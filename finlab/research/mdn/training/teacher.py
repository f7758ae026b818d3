"""The teacher: descents from many random forces, the local minima of the effort that they find for
each target, and their files.

In files and batches, `way` has the forces of the minima as roots of shares of the largest ones
(`root_share`), complex in files, in two real parts in batches.
"""

import io
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from finlab.arrays import AnyArray, Array
from finlab.errors import DataError
from finlab.physics.objective import wrench_scale_of
from finlab.physics.plant import Plant
from finlab.research.mdn.answers import DUPLICATE_SCORE, EffortRobot, distinct, effort_robot
from finlab.research.mdn.descent import EffortProblem, descend, realize, wrench
from finlab.research.mdn.features import VECTORS, features
from finlab.research.random_layouts import FIN_COUNTS, random_fin_kinds, random_fin_robot
from finlab.whole_file import write_whole

STARTS = 32
"""Random forces from which each target is tried."""
STEPS = 35
"""Quadratic problems solved from every start."""
MINIMA_MAX = 8
"""Most local minima that are kept for a target."""
DISTINCT = 0.08
"""Mean difference over the fins, in roots of shares, from which two answers are two minima."""
COST_RATIO_MAX = 1.2
"""Cost over the cheapest one's up to which a minimum is kept."""
RESIDUAL_MAX = 0.01
"""Largest residual beside the target or, for small ones, a hundredth of what all fins can give."""


@dataclass(frozen=True)
class AnswerSettings:
    """What the teacher answers: files of random targets on random robots."""

    files: int = 48
    """Files, the first of which is held out."""
    fins: int = 18
    """Random fins per file with nominal limits, and as many with limits of their own."""
    robots: int = 240
    """Robots per file that are made of them."""
    targets: int = 48
    """Targets for each robot."""
    sharpness: float = 0.03
    """By how much dearer a minimum may be, as a share of the cost, for its weight to fall to a
    third."""


class Minima(NamedTuple):
    """Up to L local minima of the effort for each of N targets with n fins, cheapest first."""

    force: AnyArray
    """Planar forces (N, L, n) [N], complex."""
    cost: Array
    """Their costs (N, L); infinite where there are no more minima."""


def local_minima(rng: np.random.Generator, problem: EffortProblem, target: Array) -> Minima:
    """Returns what descents from `STARTS` random forces find for each target.

    Args:
        rng: source of the random forces.
        problem: the robot.
        target: normalized targets (N, 6).
    """
    rows = len(target)
    maximum = problem.fins.maximum
    n = len(maximum)
    # A start's small forces are as good as at rest, so few or many fins work.
    size = rng.random((rows * STARTS, n)) ** rng.uniform(1.0, 8.0, (rows * STARTS, 1)) * maximum
    start = size * np.exp(1j * rng.uniform(-np.pi, np.pi, size.shape))
    targets = np.repeat(target, STARTS, axis=0)
    *_, end = descend(problem, targets, start, STEPS)
    _, cost = realize(problem, end)
    strength = np.linalg.norm(np.repeat(maximum, 2)[:, None] * problem.effectiveness)
    allowed = RESIDUAL_MAX * np.minimum(np.linalg.norm(targets, axis=1) + 1e-2 * strength, strength)
    residual = np.linalg.norm(targets - wrench(problem, end.force), axis=1)
    cost = np.where(residual <= allowed, cost, np.inf).reshape(rows, STARTS)
    force = end.force.reshape(rows, STARTS, n)
    cost = np.where(cost > COST_RATIO_MAX * cost.min(1, keepdims=True), np.inf, cost)
    chosen, rank = distinct(cost, root_share(force, maximum), MINIMA_MAX, DISTINCT)
    return Minima(
        force[np.arange(rows)[:, None], chosen], np.where(rank < DUPLICATE_SCORE, rank, np.inf)
    )


def root_share(force: AnyArray, largest: Array) -> AnyArray:
    """Forces (..., n), complex, as roots of shares of the largest ones (n,): small ones count,
    too."""
    share = force / largest
    return np.asarray(share / np.sqrt(np.abs(share) + 1e-12))


def minimum_weights(minima: Minima, sharpness: float) -> Array:
    """Weights (N, L) of the minima, zero where there are none: exp(-(cost - best) / (sharpness
    best))."""
    best = minima.cost[:, :1]
    with np.errstate(invalid="ignore"):
        weight = np.exp(-(minima.cost / np.maximum(best, 1e-12) - 1.0) / sharpness)
    weight = np.where(np.isfinite(minima.cost), weight, 0.0)
    return np.asarray(weight / np.maximum(weight.sum(1, keepdims=True), 1e-12))


DATA_SEED = 130_000
"""Leads the seed of every file; no evaluation's seed begins like this."""
WEIGHT_MIN = 1e-3
"""Weight below which a minimum is not learned from."""
IDENTITY_COLUMNS = slice(17, 19)
"""Where among the static features the numbers are that tell equal fins apart."""
MIRRORED_COLUMNS = [column + 1 for column in VECTORS]
"""Vertical parts of the vectors among the static features."""


def write_answers(folder: Path, settings: AnswerSettings, seed: int, number: int) -> Path:
    """Make file `number` unless it is there; it depends on the seed and its number alone."""
    path = folder / f"answers-{number:04d}.npz"
    if path.exists():
        return path
    rng = np.random.default_rng([DATA_SEED, seed, number])
    kinds = random_fin_kinds(rng, settings.fins)
    counts = np.array(list(FIN_COUNTS))
    often = np.array(list(FIN_COUNTS.values()), float)
    groups: dict[int, list[dict[str, Array]]] = {}
    for _ in range(settings.robots):
        n = int(rng.choice(counts, p=often / often.sum()))
        layout = random_fin_robot(rng, kinds, n)
        robot = effort_robot(Plant(layout), wrench_scale_of(layout))
        groups.setdefault(n, []).append(_answers(rng, robot, settings))
    arrays = {
        f"{n}.{name}": np.stack([robot[name] for robot in robots])
        for n, robots in groups.items()
        for name in robots[0]
    }
    content = io.BytesIO()
    np.savez(content, allow_pickle=False, **arrays)
    write_whole(path, content.getvalue(), DataError)
    return path


def _answers(
    rng: np.random.Generator, robot: EffortRobot, settings: AnswerSettings
) -> dict[str, Array]:
    """One robot, its targets and their minima, as features."""
    target = random_targets(rng, robot, settings.targets)
    view = robot.view
    minima = local_minima(rng, robot.forces, target)
    return {
        "static": view.static.astype(np.float32),
        "blocks": view.blocks.astype(np.complex64),
        "asked": (target @ view.solver).astype(np.complex64),
        "way": root_share(minima.force, view.largest).astype(np.complex64),
        "weight": minimum_weights(minima, settings.sharpness).astype(np.float32),
    }


def read_answers(path: Path) -> dict[int, dict[str, Array]]:
    """The arrays of a file by number of fins; robots (R, ...), targets (R, T, ...), `way` (R, T,
    L, n) as roots of shares."""
    groups: dict[int, dict[str, Array]] = {}
    with np.load(path, allow_pickle=False) as file:
        for key in file.files:
            n, name = key.split(".")
            groups.setdefault(int(n), {})[name] = file[key]
    return groups


class TeacherBatch(NamedTuple):
    """B targets, each on a robot of n fins, with up to L minima of the effort."""

    nodes: Tensor
    """(B, n, 26)."""
    pairs: Tensor
    """(B, n, n, 4)."""
    way: Tensor
    """Forces as roots of shares, in the frames of the features (B, L, n, 2)."""
    weight: Tensor
    """Of the minima (B, L); they add up to 1."""


class TeacherData:
    """All robots, targets and minima of some files, in memory; batches are drawn from them."""

    def __init__(self, paths: list[Path]) -> None:
        parts: dict[int, list[dict[str, AnyArray]]] = {}
        for path in paths:
            for n, arrays in read_answers(path).items():
                parts.setdefault(n, []).append(arrays)
        self._groups: dict[int, dict[str, AnyArray]] = {}
        for n, some in parts.items():
            joined = {name: np.concatenate([part[name] for part in some]) for name in some[0]}
            robot, target = np.nonzero(joined["weight"].sum(-1) > 0.5)
            flat = {name: joined[name][robot, target] for name in ("asked", "way", "weight")}
            self._groups[n] = {**joined, **flat, "robot": robot}

    def __len__(self) -> int:
        """Number of targets."""
        return sum(len(group["asked"]) for group in self._groups.values())

    def draw(self, rng: np.random.Generator, size: int) -> TeacherBatch:
        """A random batch; robots are seen as they are or as their mirror image, with fins in any
        order."""
        counts = np.array([len(group["asked"]) for group in self._groups.values()])
        n = list(self._groups)[int(rng.choice(len(counts), p=counts / counts.sum()))]
        group = self._groups[n]
        row = rng.integers(len(group["asked"]), size=size)
        robot = group["robot"][row]
        static = group["static"][robot]
        a, b = np.moveaxis(group["blocks"][robot], 1, 0)
        p = group["asked"][row]
        way = group["way"][row]
        weight = group["weight"][row]
        order = rng.random((size, n)).argsort(axis=1)
        identity = static[..., IDENTITY_COLUMNS]
        static[..., IDENTITY_COLUMNS] = np.take_along_axis(identity, order[..., None], axis=1)
        mirrored = rng.random(size) < 0.5
        a = _mirrored(a, mirrored)
        b = _mirrored(b, mirrored)
        p = _mirrored(p, mirrored)
        way = _mirrored(way, mirrored)
        sign = np.where(mirrored, -1.0, 1.0)[:, None, None].astype(np.float32)
        static[:, :, MIRRORED_COLUMNS] *= sign
        inputs = features(p, static, a, b)
        way = way * inputs.frame.conj()[:, None]
        parts = np.stack([way.real, way.imag], axis=-1)
        weight = np.where(weight < WEIGHT_MIN, 0.0, weight)
        arrays = (inputs.nodes, inputs.pairs, parts, weight / weight.sum(1, keepdims=True))
        return TeacherBatch(
            *(torch.from_numpy(np.asarray(part, dtype=np.float32)) for part in arrays)
        )


def _mirrored(values: AnyArray, rows: AnyArray) -> AnyArray:
    """Complex values (B, ...), conjugate where `rows` (B,) is true."""
    return np.where(rows.reshape(-1, *(1,) * (values.ndim - 1)), values.conj(), values)


def random_targets(rng: np.random.Generator, robot: EffortRobot, count: int) -> Array:
    """Normalized targets (count, 6): half are wrenches of uniform commands, a quarter of commands
    where some fins rest, a quarter one to three axes together, as far as no fin gives more than its
    largest force."""
    plant = robot.plant
    quarter = count // 4
    command = plant.sample(rng, (count - quarter,))
    rests = rng.random((quarter, plant.n_fins)) > rng.uniform(0.3, 1.0, (quarter, 1))
    command[:quarter, :, :2] = np.where(
        rests[..., None], plant.lower[:, :2], command[:quarter, :, :2]
    )
    full = robot.forces.effectiveness * np.repeat(robot.view.largest, 2)[:, None]
    axes = rng.random((quarter, 6)).argsort(axis=1) < rng.integers(1, 4, (quarter, 1))
    wanted = axes * rng.choice([-1.0, 1.0], (quarter, 6)) * rng.uniform(0.2, 1.0, (quarter, 6))
    share = wanted @ np.linalg.pinv(full.T @ full, rcond=1e-6) @ full.T
    largest = np.hypot(share[:, 0::2], share[:, 1::2]).max(1, keepdims=True)
    share *= rng.uniform(0.03, 0.9, (quarter, 1)) / np.maximum(largest, 1e-9)
    return np.concatenate([robot.commands.wrench(command), share @ full])
