"""`finlab simulate` through `main`: log, pictures, sentences; logs that are whole or not there."""

import os
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from finlab.cli import main
from finlab.swim.simulation import load_log
from tests.terminal import first_shown, refused

FILES = {"log.npz"}
"""What a swim without pictures writes."""


@pytest.fixture
def line(tmp_path: Path) -> list[str]:
    """A command that swims a metre ahead in eight seconds."""
    path = tmp_path / "line.csv"
    path.write_text("t,x,y,z\n0,0,0,-1\n8,1,0,-1\n")
    return ["simulate", "A", "--trajectory", str(path), "--method", "analytic"]


def test_a_log_is_written(
    line: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    argv = [*line, "--lost", "front_left@4", "--output", str(out)]
    assert main(argv) == 0
    printed = capsys.readouterr().out
    assert "ATE" in printed and "lost: front_left" in printed and "written log.npz" in printed
    log = load_log(out / "log.npz")
    assert log.task == "line" and not log.alive[-1, log.names.index("front_left")]
    assert {path.name for path in out.iterdir()} == FILES


@pytest.mark.parametrize("limit", [0, 20_000])
def test_a_full_disk_is_a_sentence_and_leaves_nothing(
    limit: int, line: list[str], tmp_path: Path
) -> None:
    """A limit on the size of files stands for the disk."""
    out = tmp_path / "out"
    ended = subprocess.run(
        [sys.executable, "-m", "finlab", *line, "-o", str(out)],
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
    )
    assert ended.returncode == 2 and list(out.iterdir()) == []
    (sentence,) = [text for text in ended.stderr.splitlines() if text.startswith("finlab: error: ")]
    assert str(out) in sentence and "cannot be written: File too large" in sentence


def test_progress_is_shown_at_once(line: list[str]) -> None:
    shown, spent = first_shown(*line)
    assert "swim" in shown
    assert spent < 1.5, "the processor's time until a bar is there [s]"


def test_a_monitor_says_what_it_finds(
    line: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "line.csv").write_text("t,x,y,z\n0,0,0,-1\n16,2,0,-1\n")
    argv = [*line, "--lost", "front_left@10", "--no-announced"]
    assert main([*argv, "--monitor", "-o", str(tmp_path / "swim")]) == 0
    assert "s: the monitor takes front_left lost" in capsys.readouterr().out
    log = load_log(tmp_path / "swim" / "log.npz")
    assert log.fault_probability[-1].argmax() == log.names.index("front_left")
    assert main(argv) == 0
    assert "monitor" not in capsys.readouterr().out


def test_the_papers_controllers_and_a_picture(
    line: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "path.svg"
    out = tmp_path / "out"
    argv = [*line, "--controller", "waypoint", "--lost", "front_left@4"]
    assert main([*argv, "--plot", str(picture), "-o", str(out)]) == 0
    assert load_log(out / "log.npz").controller == "waypoint"
    assert b"front_left lost" in picture.read_bytes()
    assert main([*line, "--controller", "velocity"]) == 0
    printed = capsys.readouterr().out
    assert "ATE" in printed and "MAE of the speed" in printed


def test_without_matplotlib_a_picture_is_refused_before_the_swim(
    line: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main([*line, "--plot", str(tmp_path / "path.png")]) == 2
    said = capsys.readouterr()
    assert "matplotlib is not installed; run: pip install" in said.err and not said.out


def test_a_swim_in_mujoco(
    line: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Nearly the swim of the own plant; without the package a sentence, before the swim."""
    pytest.importorskip("mujoco", reason="mujoco is an optional extra")
    logs = []
    for plant in ("finlab", "mujoco"):
        out = tmp_path / plant
        assert main([*line, "--lost", "front_left@4", "--plant", plant, "-o", str(out)]) == 0
        assert ("plant: mujoco" in capsys.readouterr().out) == (plant == "mujoco")
        logs.append(load_log(out / "log.npz"))
    own, other = logs
    off = np.abs(own.position - other.position).max()
    assert 0.0 < off < 2e-3
    np.testing.assert_array_equal(own.alive, other.alive)

    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.delitem(sys.modules, "finlab.swim.vehicle.mujoco_body")
    sentence = refused([*line, "--plant", "mujoco"])
    assert "mujoco is not installed; run: pip install 'finlab-marine[mujoco]'" in sentence


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["--plant", "gazebo"], "plant: expected one of finlab, mujoco, got 'gazebo'"),
        (["--controller", "pd"], "one of tracking, waypoint, velocity, got 'pd'"),
        (["--plot", "path.doc"], "ends in .png, .svg, .pdf"),
        (["--lost", "front_left@soon"], "lost: expected NAME@SECONDS"),
        (["--lost", "front_left@-1"], "expected a time of 0 s or more"),
        (["--stuck", "front_left=0.5@3"], "stuck: expected NAME@SECONDS"),
        (["--torn", "front_left@3"], "torn: expected NAME=SHARE@SECONDS"),
        (["--torn", "front_left=2@3"], "a share of the thrust between 0 and 1"),
        (["--lost", "tail@3", "--method", "analytic"], "no fin 'tail'"),
        (["--trajectory", "spiral", "--method", "analytic"], "circle, lissajous, square"),
        (
            ["--excite", "--monitor"],
            "leave --controller, --lost, --torn, --stuck, --whole, --monitor and",
        ),
        (["-o", __file__], "cannot be made a folder: File exists"),
    ],
)
def test_bad_input_is_one_sentence(argv: list[str], message: str) -> None:
    assert message in refused(["simulate", "A", *argv])
