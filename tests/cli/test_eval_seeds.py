"""`finlab eval seeds`, through `main` in this process."""

import json
from pathlib import Path

import pytest

from finlab.cli import main
from finlab.evaluation.experiments.seeds import KINDS, STEPS

TINY = ["eval", "seeds", "--layouts", "1", "--targets", "2", "--candidates", "4"]


def test_prints_a_table_and_writes_the_rows(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "rows.json"
    assert main([*TINY, "--json", str(file)]) == 0
    out, err = capsys.readouterr()
    assert err == ""  # no progress bar outside of a terminal
    rows = json.loads(file.read_text())["rows"]
    assert [(row["steps"], row["seeds"]) for row in rows] == [(s, kind) for s in STEPS for kind in KINDS]
    assert all(row["n"] == 2 for row in rows)
    assert out.startswith("fins") and "4 seeds per target for every kind" in out
    for row in rows:
        assert f"{row['err_norm_mean']:.2f}"[:3] in out


def test_the_same_seed_prints_the_same(
    untrained_checkpoint: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [*TINY, "--split", "failure", "--checkpoint", str(untrained_checkpoint), "--seed"]
    printed = []
    for seed in ("1", "1", "2"):
        assert main([*arguments, seed]) == 0
        printed.append(capsys.readouterr().out)
    assert printed[0] == printed[1] != printed[2]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--candidates", "0"], "candidates: expected a number of at least 1, got 0"),
        (["--layouts", "0"], "layouts: expected a number of at least 1, got 0"),
        (["--targets", "0"], "targets: expected a number of at least 1, got 0"),
        (["--split", "nowhere"], "split: expected one of id, ood"),
        (["--json", "missing/folder/rows.json"], "json: expected a file in an existing folder"),
        (["--checkpoint", "missing/folder"], "missing/folder"),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*TINY, *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("finlab: error: ") and message in error and error.count("\n") == 1
