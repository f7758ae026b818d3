"""Fitted fins against the fins that were measured, at a small size."""

import json
from pathlib import Path

import numpy as np
import pytest

from finlab.cli import main
from finlab.evaluation.experiments.fin_fits import NOISES, of_each, of_largest
from finlab.evaluation.noisy_tables import share_of_components


def test_noise_is_a_share_of_what_it_says() -> None:
    force = np.tile([[3.0, 4.0, 0.0], [0.0, 0.0, 0.5]], (20000, 1, 1))
    rng = np.random.default_rng(0)
    for measure, deviation in (
        (of_each(0.1), [[0.5] * 3, [0.05] * 3]),
        (of_largest(0.1), [[0.5] * 3, [0.5] * 3]),
        (share_of_components, [[0.09, 0.12, 0.0], [0.0, 0.0, 0.015]]),
    ):
        np.testing.assert_allclose(
            (measure(rng, force) - force).std(axis=0), deviation, rtol=0.03, atol=1e-12
        )


def test_eval_fit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, sizes = tmp_path / "rows.json", ["--fins", "2", "--samples", "60", "--targets", "2"]
    assert main(["eval", "fit", *sizes, "--seed", "3", "--json", str(file)]) == 0
    rows = json.loads(file.read_text())["rows"]
    assert [row["noise_of"] for row in rows] == [of for of in NOISES for _ in range(3)]
    for row in rows:
        assert row["n"] == (2 if row["fins"] == "all" else 1)
        assert 0.001 < row["error_median"] <= row["error_worst"] <= row["error_largest"] < 0.5
        assert min(row["err_norm"], row["err_norm_floor"]) > 0.0
        assert row["ratio"] == pytest.approx(row["err_norm"] / row["err_norm_floor"])
        assert 0.5 < row["covered_least"] <= row["covered"] <= row["covered_most"] <= 1.0
    assert "The noise floor is what the same method misses with a full grid" in " ".join(
        capsys.readouterr().out.split()
    )


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--samples", "19"], "samples: expected at least 20, got 19"),
        (["--noise", "1.5"], "noise: expected a share from 0 to 1, got 1.5"),
        (["--fins", "0"], "fins: expected a number of at least 1, got 0"),
    ],
)
def test_bad_numbers(arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["eval", "fit", *arguments]) == 2
    assert sentence in capsys.readouterr().err
