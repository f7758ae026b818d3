"""Wrenches that follow each other, as a controller's: how far commands move from tick to tick.

A smooth path with white noise on every axis, as estimates from sensors bring it. Each tick is one call that
is given the previous command; a method that ignores it starts again at every tick. The plant scores every
tick, once as commanded and once as fins deliver it that follow late.
"""

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.errors import DataError
from finlab.evaluation.experiment import Experiment
from finlab.evaluation.method_specs import load_method_specs
from finlab.evaluation.progress import progress
from finlab.evaluation.report.document import Column, Row
from finlab.evaluation.smooth_paths import RATE, smooth_path
from finlab.layout import Layout, load_layout
from finlab.layout.angles import command_change
from finlab.physics import plant_of
from finlab.physics.objective import Name as Objective
from finlab.vehicle.fin_lag import FinLag

DOMAIN = 0x9015E
"""Leads the seed of every noise."""
SETTLING = 30
"""Ticks in which fins come from rest to the first command."""


def run(
    layouts: tuple[str, ...] = ("A", "hexa", "restricted"),
    methods: tuple[str, ...] = ("search", "mdn", "analytic", "sqp"),
    paths: int = 2,
    ticks: int = 300,
    noise: float = 0.1,
    objective: Objective = "power",
    checkpoint: str | None = None,
    seed: int = 0,
) -> list[Row]:
    """One row for each layout and method.

    Args:
        layouts: files or names of shipped layouts.
        methods: names as in eval wrench.
        paths: random paths of each layout.
        ticks: length of a path, at least 2; ten a second.
        noise: on every axis, over the root mean square of the path on it.
        objective: what methods that can choose keep least.
        checkpoint: of the learned methods, a shipped name or a folder.
        seed: of paths and noise.
    """
    if ticks < 2 or noise < 0.0:
        raise DataError(f"ticks, noise: expected at least 2 and 0, got {ticks} and {noise:g}")
    robots = [load_layout(name) for name in layouts]
    allocators = load_method_specs(methods, checkpoint, objective, patient=True)
    sigma = next(iter(allocators.values())).normalization.std
    rows: list[Row] = []
    for layout in progress(robots, "layout"):
        drawn = [_noisy_path(layout, sigma, seed + k, ticks, noise) for k in range(paths)]
        for name, method in allocators.items():
            changes, about = zip(*(_follow(method, layout, path) for path in drawn), strict=True)
            change = np.concatenate(changes).reshape(-1, 3)
            row: Row = {"layout": layout.name, "method": name, "ticks": paths * ticks}
            for what, values in zip(("amplitude", "frequency", "turn"), change.T, strict=True):
                row |= {f"{what}_mean": float(values.mean()), f"{what}_p99": float(np.quantile(values, 0.99))}
            rows.append(row | {key: float(np.mean([each[key] for each in about])) for key in about[0]})
    return rows


def _noisy_path(layout: Layout, sigma: Array, seed: int, ticks: int, noise: float) -> Array:
    """A smooth path of wrenches (ticks, 6) [N, N m] with white noise."""
    path = smooth_path(layout, sigma, seed, ticks)
    size = noise * np.sqrt(np.mean(path**2, axis=0))
    return np.asarray(path + size * np.random.default_rng((DOMAIN, seed)).standard_normal(path.shape))


def _follow(allocator: Allocator, layout: Layout, path: Array) -> tuple[Array, Row]:
    """Changes of commands from tick to tick (T - 1, n, 3) [rad, Hz, rad], and means over ticks."""
    command, power = np.empty((len(path), layout.n_fins, 3)), []
    previous = None
    for k, wrench in enumerate(path):
        answer = allocator.allocate(layout, wrench, previous=previous)
        previous = command[k] = answer.command
        power.append(answer.power)
    lag, plant, moved = FinLag(layout), plant_of(layout), np.empty_like(command)
    for _ in range(SETTLING):
        lag.step(command[0], 1.0 / RATE)
    for k, each in enumerate(command):
        lag.step(each, 1.0 / RATE)
        moved[k] = lag.command
    error, late = (allocator.normalization.error(plant.wrench(u), path) for u in (command, moved))
    return command_change(command), {"err_norm": error.mean(), "late": late.mean(), "power": np.mean(power)}


experiment = Experiment(
    name="sequences",
    question="How far do commands move from tick to tick along a path of wrenches with noise?",
    columns=(
        Column("layout", "layout", "code"),
        Column("method", "method", "code"),
        Column("ticks", "ticks", "count"),
        Column("amplitude_mean", "change of A, mean", "error", unit="rad"),
        Column("amplitude_p99", "99th percentile", "error", unit="rad"),
        Column("frequency_mean", "change of f, mean", "error", unit="Hz"),
        Column("frequency_p99", "99th percentile", "error", unit="Hz"),
        Column("turn_mean", "change of phi, mean", "error", unit="rad"),
        Column("turn_p99", "99th percentile", "error", unit="rad"),
        Column("err_norm", "mean error", "error"),
        Column("late", "late", "three"),
        Column("power", "power", "three", unit="W"),
    ),
    run=run,
    note=(
        f"Wrenches at {RATE:g} Hz. Every method is given its previous command; search and mdn alone use it: "
        "they change commands no faster than the servos' rates, and miss part of the wrench for it. Late: "
        "mean error of what fins give that follow their commands with the lags of their servos."
    ),
    quick={"layouts": ("A",), "methods": ("search", "analytic"), "paths": 1, "ticks": 60},
    full={},
    each="layouts",
)
