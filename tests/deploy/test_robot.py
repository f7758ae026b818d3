"""A robot out of its bundle: the library's answers, and a self-check that notices what is wrong."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.deploy.bundle import Bundle, make_bundle
from finlab.deploy.deployed_robot import DeployedRobot, extremes, load_robot, parse_robot, self_check
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.layout.rudder import Rudder
from finlab.physics import plant_of
from tests.any_robot import FIN_ROBOTS, AnyRobot
from tests.exhaustive import sampled


@pytest.fixture(scope="module")
def robot(bundle: Bundle) -> DeployedRobot:
    return parse_robot(bundle.files)


def bad(robot: DeployedRobot) -> list[str]:
    """What its self-check complains about."""
    return [finding.question for finding in self_check(robot) if not finding.good]


def test_answer_says_what_is_missing(robot: DeployedRobot) -> None:
    answer = robot.allocate([1, 0, 0.5, 0, 0, 0.1], failed=["front_right"])
    assert answer.names == finlab.load_layout("A").names
    assert np.isnan(answer.command[0]).all() and not np.isnan(answer.command[1:]).any()
    np.testing.assert_allclose(answer.wrench + answer.unallocated, [1, 0, 0.5, 0, 0, 0.1], atol=1e-12)
    far = robot.allocate([90, 0, 0, 0, 0, 0], policy="direction")
    assert far.err_norm > 1 and abs(far.wrench[1]) < 0.1
    with pytest.raises(FinlabError, match="no fin 'nobody'"):
        robot.allocate([0] * 6, failed=["nobody"])


def test_failed_fins_of_the_bundle_stay_failed(shipped_allocator: AnyRobot) -> None:
    layout = finlab.load_layout("A")
    robot = parse_robot(make_bundle(shipped_allocator.on(layout), ("back_left",)).files)
    lost = layout.index("back_left")
    assert np.isnan(robot.allocate([0.5, 0, 0, 0, 0, 0]).command[lost]).all()
    assert np.isnan(robot.allocate([0.5, 0, 0, 0, 0, 0], failed=["front_left"]).command[lost]).all()
    assert np.isnan(robot.neutral()[lost]).all()
    assert all(finding.good for finding in self_check(robot))


@pytest.mark.parametrize("name", sampled(["measured", *sorted(FIN_ROBOTS)], every=4))
def test_every_shipped_layout_answers_as_the_library_to_the_last_bit(
    name: str, measured: Layout, tmp_path: Path
) -> None:
    """By its own physics, tables included; single, batched and from tick to tick."""
    layout = measured if name == "measured" else finlab.load_layout(name)
    desk = AnyRobot()
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
    batch, many = robot.allocator.allocate_batch(targets), desk.allocate_batch(layout, targets)
    np.testing.assert_array_equal(batch.command, many.command)
    assert (many.err_norm[:-1] < 1e-4).all()


def test_robots_of_any_actuators_are_exported_and_answer(tmp_path: Path) -> None:
    rudder = Rudder("tail", (-0.6, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.02, (-0.5, 0.5), 3.0)
    layout = Layout("hybrid", (*finlab.load_layout("turtle_hybrid").actuators, rudder))
    flow, wrench, desk = [0.8, 0, 0, 0, 0, 0], [2.0, 0, 5.0, 0, 0, 0.3], finlab.Allocator(layout)
    make_bundle(desk).write_zip(tmp_path / "x.zip")
    robot = load_robot(tmp_path / "x.zip")
    assert robot.layout == layout and not bad(robot)
    answer = robot.allocate(wrench, flow=flow)
    assert answer.err_norm < 1e-3 and answer.forces[-1].any()
    np.testing.assert_array_equal(answer.command, desk.allocate(wrench, flow=flow).command)
    wrench_there = plant_of(layout).wrench(answer.command, flow=np.array(flow))
    np.testing.assert_allclose(answer.wrench, wrench_there, atol=1e-12)


def test_extremes_name_the_one_that_has_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    layout, asked = finlab.load_layout("bluerov2"), []
    robot = DeployedRobot(finlab.Allocator(layout))
    healthy, lost = type(robot.allocator).allocate, layout.names[1]

    def broken(self: Any, wrench: Any, *, failed: Any, policy: str) -> Any:
        asked.append((tuple(np.sign(wrench)), policy, tuple(failed)))
        if policy == "priority" and wrench[5] < 0.0 and tuple(failed) == (lost,):
            raise IndexError("of a group")
        return healthy(self, wrench, failed=failed, policy=policy)

    assert extremes(robot).good
    monkeypatch.setattr(type(robot.allocator), "allocate", broken)
    found = extremes(robot)
    assert found.value == 1.0 and not found.good
    assert found.question.endswith(f"first priority -Tz, {lost} lost: IndexError: of a group")
    assert len(set(asked)) == len(asked) == 2 * layout.commanded.sum() * 3 * (1 + layout.n)
