"""An experiment is one value: the verb, its JSON, its errors and its table follow from it."""

import io
import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from finlab.cli import main
from finlab.errors import DataError
from finlab.research.evaluation.document import to_text
from finlab.research.evaluation.experiment import EXPERIMENTS, load_experiment
from finlab.research.evaluation.experiments import wrench
from tests.terminal import refused

WRENCH_EXPERIMENT = [
    "eval",
    "wrench",
    "--layouts",
    "2",
    "--targets",
    "3",
    "--methods",
    "analytic,qp",
]
"""A small run of the experiment `wrench`."""


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_experiment_can_be_shown_and_made(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    experiment = load_experiment(name)
    assert experiment.name == name and experiment.question.endswith((".", "?"))
    keys = [column.key for column in experiment.columns]
    assert len(set(keys)) == len(keys)
    for options in (experiment.quick, experiment.full):
        assert set(experiment.check(options)) == set(experiment.options())
    assert main(["eval", name, "--help"]) == 0
    shown = capsys.readouterr().out
    assert all(
        f"--{option.replace('_', '-')}" in shown
        for option in experiment.options()
        if option != "layout"
    )
    assert "--json" in shown


def test_rows_table_and_json_are_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "rows.json"
    assert (
        main([*WRENCH_EXPERIMENT, "--split", "limits", "--seed", "1000", "--json", str(file)]) == 0
    )
    text = capsys.readouterr().out
    rows = json.loads(file.read_text())["rows"]
    assert [(row["split"], row["method"], row["n"]) for row in rows] == [
        ("limits", m, 6) for m in ("analytic", "qp")
    ]
    table = load_experiment("wrench").table(rows)
    assert all(line in text for line in to_text(table).splitlines())
    for row in rows:
        low, high = row["err_norm_mean_interval"]
        assert low <= row["err_norm_mean"] <= high
    assert main([*WRENCH_EXPERIMENT, "--split", "limits", "--seed", "1000", "--json", "-"]) == 0
    again = json.loads(capsys.readouterr().out)["rows"]
    assert [row["err_norm_mean"] for row in again] == [row["err_norm_mean"] for row in rows]


def test_a_terminal_is_told_before_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        """A terminal that keeps what is written to it."""

        def isatty(self) -> bool:
            return True

    seen: list[str] = []
    shown = Terminal()
    experiment = load_experiment("wrench")
    monkeypatch.setattr(sys, "stderr", shown)
    monkeypatch.setattr(
        wrench, "experiment", replace(experiment, run=lambda: seen.append(shown.getvalue()) or [])
    )
    assert main(["eval", "wrench", "--json"]) == 0
    assert seen == ["wrench ...\r"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("wrench --methods nobody", "method: expected one of"),
        ("wrench --methods ,", "methods: expected names with commas between"),
        ("wrench --split nowhere --methods qp", "split: expected one of id, ood"),
        ("wrench --layouts 0 --methods qp", "layouts: expected a number of at least 1, got 0"),
        ("wrench --subsample 0 --methods qp", "subsample: expected a number of at least 1, got 0"),
        ("wrench --seed -1 --methods qp", "seed: expected a number of at least 0, got -1"),
        (
            "wrench --targets 1000000000",
            "targets: expected a number of at most 1000000, got 1000000000",
        ),
        (
            "temperature --temperatures 1,x",
            "temperatures: expected numbers with commas between, got '1,x'",
        ),
        ("temperature --temperatures 1,inf", "temperatures: expected a finite number, got inf"),
        (
            "wrench --methods qp --json missing/folder/rows.json",
            "json: expected a file in an existing folder",
        ),
    ],
)
def test_bad_input_is_one_sentence(arguments: str, message: str) -> None:
    assert message in refused(["eval", *arguments.split()])


def test_numbers_that_json_lacks_are_null(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    row = {
        "split": "id",
        "method": "qp",
        "err_norm_mean": math.nan,
        "err_norm_mean_interval": [0.0, math.inf],
    }
    monkeypatch.setattr(wrench, "experiment", replace(load_experiment("wrench"), run=lambda: [row]))
    assert main(["eval", "wrench", "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["rows"]
    assert found == row | {"err_norm_mean": None, "err_norm_mean_interval": [0.0, None]}
    assert main(["eval", "wrench"]) == 0


def test_an_unknown_option_is_named() -> None:
    with pytest.raises(DataError, match="wrench: expected options among layout, split"):
        load_experiment("wrench").rows(fins=3)
    with pytest.raises(DataError, match="eval: expected one of wrench"):
        load_experiment("nothing")


PROGRAM_WITHOUT_TORCH = """
import sys
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "torch":
            raise ModuleNotFoundError("torch is not installed here", name=name)
sys.meta_path.insert(0, Blocked())
from finlab.cli import main
code = main(sys.argv[1:])
assert "torch" not in sys.modules
sys.exit(code)
"""
"""A program in which torch cannot be imported."""


def _run(*arguments: str) -> str:
    """What this program prints."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM_WITHOUT_TORCH, *arguments],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_block_blocks() -> None:
    code = PROGRAM_WITHOUT_TORCH.replace("code = main(sys.argv[1:])", "import torch")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode != 0 and "torch is not installed here" in done.stderr


def test_eval_wrench() -> None:
    methods = "dual,analytic,qp"
    sizes = ("--split", "limits", "--layouts", "2", "--targets", "3")
    shown = _run("eval", "wrench", *sizes, "--methods", methods)
    assert all(name in shown for name in methods.split(","))


def test_simulate(tmp_path: Path) -> None:
    path = tmp_path / "line.csv"
    path.write_text("t,x,y,z\n0,0,0,-1\n3,0.3,0,-1\n")
    shown = _run("simulate", "A", "--trajectory", str(path), "--method", "dual", "--truth", "A")
    assert "ATE" in shown
