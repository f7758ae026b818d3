"""The paper's figure A: what the temperature of the draw does, and what refinement does to a candidate."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from finlab.allocation.learned.settings import PaperOptions
from finlab.allocation.methods import load_allocator
from finlab.arrays import Array
from finlab.evaluation.progress import progress
from finlab.evaluation.splits import Case
from finlab.evaluation.statistics.bootstrap import mean_interval
from finlab.evaluation.statistics.records import Columns
from finlab.evaluation.statistics.tables import Row
from finlab.layout import Layout
from finlab.layout.angles import is_full_turn

TEMPERATURES = tuple(float(t) for t in np.logspace(-3, 1, 13))
"""From 0.001 to 10, three to a decade."""
PAPER_TEMPERATURE = 0.02
"""The paper's choice."""


def temperature_columns(
    cases: Sequence[Case],
    temperature: float,
    *,
    checkpoint: str | Path | None = None,
    n_candidates: int = 64,
    seed: int = 0,
) -> Columns:
    """What the draw at one temperature gives, before any refinement, one entry per target.

    Columns: `layout` and `target` (numbers), `n_fins`, `diversity` (see `diversity`), `best_j` and `mean_j`
    (smallest and mean selection cost J = J_norm + gamma J_en among the candidates, by the surrogate).

    Args:
        cases: layouts with targets.
        temperature: of the draw.
        checkpoint: of method `paper`; the shipped one by default.
        n_candidates: candidates drawn per target.
        seed: of the draw.
    """
    options: PaperOptions = {"n_candidates": n_candidates, "temperature": temperature, "refinement": "none"}
    allocator = load_allocator("paper", checkpoint=checkpoint, **options)
    rows: list[Row] = []
    for k, case in enumerate(progress(cases, "layout")):
        layout = case.healthy
        for number, target in enumerate(case.targets):
            samples = allocator.allocate(layout, target, seed=seed).samples
            assert samples is not None
            j = samples.err_norm**2 + allocator.settings.gamma * samples.energy
            row = {"layout": k, "target": number, "n_fins": layout.n_fins}
            spread = diversity(samples.command, layout)
            rows.append({**row, "diversity": spread, "best_j": j.min(), "mean_j": j.mean()})
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def refinement_columns(
    case: Case,
    *,
    checkpoint: str | Path | None = None,
    n_candidates: int = 64,
    temperature: float = PAPER_TEMPERATURE,
    seed: int = 0,
) -> Columns:
    """Every candidate of every target of a case before and after refinement.

    Columns, one entry per candidate, by the surrogate: `target`, `refined` (0 before, 1 after), `energy`,
    `err_norm`.
    """
    options: PaperOptions = {"n_candidates": n_candidates, "temperature": temperature}
    allocator = load_allocator("paper", checkpoint=checkpoint, n_refined=n_candidates, **options)
    parts = []
    for number, target in enumerate(case.targets):
        result = allocator.allocate(case.layout, target, failed=case.failed, seed=seed)
        for refined, found in enumerate((result.samples, result.candidates)):
            assert found is not None
            about = {"target": number, "refined": refined}
            columns = {name: np.full(n_candidates, value) for name, value in about.items()}
            parts.append({**columns, "energy": found.energy, "err_norm": found.err_norm})
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def diversity(command: Array, layout: Layout) -> float:
    """Mean distance between two of the commands (K, n, 3): root mean square over all their entries, each in
    units of its range; zero directions of a full circle are compared the short way round."""
    width = np.maximum(layout.upper - layout.lower, 1e-9)
    first, second = np.triu_indices(len(command), k=1)
    if len(first) == 0:
        return 0.0
    gap = np.abs(command[first] - command[second])
    turns = is_full_turn(width[:, 2])
    gap[..., 2] = np.where(turns, np.minimum(gap[..., 2], 2 * np.pi - gap[..., 2]), gap[..., 2])
    return float(np.sqrt(((gap / width) ** 2).mean(axis=(1, 2))).mean())


def temperature_rows(cases: Sequence[Case], **options: Any) -> list[Row]:
    """The table's rows, one per temperature; options as in `temperature_columns`."""
    values = progress(TEMPERATURES, "temperature")
    return [temperature_row(value, temperature_columns(cases, value, **options)) for value in values]


def temperature_row(temperature: float, columns: Columns) -> Row:
    """One row of the table, from the records of one temperature."""
    j, group = columns["best_j"], columns["layout"]
    return {
        "temperature": temperature,
        "n": len(j),
        "diversity": float(columns["diversity"].mean()),
        "best_j_median": float(np.median(j)),
        "best_j_mean": float(j.mean()),
        "best_j_mean_interval": list(mean_interval(j, group)),
    }
