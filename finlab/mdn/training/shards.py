"""What the teacher has answered, in files: each of them depends on the seed and its number alone."""

import io
from pathlib import Path

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.mdn.features import robot_view
from finlab.mdn.training.random_robots import FIN_COUNTS, FinPool, random_robot, random_targets
from finlab.mdn.training.recipes import AnswerSettings
from finlab.mdn.training.teacher import root_share, shares_of_ways, ways_to_deliver
from finlab.whole_file import write_whole

DATA_SEED = 130_000
"""Leads the seed of every shard; no evaluation's seed begins like this."""


def write_shard(folder: Path, settings: AnswerSettings, scale: Array, seed: int, number: int) -> Path:
    """Make shard `number` unless it is there; `scale` (6,) is what wrenches are divided by."""
    path = folder / f"answers-{number:04d}.npz"
    if path.exists():
        return path
    rng = np.random.default_rng([DATA_SEED, seed, number])
    pool = FinPool(rng, settings.fins)
    counts, often = np.array(list(FIN_COUNTS)), np.array(list(FIN_COUNTS.values()), float)
    groups: dict[int, list[dict[str, Array]]] = {}
    for _ in range(settings.robots):
        n = int(rng.choice(counts, p=often / often.sum()))
        groups.setdefault(n, []).append(_answers(rng, pool, n, settings, scale))
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
    rng: np.random.Generator, pool: FinPool, n: int, settings: AnswerSettings, scale: Array
) -> dict[str, Array]:
    """One robot, its targets and the ways to deliver them, as the network sees them."""
    robot = random_robot(rng, pool, n, scale)
    target = random_targets(rng, robot, settings.targets)
    ways = ways_to_deliver(rng, robot, target)
    view = robot_view(robot.problem)
    return {
        "static": view.static.astype(np.float32),
        "blocks": view.blocks.astype(np.complex64),
        "asked": (target @ view.solver).astype(np.complex64),
        "way": root_share(ways.force, view.largest).astype(np.complex64),
        "weight": shares_of_ways(ways, settings.sharpness).astype(np.float32),
    }


def read_shard(path: Path) -> dict[int, dict[str, Array]]:
    """The arrays of a shard by number of fins; robots (R, ...), targets (R, T, ...), ways (R, T, L, n)."""
    groups: dict[int, dict[str, Array]] = {}
    with np.load(path, allow_pickle=False) as file:
        for key in file.files:
            n, name = key.split(".")
            groups.setdefault(int(n), {})[name] = file[key]
    return groups
