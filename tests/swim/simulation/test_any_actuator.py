"""Robots of thrusters, azimuths, rudders and fins swim, and lose some of them."""

from dataclasses import replace

import numpy as np
import pytest

from finlab import Allocator, load_layout
from finlab.layout import Layout
from finlab.research.evaluation.experiments.hard_days import OTHER_HEAVY
from finlab.swim.control import FaultMonitor
from finlab.swim.simulation import NO_NOISE, ClosedLoop, Fault, RunLog, make_trajectory, straight
from tests.sampled_cases import crossed, sampled


@pytest.fixture(scope="module")
def heavy() -> Layout:
    """Eight thrusters."""
    return load_layout("bluerov2_heavy")


def rms_error(log: RunLog) -> float:
    """Root mean square of the distance from the path [m]."""
    return float(np.sqrt(np.square(log.position - log.reference).sum(axis=1).mean()))


@pytest.mark.parametrize(
    "name", sampled(["turtle_hybrid", "bluerov2", "mixed", "bluerov2_heavy"], every=2)
)
def test_robots_of_any_actuators_follow_a_path(name: str) -> None:
    robot = load_layout(name)
    log = ClosedLoop(robot, Allocator(robot), make_trajectory("circle"), seed=1).run()
    assert rms_error(log) < 0.06
    assert log.command.shape[1:] == log.fin_motion.shape[1:] == (robot.n, 3)


def test_a_torpedo_follows_a_path_at_speed() -> None:
    torpedo = load_layout("torpedo")
    log = ClosedLoop(torpedo, Allocator(torpedo), straight(20.0, 1.5), seed=1).run()
    assert log.motion[-1, 0] > 1.4 and rms_error(log) < 0.5


def test_thrusters_give_what_is_allocated_a_moment_later(heavy: Layout) -> None:
    loop = ClosedLoop(heavy, Allocator(heavy), make_trajectory("circle"), sensors=NO_NOISE)
    log = loop.run()
    late = log.allocated[150:-2] - log.delivered[151:-1]
    assert np.abs(late).max() < 0.1 * np.abs(log.allocated[150:]).max()


@pytest.mark.parametrize(
    ("kind", "announced"), crossed(["lost", "torn", "stuck"], [True, False], every=2)
)
def test_a_thruster_breaks_and_the_robot_keeps_its_path(
    heavy: Layout, kind: str, announced: bool
) -> None:
    fault = Fault(heavy.names[1], 15.0, kind)  # type: ignore[arg-type]
    loop = ClosedLoop(
        heavy,
        Allocator(heavy),
        make_trajectory("circle"),
        failures=[fault],
        announced=announced,
        seed=2,
    )
    assert rms_error(loop.run()) < 0.08


def test_a_loss_that_nobody_announced_costs_a_tenth_of_the_error_at_most(heavy: Layout) -> None:
    path = make_trajectory("lissajous")
    lost = Fault(heavy.names[0], 0.5 * path.duration_s)
    whole = ClosedLoop(heavy, Allocator(heavy), path, seed=0).run()
    loop = ClosedLoop(
        heavy, Allocator(heavy), path, failures=[lost], monitor=FaultMonitor(heavy), seed=0
    )
    assert rms_error(loop.run()) < 1.1 * rms_error(whole)
    assert loop.damage.lost == (lost.name,)


def test_a_body_that_is_less_damped_in_yaw_than_its_model_is_not_spun(heavy: Layout) -> None:
    truth = replace(heavy, body=OTHER_HEAVY)
    log = ClosedLoop(
        heavy, Allocator(heavy), make_trajectory("lissajous"), truth=truth, seed=0
    ).run()
    assert rms_error(log) < 0.06 and np.abs(log.motion[:, 5]).max() < 2.0


def test_a_torn_thruster_that_is_known_is_asked_for_more(heavy: Layout) -> None:
    loop = ClosedLoop(
        heavy,
        Allocator(heavy),
        make_trajectory("circle"),
        failures=[Fault(heavy.names[0], 0.0, "torn", 0.4)],
    )
    log = loop.run()
    late = log.asked[150:-2] - log.delivered[151:-1]
    assert np.abs(late[:, [0, 2, 5]]).mean() < 0.05 * np.abs(log.asked[150:]).max()


def test_a_rudder_that_is_torn_or_stuck_is_told_to_the_allocator() -> None:
    torpedo = load_layout("torpedo")
    path = make_trajectory("station")
    loop = ClosedLoop(
        torpedo, Allocator(torpedo), path, monitor=FaultMonitor(torpedo), announced=True
    )
    loop.fail("rudder_top", "torn", 0.5)
    assert loop.damage.torn == {"rudder_top": 0.5}
    assert loop.damage.applied_to(torpedo).actuators[1].area == pytest.approx(
        0.5 * torpedo.actuators[1].area
    )
    loop.fail("elevator_left", "stuck")
    assert loop.damage.lost == ("elevator_left",)
