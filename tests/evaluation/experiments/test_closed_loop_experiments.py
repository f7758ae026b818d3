"""The paper's three closed-loop experiments on small runs, and what they refuse."""

import json
from pathlib import Path

import numpy as np
import pytest

from finlab.cli import main
from finlab.evaluation.document import to_text
from finlab.evaluation.experiment import load_experiment
from finlab.evaluation.experiments.faults import all_faults
from finlab.layout import Layout


@pytest.fixture
def line(tmp_path: Path) -> str:
    """A file with a metre ahead in eight seconds."""
    path = tmp_path / "line.csv"
    path.write_text("t,x,y,z\n0,0,0,-1\n8,1,0,-1\n")
    return str(path)


def test_trajectory(line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "rows.json"
    argv = ["eval", "trajectory", "--layouts", "A", "--trajectory", line, "--methods", "analytic"]
    assert main([*argv, "--runs", "2", "--json", str(file)]) == 0
    one, every = json.loads(file.read_text())["rows"]
    assert (one["layout"], one["runs"], every["layout"]) == ("A", 2, "all")
    assert 0.0 < one["ate"] < 0.3 and one["ate_std"] > 0.0
    shown = capsys.readouterr().out
    assert "paper's method, printed" in shown and "0.1335" in shown


def test_faults(layout_a: Layout, line: str) -> None:
    faults = all_faults(layout_a, 4.0)
    assert len(faults) == 1 + 4 + 6 + 4
    hopeless = [fault.label for fault in faults if not fault.controllable]
    assert len(hopeless) == 2
    experiment = load_experiment("faults")
    rows = experiment.rows(trajectory=line, methods=("analytic",), runs=1)
    assert [row["fault"] for row in rows if row["kept"] == "not swum"] == hopeless
    healthy, *swum = [row for row in rows if row["kept"] == "yes"]
    assert healthy["over_healthy"] == 1.0
    for row in swum:
        assert row["over_healthy"] == pytest.approx(row["ate"] / healthy["ate"])
    assert hopeless[0] in to_text(experiment.table(rows))


def test_velocity() -> None:
    rows = load_experiment("velocity").rows(methods=("fixed_frequency", "dual"), runs=1, duration=12.0)
    assert [row["speed"] for row in rows] == [0.1, 0.1, 0.15, 0.15, 0.2, 0.2, None, None]
    assert rows[-2]["mae"] == pytest.approx(np.mean([row["mae"] for row in rows[:6:2]]))
    baseline, dual = rows[-2:]
    assert baseline["over_baseline"] == 1.0 and dual["over_baseline"] < 0.9
    assert dual["over_baseline"] == pytest.approx(dual["inertial_w"] / baseline["inertial_w"])


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["trajectory", "--runs", "0"], "runs: expected a number of at least 1"),
        (["trajectory", "--trajectory", "spiral"], "circle, lissajous, square"),
        (["faults", "--methods", ","], "methods: expected names"),
        (["velocity", "--duration", "5"], "more than 10 s"),
        (["swims", "--seeds", "0"], "seeds: expected a number of at least 1"),
        (["swims", "--scenarios", "nominal,gale"], "expected some of nominal, damping-double"),
    ],
)
def test_bad_input_is_one_sentence(argv: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["eval", *argv]) == 2
    err = capsys.readouterr().err
    assert err.startswith("finlab: error: ") and message in err and len(err.splitlines()) == 1
