"""The paper's three closed-loop experiments on small runs; their errors by hand and against evo."""

import json
import os
import shutil
import subprocess
import sys
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from finlab.cli import main
from finlab.errors import DataError
from finlab.layout import Layout
from finlab.research.evaluation.document import to_text
from finlab.research.evaluation.experiment import load_experiment
from finlab.research.evaluation.experiments.closed_loop import (
    absolute_error,
    depth_error,
    relative_error,
)
from finlab.research.evaluation.experiments.faults import loss_cases
from tests.terminal import refused


@pytest.fixture
def line(tmp_path: Path) -> str:
    """A file with a metre ahead in eight seconds."""
    path = tmp_path / "line.csv"
    path.write_text("t,x,y,z\n0,0,0,-1\n8,1,0,-1\n")
    return str(path)


def test_trajectory(line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "rows.json"
    argv = ["eval", "trajectory", "--layouts", "A,D", "--trajectory", line, "--methods", "analytic"]
    picture = tmp_path / "paths.svg"
    assert main([*argv, "--runs", "2", "--json", str(file), "--plot", str(picture)]) == 0
    rows = json.loads(file.read_text())["rows"]
    laws = "tracking", "waypoint"
    cases = list(product(("A",), range(3), laws))
    cases += product(("D",), range(2), laws)
    cases.append(("D", 2, None))  # no loss of two fins leaves it steerable
    cases += product(("all",), range(3), laws)
    assert [(row["layout"], row["lost"], row.get("controller")) for row in rows] == cases
    assert all(0.0 < row["ate"] < 0.3 and row["ate_std"] > 0.0 for row in rows if "ate" in row)
    first = rows[0]["path"]
    assert len(first["t"]) == len(first["position"]) == len(first["reference"]) == 16
    shown = capsys.readouterr().out
    assert "paper's method, printed" in shown and "0.1335" in shown and "0.2514" in shown
    assert b"waypoint by analytic, 2 lost" in picture.read_bytes()


def test_faults(layout_a: Layout, line: str) -> None:
    faults = loss_cases(layout_a, 4.0)
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
    rows = load_experiment("velocity").rows(
        layouts=("A",), methods=("analytic",), lost=(0, 1), duration=12.0
    )
    cases = list(product((0, 1), (0.1, 0.15, 0.2, None), ("tracking", "velocity")))
    assert [(row["lost"], row["speed"], row["controller"]) for row in rows] == cases
    assert rows[6]["mae"] == pytest.approx(np.mean([row["mae"] for row in rows[:6:2]]))


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["trajectory", "--runs", "0"], "runs: expected a number of at least 1"),
        (["trajectory", "--trajectory", "spiral"], "circle, lissajous, square"),
        (["trajectory", "--controllers", "pid"], "expected some of tracking, waypoint, velocity"),
        (["trajectory", "--lost", "0,-1"], "lost: expected numbers from 0, got -1"),
        (["trajectory", "--plot", "paths.doc"], "ends in .png, .svg, .pdf"),
        (["faults", "--methods", ","], "methods: expected names"),
        (["velocity", "--duration", "5"], "more than 10 s"),
        (["swims", "--seeds", "0"], "seeds: expected a number of at least 1"),
        (["swims", "--scenarios", "nominal,gale"], "expected some of nominal, damping-double"),
    ],
)
def test_bad_input_is_one_sentence(argv: list[str], message: str) -> None:
    assert message in refused(["eval", *argv])


def test_a_constant_offset_has_no_relative_error() -> None:
    path = np.cumsum(np.random.default_rng(0).standard_normal((50, 3)), axis=0)
    moved = path + [0.3, 0.0, -0.4]
    assert absolute_error(moved, path) == pytest.approx(0.5)
    assert relative_error(moved, path, 5) == pytest.approx(0.0, abs=1e-12)
    assert depth_error(moved, path) == pytest.approx(0.4)


def test_a_drift_shows_in_the_relative_error() -> None:
    time = np.arange(100.0)
    path = np.stack([time, 0 * time, 0 * time], axis=1)
    assert relative_error(path * 1.01, path, 20) == pytest.approx(0.2)
    with pytest.raises(DataError, match="expected a step of 1 to 99"):
        relative_error(path, path, 100)


def evo_rmse(verb: str, folder: Path, *options: str) -> float:
    """Root mean square error that evo prints; positions only, nothing aligned."""
    command = shutil.which(
        verb, path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    )
    if command is None:
        pytest.skip(f"{verb} is not installed")
    files = [str(folder / f"{name}.txt") for name in ("reference", "robot")]
    done = subprocess.run(
        [command, "tum", *files, "-r", "trans_part", *options],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "HOME": str(folder), "MPLBACKEND": "Agg"},
    )
    assert done.returncode == 0, done.stderr
    return next(
        float(line.split()[1])
        for line in done.stdout.splitlines()
        if line.strip().startswith("rmse")
    )


def test_evo_finds_the_same_errors(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    time = 0.1 * np.arange(300)
    reference = np.stack([np.cos(0.1 * time), np.sin(0.1 * time), 0.1 * np.sin(0.3 * time)], axis=1)
    robot = reference + 0.02 * np.cumsum(rng.standard_normal((300, 3)), axis=0)
    for name, path in (("reference", reference), ("robot", robot)):
        level = np.tile(
            [0.0, 0.0, 0.0, 1.0], (300, 1)
        )  # evo wants attitudes; the reference has none
        np.savetxt(tmp_path / f"{name}.txt", np.column_stack([time, path, level]))
    assert evo_rmse("evo_ape", tmp_path) == pytest.approx(
        absolute_error(robot, reference), abs=2e-6
    )
    relative = evo_rmse("evo_rpe", tmp_path, "--delta", "50", "--delta_unit", "f", "--all_pairs")
    assert relative == pytest.approx(relative_error(robot, reference, 50), abs=2e-6)
