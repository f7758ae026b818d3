#!/usr/bin/env python3
"""Makes the file of problems: `tools/bench_problems.py problems.npz` (some minutes).

Needs CasADi (extra `ipopt`) for the best costs that are known; running the benchmark does not.
"""

import io
import json
import os
import sys
from collections.abc import Iterator
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from finlab.actuators.fin.response import largest_forces
from finlab.allocation import Allocator, Policy
from finlab.arrays import AnyArray, Array
from finlab.assets import PAPER_LAYOUTS
from finlab.bench.problems import FORMAT, KINDS, VERSION, BenchRobot, Problems, Sequences, Targets
from finlab.errors import DataError
from finlab.evaluation.experiments.cost import EXACT, yardstick
from finlab.evaluation.progress import progress
from finlab.evaluation.splits import make_split, own_sigma
from finlab.layout import Layout, layout_effectiveness, load_layout
from finlab.layout.file import layout_to_dict
from finlab.physics import plant_of, read_table
from finlab.physics.objective import Name, Objective
from finlab.whole_file import write_whole

SEED = 8821
"""Of the shipped file; no development run, test or report uses it."""
PER_SPLIT = 4
"""Robots of each split."""
SHIPPED = ("asymmetric", "hexa", "mixed", "no_yaw", "octo", "pair", "penta", "restricted")
"""Shipped layouts beside those of the paper; `ucat` has the fins of A."""
DRAWN = (
    *("id", "ood", "ood-fins", "limits", "failure", "near-singular"),
    *("fins", "fins-mixed", "tables", "many-fins", "big", "tiny"),
)
"""Held-out splits that robots are drawn from."""
STARTS = 32
"""Random starts of IPOPT for each target and objective; twice as many of SLSQP where fins are tables."""
WALKED = ("A", "C", "hexa", "ood-fins", "limits", "fins-mixed", "big", "tiny")
"""Layouts, or sets whose first robot is meant, that follow paths."""
ASKED = np.repeat(np.arange(len(KINDS)), (6, 2, 1, 1, 1))
"""Kind of each target of a robot."""
FAR = 1e3
"""How many times a robot's usual wrench lies beyond its reach for certain."""
TICKS = 60
"""Wrenches of a path, ten in a second."""
NOISE = 0.02
"""Standard deviation of the noise on each fin's force along a path, as a share of the fin's largest force."""
RATE = 10.0
"""Wrenches per second [Hz]."""
PERIODS = (10.0, 40.0)
"""Shortest and longest period of a path's sines [s]."""
N_SINES = 3
"""Sines in each axis."""
LOAD = 0.5
"""Largest share of a fin's thrust that an even spread of the path over the fins asks for."""
SMOOTH_DOMAIN = 0x57EAD
"""Leads the seed of every smooth path."""
DOMAIN, SIGMA_DOMAIN = 0xBE9D, 0xBE9E
"""Lead the seeds of every draw, and of sigma."""


def robots(seed: int, per_split: int) -> Iterator[tuple[str, Layout]]:
    """Sets with their layouts, without bodies and failed fins; robot k of a split depends on the split, the
    seed and k alone."""
    for group, names in (("paper", PAPER_LAYOUTS), ("shipped", SHIPPED)):
        yield from ((group, replace(load_layout(name), body=None, description="")) for name in names)
    for split in DRAWN:
        yield from ((split, case.healthy) for case in make_split(split, per_split, 1, seed))


def targets(allocator: Allocator, seed: tuple[int, ...]) -> Array:
    """Wrenches (N, 6) [N, N m] of the kinds `ASKED`, of single precision, for an allocator's robot and a
    seed."""
    rng, plant = np.random.default_rng((DOMAIN, 0, *seed)), plant_of(allocator.layout)
    wrenches = plant.wrench(plant.sample(rng, (len(ASKED),)))
    beyond = np.flatnonzero(ASKED)
    farthest = allocator.allocate_batch(FAR * wrenches[beyond], policy="direction").wrench
    times = [float(KINDS[kind].partition("beyond-")[2] or 1.0) for kind in ASKED[beyond]]
    wrenches[beyond] = farthest * np.array(times)[:, None]
    return single(wrenches)


def path(layout: Layout, sigma: Array, seed: int, noisy: bool) -> Array:
    """A path (T, 6) [N, N m] that the robot can follow; with noise, the same one with noise on its forces."""
    smooth = smooth_path(layout, sigma, seed)
    if not noisy:
        return single(smooth)
    size = NOISE * np.repeat(largest_forces(layout), 2)
    draws = np.random.default_rng((DOMAIN, 1, seed)).standard_normal((TICKS, len(size)))
    return single(smooth + (draws * size) @ layout_effectiveness(layout).T)


def smooth_path(layout: Layout, sigma: Array, seed: int) -> Array:
    """A path of wrenches (T, 6) [N, N m] that the layout can follow.

    Args:
        layout: the robot.
        sigma: per-axis standard deviation (6,), which sets how the axes compare.
        seed: same seed, same sines.
    """
    rng = np.random.default_rng((SMOOTH_DOMAIN, seed))
    time = np.arange(TICKS)[:, None] / RATE
    path = np.zeros((TICKS, 6))
    for _ in range(N_SINES):
        frequency = rng.uniform(1.0 / PERIODS[1], 1.0 / PERIODS[0], 6)
        phase, size = rng.uniform(0.0, 2.0 * np.pi, 6), rng.uniform(0.3, 1.0, 6)
        path += size * np.sin(2.0 * np.pi * frequency * time + phase)
    effectiveness = layout_effectiveness(layout)
    # The least planar forces (T, 2n) whose wrench comes closest to sigma times the path.
    spread = path @ np.linalg.pinv(effectiveness / sigma[:, None], rcond=1e-6).T
    share = np.linalg.norm(spread.reshape(TICKS, -1, 2), axis=-1) / largest_forces(layout)
    return np.asarray(spread @ effectiveness.T * (LOAD / share.max()))


def single(values: Array) -> Array:
    """Values that the file, which holds wrenches with single precision, does not change."""
    return values.astype(np.float32).astype(np.float64)


class BestKnown:
    """The best that is known of one robot's targets."""

    def __init__(self, layout: Layout, sigma: Array, seed: int) -> None:
        """Prepare for a robot, with what errors are divided by (6,) and the seed of random starts."""
        self.layout, self.sigma, self.seed = layout, sigma, seed
        self.allocator = Allocator(layout)
        self.policy = Policy(axis_weights=tuple((self.allocator.scale / sigma).tolist()))

    def least_errors(self, wrenches: Array) -> Array:
        """The least errors (N,) known for wrenches (N, 6)."""
        answers = self.allocator.allocate_batch(wrenches, policy=self.policy, seed=self.seed)
        return np.asarray(np.linalg.norm(answers.unallocated / self.sigma, axis=-1))

    def least_cost(self, objective: Name, wrench: Array) -> float:
        """The least cost known of a wrench (6,) within reach; NaN where none is."""
        answer = yardstick(self.layout, objective, STARTS).on(self.layout).allocate(wrench, seed=self.seed)
        exact = np.linalg.norm(answer.unallocated / self.sigma) <= EXACT
        return float(Objective(objective).meter(plant_of(self.layout))(answer.command)) if exact else np.nan


def make_problems(seed: int = SEED, per_split: int = PER_SPLIT, costs: bool = True) -> Problems:
    """All problems of a seed; without costs in seconds."""
    forces: dict[str, AnyArray] = {}
    bots: list[BenchRobot] = []
    walked: dict[str, int] = {}
    for name, drawn in robots(seed, per_split):
        walked.setdefault(drawn.name, len(bots))
        walked.setdefault(name, len(bots))
        bots.append(_robot(name, drawn, forces, seed, len(bots)))
    problems = Problems({}, tuple(bots), _columns(Targets, []), _columns(Sequences, []), forces)
    best: list[BestKnown] = []
    rows: list[tuple[Any, ...]] = []
    for k in progress(range(len(bots)), "robot"):
        layout, sigma = problems.layout(k), problems.sigma(k)
        best.append(BestKnown(layout, sigma, seed))
        wrenches = targets(best[k].allocator, (seed, k))
        errors = np.where(ASKED, best[k].least_errors(wrenches), 0.0)
        for kind, wrench, error in zip(ASKED, wrenches, errors, strict=True):
            asked = costs and KINDS[kind] == "inside"
            cost = [best[k].least_cost(name, wrench) if asked else np.nan for name in ("power", "effort")]
            rows.append((k, kind, wrench, error, *cost))
    paths: list[tuple[Any, ...]] = []
    for k in progress([walked[name] for name in WALKED], "path"):
        for noisy in (False, True):
            wrenches = path(problems.layout(k), problems.sigma(k), seed + k, noisy)
            paths.append((k, noisy, wrenches, best[k].least_errors(wrenches)))
    whole = {"targets": _columns(Targets, rows), "sequences": _columns(Sequences, paths)}
    return replace(problems, about={"seed": seed, "starts": STARTS}, **whole)


def _robot(name: str, layout: Layout, forces: dict[str, AnyArray], seed: int, index: int) -> BenchRobot:
    """A robot as the file describes it; its force tables join `forces`."""
    description, tables = layout_to_dict(layout), {}
    for fin in description["fins"]:
        fin.pop("servo", None)
        if fin.get("model", {}).get("type") == "table":
            grid = read_table(fin["model"]["path"]).grid
            key, file = f"table_{len(forces)}", f"robot-{index}-{fin['name']}.csv"
            axes = zip(("amplitude", "frequency", "direction"), grid.axes, strict=True)
            forces[key] = grid.values[..., :3].astype(np.float16)
            tables[file] = {name: axis.tolist() for name, axis in axes} | {"force": key}
            fin["model"] = {"type": "table", "path": file}
    robot = BenchRobot(name, description, (1.0,) * 6, tables)
    alone = Problems({}, (robot,), _columns(Targets, []), _columns(Sequences, []), forces)
    rng = np.random.default_rng((SIGMA_DOMAIN, seed, index))
    return replace(robot, sigma=tuple(own_sigma(plant_of(alone.layout(0)), rng).tolist()))


def _columns(kind: Any, rows: list[tuple[Any, ...]]) -> Any:
    """Rows as the arrays of `Targets` or `Sequences`."""
    columns = list(zip(*rows, strict=True)) or [()] * len(kind._fields)
    types = {"robot": np.int64, "kind": np.int64, "noisy": bool, "wrench": np.float32}
    return kind(*(np.array(c, types.get(n, np.float64)) for n, c in zip(kind._fields, columns, strict=True)))


def save_problems(problems: Problems, path: str | os.PathLike[str]) -> None:
    """Write the file whole."""
    robots = [asdict(robot) | {"sigma": list(robot.sigma)} for robot in problems.robots]
    index: dict[str, Any] = {"format": FORMAT, "version": VERSION, "kinds": list(KINDS), "robots": robots}
    text = json.dumps(index | problems.about, separators=(",", ":")).encode()
    arrays: dict[str, AnyArray] = {"index": np.frombuffer(text, np.uint8), **problems.forces}
    arrays |= {f"target_{name}": values for name, values in problems.targets._asdict().items()}
    arrays |= {f"sequence_{name}": values for name, values in problems.sequences._asdict().items()}
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    write_whole(path, buffer.getvalue(), DataError)


if __name__ == "__main__":
    save_problems(make_problems(), sys.argv[1])
