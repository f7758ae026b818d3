"""What `finlab-runtime` prints, and what it takes."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.deploy import deployed_robot
from finlab.deploy.bundle import Bundle
from finlab.deploy.command import main
from finlab.layout import save_layout

TARGET = [1.0, 0.0, 0.5, 0.0, 0.0, 0.1]
WRENCH = ["--wrench", *map(str, TARGET)]
HEAVY = ("torch", "scipy", "viser", "matplotlib", "yaml", "tyro", "tqdm", "threadpoolctl")


@pytest.fixture(scope="module")
def folder(bundle: Bundle, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bundle") / "A"
    bundle.write(path)
    return path


def test_nothing_heavy_is_loaded(folder: Path) -> None:
    code = (
        "import sys\n"
        f"for name in {HEAVY!r}: sys.modules[name] = None\n"
        "from finlab.deploy.command import main\n"
        f"assert main(['check', {str(folder)!r}]) == 0\n"
        f"assert main(['allocate', {str(folder)!r}, *{WRENCH!r}]) == 0\n"
        "import os; assert os.environ['OPENBLAS_NUM_THREADS'] == '1'\n"
    )
    environment = {name: value for name, value in os.environ.items() if not name.endswith("NUM_THREADS")}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, env=environment
    )
    assert done.returncode == 0, done.stderr
    assert "this computer answers as the one that made the bundle" in done.stdout


def test_allocate_prints_a_table_or_one_object(folder: Path, capsys: Any) -> None:
    question = ["allocate", str(folder), *WRENCH, "--failed", "back_left"]
    truth = finlab.Allocator(finlab.load_layout("A")).allocate(TARGET, failed=["back_left"])
    assert main([*question, "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    lost = shown["fins"].index("back_left")
    assert shown["failed"] == ["back_left"] and shown["target"] == TARGET and shown["command"][lost] is None
    kept = [row for row in shown["command"] if row is not None]
    np.testing.assert_array_equal(kept, np.delete(truth.command, lost, axis=0))
    assert (shown["power"], shown["wrench_plant"]) == (truth.power, truth.wrench.tolist())
    far = ["--wrench", "90", "0", "0", "0", "0", "0", "--policy", "direction"]
    assert main(["allocate", str(folder), *far, "--failed", "back_left"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:5] == ["actuator", "type", "command", "force", "[N]"], "the table of the library"
    assert lines[1 + lost].split() == ["back_left", "fin", "failed"]
    assert any(line.startswith("err_norm ") for line in lines)


def test_a_layout_file_is_refused_with_the_way_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("robot.yaml", "robot.json", "robot.txt"):
        save_layout(finlab.load_layout("A"), tmp_path / "robot.yaml")
        (tmp_path / name).write_bytes((tmp_path / "robot.yaml").read_bytes())
        assert main(["check", str(tmp_path / name)]) == 2
        told = capsys.readouterr().err
        assert told.startswith(f"finlab-runtime: error: {tmp_path / name}: ") and told.count("\n") == 1
    assert main(["check", "nowhere"]) == 2
    assert capsys.readouterr().err.startswith("finlab-runtime: error: nowhere: no such file")


@pytest.mark.parametrize(("value", "code"), [(0.5, 0), (1.0, 0), (1.5, 1), (float("nan"), 1)])
def test_check_prints_each_finding(
    value: float, code: int, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    finding = deployed_robot.Finding("a question", value, 1.0)
    monkeypatch.setattr(deployed_robot, "self_check", lambda _: [finding])
    monkeypatch.setattr(deployed_robot, "extremes", lambda _: finding)
    assert main(["check", str(folder)]) == code
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith(f"{folder}: A, 4 fins, method dual, ready in ")
    assert lines[1] == f"  {'FAILED' if code else 'ok    '} a question: {value:.2g}, allowed 1"
    assert lines[-1].startswith("do not use this bundle here" if code else "this computer answers")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "the following arguments are required: check|allocate|serve"),
        (["fly", "bundle"], "invalid choice: 'fly'"),
        (["check"], "the following arguments are required: BUNDLE"),
        (["allocate", "bundle", "--wrench", "1"], "--wrench: expected 6 arguments"),
        (["allocate", "bundle", "--wrench", *"123456", "--policy=hope"], "invalid choice: 'hope'"),
        (["serve", "bundle", "--watchdog-s=2", "--no-watchdog"], "not allowed with argument"),
    ],
)
def test_a_wrong_call_ends_with_usage_and_2(arguments: list[str], message: str, capsys: Any) -> None:
    assert main(arguments) == 2
    told = capsys.readouterr().err
    assert told.startswith("usage: finlab-runtime ") and message in told


def test_every_page_of_help_has_an_example(capsys: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "400")  # an example is not folded
    for verb in ([], ["check"], ["allocate"], ["serve"]):
        assert main([*verb, "--help"]) == 0
        assert "\nexample: " in capsys.readouterr().out
