"""Errors of trajectories by hand, and against evo, run as a command."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from finlab.errors import DataError
from finlab.evaluation.experiments.closed_loop import absolute_error, depth_error, relative_error


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
    command = shutil.which(verb, path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))
    if command is None:
        pytest.skip(f"{verb} is not installed")
    done = subprocess.run(
        [
            command,
            "tum",
            str(folder / "reference.txt"),
            str(folder / "robot.txt"),
            "-r",
            "trans_part",
            *options,
        ],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "HOME": str(folder), "MPLBACKEND": "Agg"},
    )
    assert done.returncode == 0, done.stderr
    return next(
        float(line.split()[1]) for line in done.stdout.splitlines() if line.strip().startswith("rmse")
    )


def test_evo_finds_the_same_errors(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    time = 0.1 * np.arange(300)
    reference = np.stack([np.cos(0.1 * time), np.sin(0.1 * time), 0.1 * np.sin(0.3 * time)], axis=1)
    robot = reference + 0.02 * np.cumsum(rng.standard_normal((300, 3)), axis=0)
    for name, path in (("reference", reference), ("robot", robot)):
        level = np.tile([0.0, 0.0, 0.0, 1.0], (300, 1))  # evo wants attitudes; the reference has none
        np.savetxt(tmp_path / f"{name}.txt", np.column_stack([time, path, level]))
    assert evo_rmse("evo_ape", tmp_path) == pytest.approx(absolute_error(robot, reference), abs=2e-6)
    relative = evo_rmse("evo_rpe", tmp_path, "--delta", "50", "--delta_unit", "f", "--all_pairs")
    assert relative == pytest.approx(relative_error(robot, reference, 50), abs=2e-6)
