"""Fitted fins against the fins that were measured, at a small size."""

import json
from pathlib import Path

import numpy as np
import pytest

from finlab.cli import main
from finlab.evaluation.experiments.fit import NOISES, measured


@pytest.mark.parametrize(
    ("of", "deviation"), [("each force", [[0.5] * 3, [0.05] * 3]), ("the largest", [[0.5] * 3, [0.5] * 3])]
)
def test_noise_is_a_share_of_what_it_says(of: str, deviation: list[list[float]]) -> None:
    force = np.tile([[3.0, 4.0, 0.0], [0.0, 0.0, 0.5]], (20000, 1, 1))
    noise = measured(np.random.default_rng(0), force, 0.1, of) - force
    np.testing.assert_allclose(noise.std(axis=0), deviation, rtol=0.03)


def test_eval_fit(tmp_path: Path) -> None:
    file, sizes = tmp_path / "rows.json", ["--fins", "2", "--samples", "60", "--targets", "2"]
    assert main(["eval", "fit", *sizes, "--seed", "3", "--json", str(file)]) == 0
    rows = json.loads(file.read_text())["rows"]
    assert [row["noise_of"] for row in rows] == [of for of in NOISES for _ in range(3)]
    for row in rows:
        assert row["n"] == (2 if row["fins"] == "all" else 1)
        assert 0.001 < row["error_median"] <= row["error_worst"] < 0.5
        assert min(row["err_norm"], row["err_norm_floor"]) > 0.0
        assert 0.5 < row["covered_least"] <= row["covered"] <= 1.0
