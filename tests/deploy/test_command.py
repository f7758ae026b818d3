"""What `finlab-runtime` prints and takes; the robot of a bundle, and its self-check."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.actuators.rudder import Rudder
from finlab.allocation.policy import POLICY_NAMES
from finlab.deploy import deployed_robot
from finlab.deploy.bundle import Bundle, make_bundle
from finlab.deploy.command import POLICIES, main
from finlab.deploy.deployed_robot import (
    DeployedRobot,
    extremes,
    load_robot,
    parse_robot,
    self_check,
)
from finlab.errors import FinlabError
from finlab.layout import Layout, save_layout
from finlab.physics import plant_of
from tests.allocator_cache import FIN_ROBOTS, AllocatorCache
from tests.sampled_cases import sampled

TARGET = [1.0, 0.0, 0.5, 0.0, 0.0, 0.1]
"""A wrench within reach of robot A: surge, heave and yaw [N, N m]."""
WRENCH_OPTIONS = ["--wrench", *map(str, TARGET)]
"""The same as options of the command."""
PACKAGES_NOT_ON_ROBOTS = (
    "torch",
    "scipy",
    "viser",
    "matplotlib",
    "yaml",
    "tyro",
    "tqdm",
    "threadpoolctl",
)
"""Packages that the robot's computer need not have."""


@pytest.fixture(scope="module")
def folder(bundle: Bundle, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bundle of robot A, unpacked."""
    path = tmp_path_factory.mktemp("bundle") / "A"
    bundle.write(path)
    return path


def test_nothing_heavy_is_loaded(folder: Path) -> None:
    code = (
        "import sys\n"
        f"for name in {PACKAGES_NOT_ON_ROBOTS!r}: sys.modules[name] = None\n"
        "from finlab.deploy.command import main\n"
        f"assert main(['check', {str(folder)!r}]) == 0\n"
        f"assert main(['allocate', {str(folder)!r}, *{WRENCH_OPTIONS!r}]) == 0\n"
        "import os; assert os.environ['OPENBLAS_NUM_THREADS'] == '1'\n"
    )
    environment = {
        name: value for name, value in os.environ.items() if not name.endswith("NUM_THREADS")
    }
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, env=environment
    )
    assert done.returncode == 0, done.stderr
    assert "this computer answers as the one that made the bundle" in done.stdout


def test_allocate_prints_a_table_or_one_object(folder: Path, capsys: Any) -> None:
    question = ["allocate", str(folder), *WRENCH_OPTIONS, "--lost", "back_left"]
    truth = finlab.Allocator(finlab.load_layout("A")).allocate(TARGET, lost=["back_left"])
    assert main([*question, "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    lost = shown["fins"].index("back_left")
    assert (
        shown["lost"] == ["back_left"]
        and shown["target"] == TARGET
        and shown["command"][lost] is None
    )
    kept = [row for row in shown["command"] if row is not None]
    np.testing.assert_array_equal(kept, np.delete(truth.command, lost, axis=0))
    assert (shown["power"], shown["wrench_plant"]) == (truth.power, truth.wrench.tolist())
    far = ["--wrench", "90", "0", "0", "0", "0", "0", "--policy", "direction"]
    assert main(["allocate", str(folder), *far, "--lost", "back_left"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:5] == ["actuator", "type", "command", "force", "[N]"], (
        "the table of the library"
    )
    assert lines[1 + lost].split() == ["back_left", "fin", "lost"]
    assert any(line.startswith("err_norm ") for line in lines)


def test_a_layout_file_is_refused_with_the_way_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("robot.yaml", "robot.json", "robot.txt"):
        save_layout(finlab.load_layout("A"), tmp_path / "robot.yaml")
        (tmp_path / name).write_bytes((tmp_path / "robot.yaml").read_bytes())
        assert main(["check", str(tmp_path / name)]) == 2
        told = capsys.readouterr().err
        assert (
            told.startswith(f"finlab-runtime: error: {tmp_path / name}: ") and told.count("\n") == 1
        )
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
def test_a_wrong_call_ends_with_usage_and_2(
    arguments: list[str], message: str, capsys: Any
) -> None:
    assert main(arguments) == 2
    told = capsys.readouterr().err
    assert told.startswith("usage: finlab-runtime ") and message in told


def test_the_choice_of_policies_is_that_of_the_library() -> None:
    assert POLICIES == POLICY_NAMES


def test_every_page_of_help_has_an_example(capsys: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "400")  # an example is not folded
    for verb in ([], ["check"], ["allocate"], ["serve"]):
        assert main([*verb, "--help"]) == 0
        assert "\nexample: " in capsys.readouterr().out


@pytest.fixture(scope="module")
def robot(bundle: Bundle) -> DeployedRobot:
    """The robot of the bundle."""
    return parse_robot(bundle.files)


def bad(robot: DeployedRobot) -> list[str]:
    """What its self-check complains about."""
    return [finding.question for finding in self_check(robot) if not finding.good]


def test_answer_says_what_is_missing(robot: DeployedRobot) -> None:
    answer = robot.allocate([1, 0, 0.5, 0, 0, 0.1], lost=["front_right"])
    assert answer.names == finlab.load_layout("A").names
    assert np.isnan(answer.command[0]).all() and not np.isnan(answer.command[1:]).any()
    np.testing.assert_allclose(
        answer.wrench + answer.unallocated, [1, 0, 0.5, 0, 0, 0.1], atol=1e-12
    )
    far = robot.allocate([90, 0, 0, 0, 0, 0], policy="direction")
    assert far.err_norm > 1 and abs(far.wrench[1]) < 0.1
    with pytest.raises(FinlabError, match="no fin 'nobody'"):
        robot.allocate([0] * 6, lost=["nobody"])


def test_what_is_lost_by_damage_is_no_broken_bundle(shipped_allocator: AllocatorCache) -> None:
    robot = DeployedRobot(shipped_allocator.on(finlab.load_layout("A")))
    wrench = [0.5, 0, 0.2, 0, 0, 0.05]
    answer = robot.allocate(wrench, damage=finlab.Damage(lost=["back_left"]))
    expected = robot.allocate(wrench, lost=["back_left"])
    np.testing.assert_array_equal(answer.command, expected.command)
    assert np.isnan(answer.command[robot.layout.index("back_left")]).all()


def test_lost_fins_of_the_bundle_stay_lost(shipped_allocator: AllocatorCache) -> None:
    layout = finlab.load_layout("A")
    robot = parse_robot(make_bundle(shipped_allocator.on(layout), ("back_left",)).files)
    lost = layout.index("back_left")
    assert np.isnan(robot.allocate([0.5, 0, 0, 0, 0, 0]).command[lost]).all()
    assert np.isnan(robot.allocate([0.5, 0, 0, 0, 0, 0], lost=["front_left"]).command[lost]).all()
    assert np.isnan(robot.neutral()[lost]).all()
    assert all(finding.good for finding in self_check(robot))


@pytest.mark.parametrize("name", sampled(["measured", *sorted(FIN_ROBOTS)], every=4))
def test_every_shipped_layout_answers_as_the_library_to_the_last_bit(
    name: str, measured: Layout, tmp_path: Path
) -> None:
    """By its own physics, tables included; single, batched and from tick to tick."""
    layout = measured if name == "measured" else finlab.load_layout(name)
    desk = AllocatorCache()
    make_bundle(desk.on(layout)).write_zip(tmp_path / "x.zip")
    robot = load_robot(tmp_path / "x.zip")
    assert not bad(robot)
    targets = plant_of(layout).wrench(plant_of(layout).sample(np.random.default_rng(7), (6,)))
    targets[-1] *= 20.0  # out of reach
    previous = None
    for target in targets:
        truth = desk.allocate(layout, target, previous=previous)
        answer = robot.allocate(target, previous=previous)
        for field in ("command", "wrench", "forces", "err_norm", "effort", "power"):
            np.testing.assert_array_equal(getattr(answer, field), getattr(truth, field), field)
        assert answer.notes == truth.notes
        previous = truth.command
    batch = robot.allocator.allocate_batch(targets)
    many = desk.allocate_batch(layout, targets)
    np.testing.assert_array_equal(batch.command, many.command)
    assert (many.err_norm[:-1] < 1e-4).all()


def test_robots_of_any_actuators_are_exported_and_answer(tmp_path: Path) -> None:
    rudder = Rudder(
        "tail", (-0.6, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.02, (-0.5, 0.5), 3.0
    )
    layout = Layout("hybrid", (*finlab.load_layout("turtle_hybrid").actuators, rudder))
    flow = [0.8, 0, 0, 0, 0, 0]
    wrench = [2.0, 0, 5.0, 0, 0, 0.3]
    desk = finlab.Allocator(layout)
    make_bundle(desk).write_zip(tmp_path / "x.zip")
    robot = load_robot(tmp_path / "x.zip")
    assert robot.layout == layout and not bad(robot)
    answer = robot.allocate(wrench, flow=flow)
    assert answer.err_norm < 1e-3 and answer.forces[-1].any()
    np.testing.assert_array_equal(answer.command, desk.allocate(wrench, flow=flow).command)
    wrench_there = plant_of(layout).wrench(answer.command, flow=np.array(flow))
    np.testing.assert_allclose(answer.wrench, wrench_there, atol=1e-12)


def test_extremes_name_the_one_that_has_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = finlab.load_layout("bluerov2")
    asked = []
    robot = DeployedRobot(finlab.Allocator(layout))
    healthy = type(robot.allocator).allocate
    second = layout.names[1]

    def broken(self: Any, wrench: Any, *, lost: Any, policy: str) -> Any:
        asked.append((tuple(np.sign(wrench)), policy, tuple(lost)))
        if policy == "priority" and wrench[5] < 0.0 and tuple(lost) == (second,):
            raise IndexError("of a group")
        return healthy(self, wrench, lost=lost, policy=policy)

    assert extremes(robot).good
    monkeypatch.setattr(type(robot.allocator), "allocate", broken)
    found = extremes(robot)
    assert found.value == 1.0 and not found.good
    assert found.question.endswith(f"first priority -Tz, {second} lost: IndexError: of a group")
    assert (
        len(set(asked))
        == len(asked)
        == 2 * layout.commanded.sum() * len(POLICY_NAMES) * (1 + layout.n)
    )
