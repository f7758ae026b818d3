"""From tick to tick along smooth paths of wrenches: what changes with and without the previous command.

A path is a sum of slow sines in every axis, brought into what the layout can push at all and scaled so that
an even spread over the fins never asks for more than half of any fin's thrust. Each tick is one call of
`allocate`; with `previous` it is given the last command. Every answer is scored by the plant, once as it is
and once as fins deliver it that follow late.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from finlab.allocation import Allocation, Allocator
from finlab.allocation.judging import REACHED
from finlab.arrays import Array
from finlab.evaluation.progress import progress
from finlab.evaluation.statistics.tables import Row
from finlab.forces.envelopes import largest_forces
from finlab.layout import Layout
from finlab.layout.angles import command_change, wrapped
from finlab.layout.arrays import layout_effectiveness
from finlab.physics import Plant
from finlab.vehicle.fin_lag import FinLag

TICKS, RATE = 600, 10.0
"""Length of a path, and ticks per second [Hz]: one minute."""
PERIODS = (10.0, 40.0)
"""Shortest and longest period of a path's sines [s]."""
N_SINES = 3
"""Sines in each axis."""
LOAD = 0.5
"""Largest share of a fin's thrust that an even spread of the path asks for."""
SETTLING = 30
"""Ticks in which fins come from rest to the first command."""
DOMAIN = 0x57EAD
"""Leads the seed of every path."""
GOAL = 0.2
"""Largest turn with `previous` over that without it that counts as steady."""
WORKS = 1e-3
"""Share of its largest thrust from which a fin has to point somewhere."""


class Rollout(NamedTuple):
    """What one method did along one path of T ticks."""

    step: Array
    """What each command changed by from tick to tick (T - 1, n, 3) [rad, Hz, rad], turns the shorter way
    round."""
    power: Array
    """Mean mechanical power (T,) [W]."""
    effort: Array
    """The paper's J_en (T,)."""
    err_norm: Array
    """Normalized error (T,), by the plant."""
    late: Array
    """Normalized error (T,) of what fins give at the end of each tick, by the plant, as they follow with the
    lags of their servos."""
    solve_ms: Array
    """Time of each call (T,) [ms]."""


def smooth_path(layout: Layout, sigma: Array, seed: int, ticks: int = TICKS) -> Array:
    """A path of wrenches (T, 6) [N, N m] that the layout can follow.

    Args:
        layout: the robot.
        sigma: per-axis standard deviation (6,), which sets how the axes compare.
        seed: same seed, same sines.
        ticks: how many; a shorter path is the beginning of a longer one up to its scale.
    """
    rng = np.random.default_rng((DOMAIN, seed))
    time = np.arange(ticks)[:, None] / RATE
    path = np.zeros((ticks, 6))
    for _ in range(N_SINES):
        frequency = rng.uniform(1.0 / PERIODS[1], 1.0 / PERIODS[0], 6)
        phase, size = rng.uniform(0.0, 2.0 * np.pi, 6), rng.uniform(0.3, 1.0, 6)
        path += size * np.sin(2.0 * np.pi * frequency * time + phase)
    effectiveness = layout_effectiveness(layout)
    # The least planar forces (T, 2n) whose wrench comes closest to sigma times the path.
    spread = path @ np.linalg.pinv(effectiveness / sigma[:, None], rcond=1e-6).T
    share = np.linalg.norm(spread.reshape(ticks, -1, 2), axis=-1) / largest_forces(layout)
    return np.asarray(spread @ effectiveness.T * (LOAD / share.max()))


def rollout(allocator: Allocator, layout: Layout, path: Array, *, steady: bool) -> Rollout:
    """Follow a path (T, 6), one call per tick; with `steady`, each is given the last command."""
    answers: list[Allocation] = []
    for wrench in path:
        previous = answers[-1].command if steady and answers else None
        answers.append(allocator.allocate(layout, wrench, previous=previous))
    command, plant = np.array([answer.command for answer in answers]), Plant(layout)
    lag = FinLag(layout)
    for _ in range(SETTLING):  # from rest to the first command
        lag.step(command[0], 1.0 / RATE)
    motion = np.empty_like(command)
    for tick, each in enumerate(command):
        lag.step(each, 1.0 / RATE)
        motion[tick] = lag.command
    return Rollout(
        step=command_change(command),
        power=np.array([answer.power for answer in answers]),
        effort=np.array([answer.energy for answer in answers]),
        err_norm=allocator.normalization.error(plant.wrench(command), path),
        late=allocator.normalization.error(plant.wrench(motion), path),
        solve_ms=np.array([answer.solve_ms for answer in answers]),
    )


def forced_turn(layout: Layout, path: Array) -> float | None:
    """The largest turn per tick [rad] that a path forces; None where the fins have a choice.

    Without a null space there is only one set of forces for each wrench.
    """
    effectiveness = layout_effectiveness(layout)
    if np.linalg.matrix_rank(effectiveness, 1e-6) < effectiveness.shape[1]:
        return None
    force = (path @ np.linalg.pinv(effectiveness).T).reshape(len(path), -1, 2)
    works = np.linalg.norm(force, axis=-1) > WORKS * largest_forces(layout)
    turn = np.abs(wrapped(np.diff(np.arctan2(force[..., 1], force[..., 0]), axis=0)))
    return float(np.where(works[1:] & works[:-1], turn, 0.0).max())


def steadiness_rows(
    allocator: Allocator, layouts: Sequence[Layout], *, n_paths: int = 3, ticks: int = TICKS, seed: int = 0
) -> list[Row]:
    """One row per layout: the worst of its paths for changes, their mean for cost and lateness.

    Args:
        allocator: a method that knows `previous`.
        layouts: the robots.
        n_paths: paths of each.
        ticks: length of each path.
        seed: of the first path; the others follow.
    """
    rows = []
    for layout in progress(layouts, "layout"):
        sigma = allocator.normalization.std
        paths = [smooth_path(layout, sigma, seed + k, ticks) for k in range(n_paths)]
        free = [rollout(allocator, layout, path, steady=False) for path in paths]
        steady = [rollout(allocator, layout, path, steady=True) for path in paths]
        rows.append(_row(layout, free, steady, [forced_turn(layout, path) for path in paths]))
    return rows


def _row(layout: Layout, free: list[Rollout], steady: list[Rollout], forced: list[float | None]) -> Row:
    pairs = list(zip(free, steady, strict=True))
    most = [[run.step.max(axis=(0, 1)) for run in pair] for pair in pairs]
    turns = [after[2] / max(before[2], 1e-9) for before, after in most]
    largest = np.max(most, axis=0)
    return {
        "layout": layout.name,
        "fins": layout.n_fins,
        "paths": len(free),
        "turn_free": float(largest[0, 2]),
        "turn_steady": float(largest[1, 2]),
        "turn_ratio": float(max(turns)),
        "steady": int(sum(ratio <= GOAL for ratio in turns)),
        "forced": max((turn for turn in forced if turn is not None), default=None),
        "frequency_free": float(largest[0, 1]),
        "frequency_steady": float(largest[1, 1]),
        "amplitude_free": float(largest[0, 0]),
        "amplitude_steady": float(largest[1, 0]),
        "power_ratio": float(np.mean([b.power.mean() / a.power.mean() for a, b in pairs])),
        "effort_ratio": float(np.mean([b.effort.mean() / a.effort.mean() for a, b in pairs])),
        "late_free": float(np.mean([run.late.mean() for run in free])),
        "late_steady": float(np.mean([run.late.mean() for run in steady])),
        "err_norm_max": float(max(run.err_norm.max() for run in steady)),
        "missed": float(np.mean([run.err_norm > REACHED for run in steady])),
        "ms_free": float(np.median([run.solve_ms for run in free])),
        "ms_steady": float(np.median([run.solve_ms for run in steady])),
    }
