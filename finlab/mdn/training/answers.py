"""What the teacher has answered, in files, and batches of it: each of one number of fins, without padding."""

import io
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from finlab.allocation.yardstick import yardstick
from finlab.arrays import AnyArray, Array
from finlab.errors import DataError
from finlab.mdn.features import VECTORS, features
from finlab.mdn.robot import EffortRobot, effort_robot
from finlab.mdn.training.random_robots import FIN_COUNTS, random_kinds, random_robot, random_targets
from finlab.mdn.training.recipes import AnswerSettings
from finlab.mdn.training.teacher import root_share, shares_of_ways, ways_to_deliver
from finlab.physics.plant import Plant
from finlab.whole_file import write_whole

DATA_SEED = 130_000
"""Leads the seed of every file; no evaluation's seed begins like this."""
LEAST_WEIGHT = 1e-3
"""Weight below which a way is not learned from."""
IDS = slice(17, 19)
"""Where among the static features the numbers are that tell equal fins apart."""
MIRRORED = [place + 1 for place in VECTORS]
"""Vertical parts of the vectors among the static features."""


def write_answers(folder: Path, settings: AnswerSettings, seed: int, number: int) -> Path:
    """Make file `number` unless it is there; it depends on the seed and its number alone."""
    path = folder / f"answers-{number:04d}.npz"
    if path.exists():
        return path
    rng = np.random.default_rng([DATA_SEED, seed, number])
    kinds = random_kinds(rng, settings.fins)
    counts, often = np.array(list(FIN_COUNTS)), np.array(list(FIN_COUNTS.values()), float)
    groups: dict[int, list[dict[str, Array]]] = {}
    for _ in range(settings.robots):
        n = int(rng.choice(counts, p=often / often.sum()))
        layout = random_robot(rng, kinds, n)
        robot = effort_robot(Plant(layout), yardstick(layout))
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


def _answers(rng: np.random.Generator, robot: EffortRobot, settings: AnswerSettings) -> dict[str, Array]:
    """One robot, its targets and the ways to deliver them, as the network sees them."""
    target, view = random_targets(rng, robot, settings.targets), robot.view
    ways = ways_to_deliver(rng, robot.forces, target)
    return {
        "static": view.static.astype(np.float32),
        "blocks": view.blocks.astype(np.complex64),
        "asked": (target @ view.solver).astype(np.complex64),
        "way": root_share(ways.force, view.largest).astype(np.complex64),
        "weight": shares_of_ways(ways, settings.sharpness).astype(np.float32),
    }


def read_answers(path: Path) -> dict[int, dict[str, Array]]:
    """The arrays of a file by number of fins; robots (R, ...), targets (R, T, ...), ways (R, T, L, n)."""
    groups: dict[int, dict[str, Array]] = {}
    with np.load(path, allow_pickle=False) as file:
        for key in file.files:
            n, name = key.split(".")
            groups.setdefault(int(n), {})[name] = file[key]
    return groups


class Batch(NamedTuple):
    """B targets, each on a robot of n fins, with up to L ways to deliver it."""

    nodes: Tensor
    """(B, n, 26)."""
    pairs: Tensor
    """(B, n, n, 4)."""
    way: Tensor
    """Forces as roots of shares, in the frames of the features (B, L, n, 2)."""
    weight: Tensor
    """Of the ways (B, L); they add up to 1."""


class Answers:
    """Everything in some files, in memory."""

    def __init__(self, paths: list[Path]) -> None:
        parts: dict[int, list[dict[str, AnyArray]]] = {}
        for path in paths:
            for n, arrays in read_answers(path).items():
                parts.setdefault(n, []).append(arrays)
        self._groups: dict[int, dict[str, AnyArray]] = {}
        for n, some in parts.items():
            whole = {name: np.concatenate([part[name] for part in some]) for name in some[0]}
            robot, target = np.nonzero(whole["weight"].sum(-1) > 0.5)
            flat = {name: whole[name][robot, target] for name in ("asked", "way", "weight")}
            self._groups[n] = {**whole, **flat, "robot": robot}

    def __len__(self) -> int:
        """Number of targets."""
        return sum(len(group["asked"]) for group in self._groups.values())

    def draw(self, rng: np.random.Generator, size: int) -> Batch:
        """A random batch; robots are seen as they are or as their mirror image, with fins in any order."""
        counts = np.array([len(group["asked"]) for group in self._groups.values()])
        n = list(self._groups)[int(rng.choice(len(counts), p=counts / counts.sum()))]
        group = self._groups[n]
        row = rng.integers(len(group["asked"]), size=size)
        robot = group["robot"][row]
        static, (a, b) = group["static"][robot], np.moveaxis(group["blocks"][robot], 1, 0)
        asked, way, weight = (group[name][row] for name in ("asked", "way", "weight"))
        order = rng.random((size, n)).argsort(axis=1)
        static[..., IDS] = np.take_along_axis(static[..., IDS], order[..., None], axis=1)
        mirrored = rng.random(size) < 0.5
        a, b, asked, way = (_mirrored(values, mirrored) for values in (a, b, asked, way))
        static[:, :, MIRRORED] *= np.where(mirrored, -1.0, 1.0)[:, None, None].astype(np.float32)
        seen = features(asked, static, a, b)
        way = way * seen.frame.conj()[:, None]
        parts = np.stack([way.real, way.imag], axis=-1)
        weight = np.where(weight < LEAST_WEIGHT, 0.0, weight)
        arrays = (seen.nodes, seen.pairs, parts, weight / weight.sum(1, keepdims=True))
        return Batch(*(torch.from_numpy(np.asarray(part, dtype=np.float32)) for part in arrays))


def _mirrored(values: AnyArray, rows: AnyArray) -> AnyArray:
    """Complex values (B, ...), conjugate where `rows` (B,) is true."""
    return np.where(rows.reshape(-1, *(1,) * (values.ndim - 1)), values.conj(), values)
