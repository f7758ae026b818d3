"""What the closed-loop experiments share: rows of single runs, means over seeds."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from tqdm import tqdm

from finlab.evaluation.statistics.trajectory_errors import (
    RTE_DELTA_S,
    absolute_error,
    depth_error,
    relative_error,
)
from finlab.sim import ClosedLoop, RunLog

Row = dict[str, Any]

LOST_M = 1.0
"""A robot that is ever farther than this from its reference has lost it."""


def follow_row(log: RunLog) -> Row:
    """Errors of one run along a trajectory [m], power [W] and time; a run that is shorter than the piece of
    the relative error counts as one piece."""
    position, reference = log.position, log.reference
    piece = round(RTE_DELTA_S / float(log.time[1] - log.time[0]))
    return {
        "ate": absolute_error(position, reference),
        "rte": relative_error(position, reference, min(piece, log.n_ticks - 1)),
        "depth_rmse": depth_error(position, reference),
        "max": float(np.linalg.norm(position - reference, axis=1).max()),
        **power_row(log),
    }


def power_row(log: RunLog) -> Row:
    """Mean power of all fins [W] by both measures, and the median time of an allocation."""
    return {
        "inertial_w": float(log.inertial_power.sum(axis=1).mean()),
        "torque_w": float(log.torque_power.sum(axis=1).mean()),
        "solve_ms": float(np.median(log.solve_ms)),
    }


def over_seeds(rows: Sequence[Row]) -> Row:
    """Mean of each number over runs, and under `<name>_std` its spread (0 for a single run)."""
    means: Row = {}
    for key in rows[0]:
        values = np.array([row[key] for row in rows])
        means[key], means[f"{key}_std"] = float(values.mean()), float(values.std(ddof=min(1, len(rows) - 1)))
    return means


def run_all(swims: Iterable[tuple[Any, Callable[[], ClosedLoop]]], total: int) -> list[tuple[Any, RunLog]]:
    """Swims one after the other, with a bar on stderr; each comes with a label."""
    done = []
    for label, make in tqdm(swims, total=total, unit="run", disable=None, leave=False, file=sys.stderr):
        done.append((label, make().run()))
    return done


def spread(row: Row, key: str, digits: int = 3) -> str:
    """Mean and spread of a number as text."""
    return f"{row[key]:.{digits}f} +- {row[f'{key}_std']:.{digits}f}"
