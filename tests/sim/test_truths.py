"""What layouts do not say: jets, inflow, and a robot that is not built as drawn."""

import math

import numpy as np
import pytest

from finlab.layout import Layout, load_layout
from finlab.sim import ClosedLoop, make_trajectory
from finlab.sim.fin_force import MeanForce
from finlab.sim.inflow import InflowForce
from finlab.sim.offset import OffsetForce
from finlab.sim.wake import MOST, WakeForce
from finlab.vehicle.attitude import euler
from finlab.vehicle.fin_motion import FinMotion
from tests.any_robot import AnyRobot


@pytest.fixture(scope="module")
def robot() -> Layout:
    return load_layout("A")


def beating(layout: Layout, direction: float, amplitude: float = 0.5, frequency: float = 1.0) -> FinMotion:
    motion = FinMotion(layout)
    motion.amplitude[:], motion.frequency[:], motion.direction[:] = amplitude, frequency, direction
    return motion


def test_fins_behind_a_jet_lose_thrust_and_those_before_it_none(robot: Layout) -> None:
    motion = beating(robot, 0.0)
    motion.direction[:] = np.where(MeanForce(robot).effectiveness[:, 1, 0] > 0.0, 0.0, math.pi)
    plain = np.linalg.norm(MeanForce(robot).step(motion, 0.02), axis=1)
    left = np.linalg.norm(WakeForce(robot).step(motion, 0.02), axis=1) / plain
    behind = robot.position[:, 0] < 0.0  # all push ahead
    assert (left[~behind] > 0.98).all() and (left[behind] < 0.95).all()
    assert (left >= 1.0 - MOST).all()


def test_thrust_falls_with_the_speed_along_it(robot: Layout) -> None:
    motion, inflow = beating(robot, 0.0), InflowForce(robot)
    plain = MeanForce(robot).step(motion, 0.02)
    assert inflow.step(motion, 0.02) == pytest.approx(plain)
    water = np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    ahead = inflow.effectiveness[:, 1, 0]  # how much of the thrust is along x
    share = np.linalg.norm(inflow.step(motion, 0.02, water), axis=1) / np.linalg.norm(plain, axis=1)
    tip = 2 * math.pi * 1.0 * 0.5 * 0.2
    np.testing.assert_allclose(share, 1.0 - 0.4 * np.tanh(0.2 * ahead / tip), rtol=1e-9)
    turning = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    spun = np.linalg.norm(inflow.step(motion, 0.02, turning), axis=1) / np.linalg.norm(plain, axis=1)
    lever = inflow.effectiveness[:, 1, 5]  # yaw per newton is the fin's speed along its thrust per yaw rate
    np.testing.assert_allclose(spun, 1.0 - 0.4 * np.tanh(lever / tip), rtol=1e-9)


def test_a_robot_built_askew_feels_its_fins_elsewhere(robot: Layout) -> None:
    true, drawn = OffsetForce(robot), MeanForce(robot)
    motion = beating(robot, 0.7)
    np.testing.assert_array_equal(true.step(motion, 0.02), drawn.step(motion, 0.02))
    turn = np.einsum("nw,nw->n", true.effectiveness[:, 1, :3], drawn.effectiveness[:, 1, :3])
    np.testing.assert_allclose(np.degrees(np.arccos(turn)), 5.0, rtol=1e-6)
    # One newton upwards pitches about the true centre: 1.6 cm further behind, 1.2 cm to the left of it.
    np.testing.assert_allclose(
        true.effectiveness[:, 2, 3:5] - drawn.effectiveness[:, 2, 3:5],
        np.tile([-0.012, -0.016], (4, 1)),
        atol=1e-12,
    )


@pytest.mark.parametrize("name", ["wake", "inflow", "offset"])
def test_robots_stay_afoot_on_every_truth(name: str, robot: Layout) -> None:
    loop = ClosedLoop(robot, AnyRobot().on(robot), make_trajectory("circle"), plant=name)
    for _ in range(120):
        loop.step()
    assert np.abs(euler(loop.state[3:7])[:2]).max() < 0.3
    assert np.linalg.norm(loop.log.position[-1] - loop.log.reference[-1]) < 0.5
    given = loop.log.allocated - loop.log.delivered
    assert np.linalg.norm(given[60:].mean(axis=0)) > 0.01
