"""Fitted fins against the fins that were measured, at a small size."""

import json
from pathlib import Path

from finlab.cli import main


def test_eval_fit(tmp_path: Path) -> None:
    file, sizes = tmp_path / "rows.json", ["--fins", "2", "--samples", "60", "--targets", "2"]
    assert main(["eval", "fit", *sizes, "--seed", "3", "--json", str(file)]) == 0
    (row,) = json.loads(file.read_text())["rows"]
    assert row["n"] == 2 and row["err_norm"] > 0.0
    assert 0.001 < row["error_median"] <= row["error_worst"] < 0.5
    assert 0.5 < row["covered_least"] <= row["covered"] <= 1.0
