"""Batches of what the teacher has answered, all of one number of fins, so that nothing is padded."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from finlab.arrays import AnyArray
from finlab.mdn.features import features
from finlab.mdn.training.shards import read_shard

LEAST_WEIGHT = 1e-3
"""Weight below which a way is not learned from."""
IDS = slice(17, 19)
"""Where among the static features the numbers are that tell equal fins apart."""


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
    """Everything in some shards, in memory; more of them may join."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self._groups: dict[int, dict[str, AnyArray]] = {}
        self._read: set[Path] = set()

    def read(self, paths: list[Path]) -> None:
        """Add the shards that are new."""
        for path in paths:
            if path in self._read:
                continue
            self._read.add(path)
            for n, arrays in read_shard(path).items():
                known = arrays["weight"].sum(-1) > 0.5
                robots = len(self._groups[n]["static"]) if n in self._groups else 0
                robot, target = np.nonzero(known)
                flat = {name: arrays[name][robot, target] for name in ("asked", "way", "weight")}
                new = {
                    "static": arrays["static"],
                    "blocks": arrays["blocks"],
                    **flat,
                    "robot": robot + robots,
                }
                old = self._groups.get(n)
                joined = {k: np.concatenate([old[k], v]) for k, v in new.items()} if old else new
                self._groups[n] = joined

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


MIRRORED = [7, 9, 13, 16]
"""Vertical parts of the vectors among the static features."""


def _mirrored(values: AnyArray, rows: AnyArray) -> AnyArray:
    """Complex values (B, ...), conjugate where `rows` (B,) is true."""
    return np.where(rows.reshape(-1, *(1,) * (values.ndim - 1)), values.conj(), values)
