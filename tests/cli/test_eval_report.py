"""`finlab eval temperature|training|report`, through `main` in this process, at the smallest sizes."""

import json
from pathlib import Path

import pytest

from finlab.cli import main
from finlab.evaluation.experiments.training_study import CHANGES


def test_temperature(untrained_checkpoint: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "rows.json"
    sizes = ["--layouts", "1", "--targets", "1", "--candidates", "4"]
    arguments = [
        "eval",
        "temperature",
        *sizes,
        "--checkpoint",
        str(untrained_checkpoint),
        "--json",
        str(file),
    ]
    assert main(arguments) == 0
    rows = json.loads(file.read_text())["rows"]
    assert len(rows) == 13 and rows[0]["temperature"] == 1e-3 and rows[-1]["temperature"] == 10.0
    assert "is lowest at T = " in capsys.readouterr().out.replace("\n", " ")


def test_training_goes_on_where_it_was(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    few = {name: CHANGES[name] for name in ("recipe", "one_component")}
    monkeypatch.setattr("finlab.evaluation.report.plan.CHANGES", few)
    sizes = ["--preset", "smoke", "--steps", "3", "--batch-size", "16", "--layouts", "1", "--targets", "2"]
    file = tmp_path / "rows.json"
    arguments = ["eval", "training", "-o", str(tmp_path / "study"), *sizes, "--json", str(file)]
    assert main(arguments) == 0
    first = capsys.readouterr().out
    assert [row["change"] for row in json.loads(file.read_text())["rows"]] == list(few)
    words = first.replace("\n", " ")
    assert "3 steps of 16 samples each (preset `smoke`)" in words and CHANGES["recipe"].title in words
    assert main(arguments) == 0
    assert capsys.readouterr().out == first  # seconds of training included: nothing was trained again


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("temperature --candidates 0", "candidates: expected a number of at least 1, got 0"),
        ("temperature --split nowhere", "split: expected one of id, ood"),
        ("training --steps 0", "steps: expected a number of at least 1, got 0"),
        ("training --preset nothing", "preset: expected one of paper, annealed, smoke, got 'nothing'"),
        ("report -o README.md", "out: expected a folder, got the file README.md"),
        ("report -o somewhere --processes 0", "processes: expected a number of at least 1, got 0"),
        ("report -o somewhere --checkpoint missing/folder", "missing/folder"),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: str, message: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(Path(__file__).resolve().parents[2])
    assert main(["eval", *arguments.split()]) == 2
    error = capsys.readouterr().err
    assert error.startswith("finlab: error: ") and message in error and error.count("\n") == 1
    assert not Path("somewhere").exists()
