"""What a path will take, as the controller tells it ahead."""

import numpy as np
import pytest

from finlab import load_layout
from finlab.control.feed_forward import wrenches_along
from finlab.control.observer import MotionObserver
from finlab.evaluation.method_specs import load_method_spec
from finlab.sim import ClosedLoop, make_trajectory
from finlab.vehicle.attitude import quaternion_of
from finlab.vehicle.fossen import complete_body
from finlab.vehicle.vehicle import Vehicle


def test_a_body_that_is_given_it_follows_a_path_of_changing_speed() -> None:
    """Straight ahead from rest, the wrenches move the whole body model by the path's length."""
    robot, path = load_layout("A"), make_trajectory("dive")
    times = np.arange(0.0, 12.0, 0.1)
    flat = [path.setpoint(float(t)) for t in times]
    flat = [
        s._replace(velocity=s.velocity * [1, 1, 0], acceleration=s.acceleration * [1, 1, 0]) for s in flat
    ]
    along = wrenches_along(MotionObserver(robot, 0.1), flat, np.zeros(2), 0.08, 0.1)
    vehicle, state = Vehicle(complete_body(robot)), np.zeros(13)
    state[3:7] = quaternion_of(0.0, 0.0, 0.0)
    for wrench in along:
        for _ in range(5):
            state = vehicle.step(state, wrench.tolist(), 0.02)
    assert state[0] == pytest.approx(path.position(12.0)[0], rel=0.03)


def test_fins_that_turn_before_the_wrench_comes_keep_nearer_to_a_square() -> None:
    robot, error = load_layout("A"), {}
    for name in ("analytic", "dual"):
        log = ClosedLoop(robot, load_method_spec(name).on(robot), make_trajectory("square"), seed=3).run()
        error[name] = np.sqrt(np.square(log.position - log.reference).sum(axis=1).mean())
    assert error["dual"] < 0.93 * error["analytic"]
