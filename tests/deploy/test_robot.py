"""A robot out of its bundle: the library's answers, and a self-check that notices what is wrong."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab.allocation import Allocator
from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.assets import shipped_layouts
from finlab.deploy.bundle import Bundle, make_bundle
from finlab.deploy.command import main
from finlab.deploy.robot import Robot, parse_robot
from finlab.deploy.self_check import Finding, self_check, worst
from finlab.errors import AllocationError, FinlabError
from finlab.layout import FinModelSpec
from finlab.physics.energy import POWER_WEIGHTS

HEAVY = ("torch", "scipy", "viser", "matplotlib", "yaml", "tyro", "tqdm", "threadpoolctl", "onnx")
WRENCH = ["--wrench", "1", "0", "0.5", "0", "0", "0.1"]
KNOWN = [name for name in sorted(shipped_layouts()) if name != "mixed"]
"""Shipped layouts whose fins the shipped checkpoint has learned."""


@pytest.fixture(scope="module")
def robot(bundle: Bundle) -> Robot:
    return parse_robot(bundle.files)


@pytest.fixture(scope="module")
def folder(bundle: Bundle, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bundle") / "A"
    bundle.write(path)
    return path


def with_surrogate(robot: Robot, factor: float) -> Robot:
    """A robot whose learned physics are off by a factor."""
    weights = robot.allocator.weights
    assert weights is not None
    bent = {key: array * np.float32(factor) for key, array in weights.surrogate.items()}
    return Robot(robot.graph, LearnedAllocator(replace(weights, surrogate=bent)))


def test_answer_says_what_is_missing(robot: Robot) -> None:
    answer = robot.allocate([1, 0, 0.5, 0, 0, 0.1], failed=["front_right"])
    assert answer.fins == finlab.load_layout("A").names
    assert np.isnan(answer.command[0]).all() and not np.isnan(answer.command[1:]).any()
    np.testing.assert_allclose(answer.wrench + answer.unallocated, [1, 0, 0.5, 0, 0, 0.1], atol=1e-12)
    far = robot.allocate([90, 0, 0, 0, 0, 0], policy="direction")
    assert far.err_norm > 1 and abs(far.wrench[1]) < 0.1
    with pytest.raises(FinlabError, match="no fin 'nobody'"):
        robot.allocate([0] * 6, failed=["nobody"])


def test_failed_fins_of_the_bundle_stay_failed(shipped_allocator: Allocator) -> None:
    layout = finlab.load_layout("A")
    robot = parse_robot(make_bundle(layout, shipped_allocator, ("back_left",)).files)
    lost = layout.index("back_left")
    assert np.isnan(robot.allocate([0.5, 0, 0, 0, 0, 0]).command[lost]).all()
    assert np.isnan(robot.allocate([0.5, 0, 0, 0, 0, 0], failed=["front_left"]).command[lost]).all()
    assert np.isnan(robot.neutral()[lost]).all()
    assert all(finding.good for finding in self_check(robot))


def test_fast_path_reaches_the_target(bundle: Bundle) -> None:
    robot = parse_robot(bundle.files, fast=True)
    assert robot.allocate([1, 0, 0.5, 0, 0, 0.1]).err_norm < 5e-3
    findings = self_check(robot)
    assert all(finding.good for finding in findings)
    assert findings[-1].question.startswith("answers of the fast path")


@pytest.mark.parametrize("name", KNOWN)
def test_every_shipped_layout_passes_its_self_test(name: str, shipped_allocator: Allocator) -> None:
    files = make_bundle(finlab.load_layout(name), shipped_allocator).files
    findings = self_check(parse_robot(files))
    assert len(findings) == 6
    assert all(finding.good for finding in findings), findings


def test_self_test_notices_other_physics(robot: Robot) -> None:
    bad = [finding.question for finding in self_check(with_surrogate(robot, 1.05)) if not finding.good]
    assert "wrench of the stored commands (err_norm)" in bad
    assert "own answers, judged by the fins' own model (err_norm)" in bad


def test_nan_is_never_good() -> None:
    assert np.isnan(worst([0.1, float("nan"), 0.2])) and worst([-1.0]) == 0.0 and worst([0.1, 0.3]) == 0.3
    assert not Finding("a question", float("nan"), 1.0).good
    assert Finding("a question", 1.0, 1.0).good and not Finding("a question", 1.1, 1.0).good


def test_a_bundle_that_answers_nan_fails_its_check(
    bundle: Bundle, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bundle.write(tmp_path)
    healthy = LearnedAllocator._solve

    def broken(self: LearnedAllocator, *arguments: object, **options: object) -> object:
        solution = healthy(self, *arguments, **options)  # type: ignore[arg-type]
        return solution._replace(command=solution.command * np.nan)

    monkeypatch.setattr(LearnedAllocator, "_solve", broken)
    assert main(["check", str(tmp_path)]) == 1
    shown = capsys.readouterr().out
    assert "FAILED own answers" in shown and "nan" in shown and "do not use this bundle" in shown
    with pytest.raises(AllocationError, match="answer with NaN"):
        parse_robot(bundle.files).allocate([1, 0, 0, 0, 0, 0])


def test_check_notices_fins_that_the_networks_do_not_know(
    robot: Robot, capsys: pytest.CaptureFixture[str]
) -> None:
    """As a bundle might say that an earlier finlab wrote: the surrogate's word alone is 2e-8."""
    fins = [replace(fin, model=FinModelSpec("lighthill")) for fin in robot.layout.fins]
    layout = replace(robot.layout, fins=tuple(fins))
    other = Robot(replace(robot.graph, layout=layout), robot.allocator)
    findings = {finding.question: finding for finding in self_check(other)}
    assert findings["fins that the networks have not learned"].value == 4
    assert not findings["fins that the networks have not learned"].good
    assert findings["own answers, more error than stored (err_norm)"].good
    assert not findings["own answers, judged by the fins' own model (err_norm)"].good


def test_energy_weights_travel() -> None:
    layout = finlab.load_layout("octo")
    desk = finlab.load_allocator(energy_weights=POWER_WEIGHTS)
    robot = parse_robot(make_bundle(layout, desk).files)
    wrench = [1, 0, 0.5, 0, 0, 0.1]
    np.testing.assert_array_equal(robot.allocate(wrench).command, desk.allocate(layout, wrench).command)


def test_nothing_heavy_is_loaded(folder: Path) -> None:
    code = (
        "import sys\n"
        f"for name in {HEAVY!r}: sys.modules[name] = None\n"
        "from finlab.deploy.command import main\n"
        f"assert main(['check', {str(folder)!r}]) == 0\n"
        f"assert main(['allocate', {str(folder)!r}, '--fast', *{WRENCH!r}]) == 0\n"
        f"assert main(['speed', {str(folder)!r}, '--targets', '3']) == 0\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "learned, 4 fins: p50" in done.stdout


def test_command_allocates_and_checks(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(folder)]) == 0
    assert "this computer answers as the one that made the bundle" in capsys.readouterr().out
    assert main(["allocate", str(folder), *WRENCH, "--failed", "front_right", "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    layout = finlab.load_layout("A")
    truth = finlab.load_allocator().allocate(layout, [1, 0, 0.5, 0, 0, 0.1], failed=["front_right"])
    assert values["command"][0] is None and values["failed"] == ["front_right"] and values["notes"] == []
    np.testing.assert_allclose(values["command"][1:], truth.command[1:], atol=1e-9)
    np.testing.assert_allclose(values["wrench_plant"], truth.wrench, atol=1e-12)
    assert main(["allocate", str(folder), *WRENCH]) == 0
    assert "front_left" in capsys.readouterr().out
    assert main(["check", "nowhere"]) == 2
    assert capsys.readouterr().err.startswith("finlab-runtime: error: nowhere: cannot be read")
