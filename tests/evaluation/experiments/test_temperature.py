"""Diversity by hand, the table of temperatures, and the candidates before and after refinement."""

from pathlib import Path

import numpy as np
import pytest

from finlab.evaluation.experiments.temperature import (
    diversity,
    refinement_columns,
    temperature_columns,
    temperature_row,
)
from finlab.evaluation.report.sections.studies import temperature_blocks
from finlab.evaluation.report.text import to_text
from finlab.evaluation.splits import make_split
from finlab.layout import Fin, Layout, Limits


def _robot(limits: Limits) -> Layout:
    return Layout("one", (Fin("fin", (0.1, 0.0, 0.0), 0.0, limits),))


def test_diversity_by_hand() -> None:
    robot = _robot(Limits((0.0, 1.0), (0.0, 2.0), (-np.pi, np.pi)))
    command = np.array([[[0.0, 0.0, -3.0]], [[0.5, 1.0, 3.0]]])
    short_way = (2 * np.pi - 6.0) / (2 * np.pi)
    assert diversity(command, robot) == pytest.approx(np.sqrt((0.25 + 0.25 + short_way**2) / 3))
    arc = _robot(Limits((0.0, 1.0), (0.0, 2.0), (-3.0, 3.0)))
    assert diversity(command, arc) == pytest.approx(np.sqrt((0.25 + 0.25 + 1.0) / 3))
    assert diversity(command[:1], robot) == 0.0


def test_more_temperature_more_diversity() -> None:
    """With the shipped network, whose components stand for different commands."""
    cases = make_split("id", 2, 2, 0)
    cold, hot = (temperature_columns(cases, t, n_candidates=16) for t in (1e-3, 1.0))
    assert cold["layout"].tolist() == [0, 0, 1, 1] and cold["target"].tolist() == [0, 1, 0, 1]
    assert (hot["diversity"] > 1.5 * cold["diversity"]).all()
    assert (cold["best_j"] <= cold["mean_j"]).all()


def test_a_row_and_the_best_temperature() -> None:
    def columns(j: list[float]) -> dict[str, np.ndarray]:
        return {"best_j": np.array(j), "diversity": np.array([0.5, 0.7]), "layout": np.array([0, 1])}

    rows = [temperature_row(0.1, columns([1.0, 3.0])), temperature_row(1.0, columns([2.0, 4.0]))]
    assert rows[0]["best_j_mean"] == 2.0 and rows[0]["diversity"] == pytest.approx(0.6)
    assert rows[0]["best_j_mean_interval"] == [1.0, 3.0]
    assert "lowest at T = 0.100, and the" in to_text(*temperature_blocks(rows)).replace("\n", " ")


def test_every_candidate_before_and_after(untrained_checkpoint: Path) -> None:
    case = make_split("id", 1, 2, 0)[0]
    columns = refinement_columns(case, checkpoint=untrained_checkpoint, n_candidates=8)
    assert {len(values) for values in columns.values()} == {2 * 2 * 8}
    assert np.unique(columns["refined"]).tolist() == [0, 1]
    for target in (0, 1):
        mine = columns["target"] == target
        before, after = (columns["err_norm"][mine & (columns["refined"] == k)] for k in (0, 1))
        assert len(before) == len(after) == 8 and after.mean() < before.mean()
