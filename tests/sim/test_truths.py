"""What layouts do not say: a robot that is not built as drawn."""

import numpy as np
import pytest

from finlab.layout import Layout, load_layout
from finlab.sim import ClosedLoop, make_trajectory
from finlab.sim.fin_force import MeanForce, OffsetForce
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


def test_a_robot_built_askew_stays_afoot(robot: Layout) -> None:
    loop = ClosedLoop(robot, AnyRobot().on(robot), make_trajectory("circle"), plant="offset")
    for _ in range(120):
        loop.step()
    assert np.abs(euler(loop.state[3:7])[:2]).max() < 0.3
    assert np.linalg.norm(loop.log.position[-1] - loop.log.reference[-1]) < 0.5
    given = loop.log.allocated - loop.log.delivered
    assert np.linalg.norm(given[60:].mean(axis=0)) > 0.01
