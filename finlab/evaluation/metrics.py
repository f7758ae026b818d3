"""Error measures: per-target records in, one row of the table out. Pure functions, numpy only."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SUCCESS_LEVELS = (0.01, 0.05, 0.5, 1.0)
"""Levels t of `success@t`, the share of targets with `err_norm <= t`."""


@dataclass(frozen=True)
class Records:
    """What one method did on N targets, one entry per target."""

    err_norm: Array
    """`||(w - target) / sigma||`, shape (N,)."""
    err_phys: Array
    """The same without sigma, newton and newton metre mixed, shape (N,)."""
    energy: Array
    """Energy proxy of the command, shape (N,)."""
    solve_ms: Array
    """Time to solve [ms], shape (N,)."""
    n_fins: NDArray[np.int64]
    """Healthy fins of the layout, shape (N,)."""

    def __len__(self) -> int:
        return len(self.err_norm)

    def select(self, keep: NDArray[np.bool_]) -> Records:
        """The records where `keep` (N,) holds."""
        return Records(**{field.name: getattr(self, field.name)[keep] for field in fields(self)})


def make_records(
    wrench: Array, target: Array, sigma: Array, energy: Array, solve_ms: Array, n_fins: int
) -> Records:
    """Records of N targets on one layout.

    Args:
        wrench: delivered wrenches (N, 6) [N, N m], by whatever model scores.
        target: desired wrenches (N, 6).
        sigma: per-axis standard deviation (6,).
        energy: energy proxy (N,).
        solve_ms: time per target (N,) [ms].
        n_fins: healthy fins of the layout.
    """
    difference = wrench - target
    return Records(
        err_norm=np.linalg.norm(difference / sigma, axis=-1),
        err_phys=np.linalg.norm(difference, axis=-1),
        energy=np.asarray(energy, np.float64),
        solve_ms=np.asarray(solve_ms, np.float64),
        n_fins=np.full(len(target), n_fins, np.int64),
    )


def join_records(parts: list[Records]) -> Records:
    """One after the other."""
    return Records(
        **{field.name: np.concatenate([getattr(p, field.name) for p in parts]) for field in fields(Records)}
    )


def wrench_row(records: Records, *, split: str, method: str, scored_by: str = "plant") -> dict[str, Any]:
    """One row of the wrench table.

    Args:
        records: at least one target.
        split: name of the split.
        method: name of the method.
        scored_by: the model that computed the delivered wrench, `plant` or `surrogate`.
    """
    error = records.err_norm
    row: dict[str, Any] = {
        "split": split,
        "method": method,
        "n": len(records),
        "scored_by": scored_by,
        "err_norm_mean": float(error.mean()),
        "err_norm_median": float(np.median(error)),
        "err_norm_p95": float(np.quantile(error, 0.95)),
        "err_norm_max": float(error.max()),
        "err_phys_mean": float(records.err_phys.mean()),
    }
    row |= {f"success_{level}": float((error <= level).mean()) for level in SUCCESS_LEVELS}
    row |= {
        "energy_mean": float(records.energy.mean()),
        "solve_ms_p50": float(np.quantile(records.solve_ms, 0.5)),
        "solve_ms_p99": float(np.quantile(records.solve_ms, 0.99)),
    }
    return row


def rows_by_fin_count(records: Records, *, method: str) -> list[dict[str, Any]]:
    """Error and energy for each number of healthy fins (the paper's figure B as a table)."""
    rows = []
    for n_fins in np.unique(records.n_fins):
        part = records.select(records.n_fins == n_fins)
        rows.append(
            {
                "method": method,
                "fins": int(n_fins),
                "n": len(part),
                "err_norm_mean": float(part.err_norm.mean()),
                "err_norm_median": float(np.median(part.err_norm)),
                "err_norm_p95": float(np.quantile(part.err_norm, 0.95)),
                "success_0.01": float((part.err_norm <= 0.01).mean()),
                "energy_mean": float(part.energy.mean()),
            }
        )
    return rows
