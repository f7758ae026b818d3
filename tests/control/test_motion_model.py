"""Where the model expects the robot to go, against the simulated body, and its slopes against differences."""

import numpy as np
import pytest

from finlab.control.motion_model import FIRST_FIN, MotionModel
from finlab.layout import Layout
from finlab.physics.vehicle import Vehicle, complete_body, euler


def test_the_model_goes_where_the_vehicle_goes_and_its_slopes_are_its_own(layout_a: Layout) -> None:
    """Period by period in a current, against the simulated body; slopes by differences, on a straight way:
    couplings between axes and Munk's moments are left out of them."""
    vehicle = Vehicle(complete_body(layout_a), (0.05, -0.03, 0.0))
    model = MotionModel(layout_a, None, 0.1)
    body = np.array([0.0, 0.0, 0.0, 1.0, *np.zeros(9)])
    z = np.zeros(FIRST_FIN + 4)
    z[FIRST_FIN:], z[8:10] = 1.0, (0.05, -0.03)
    command = np.array([[0.5, 1.0, 0.1], [0.5, 1.0, 3.0], [0.5, 1.05, 3.1], [0.5, 1.0, 0.0]])
    free = np.full(4, np.nan)
    for _ in range(50):
        wrench, _ = model._wrenches(command, None, free, free)
        for _ in range(5):
            body = vehicle.step(body, wrench.sum(axis=0).tolist(), 0.02)
        w, x, y, q = body[3:7]
        yaw = float(np.arctan2(2 * (w * q + x * y), 1 - 2 * (y * y + q * q)))
        model._wrenches = lambda *_, wrench=wrench: (wrench, 0.0 * wrench)  # type: ignore[method-assign]
        before = z.copy()
        after = model.step(before, yaw, command, None, free, free).state
        np.testing.assert_allclose(after[:6], body[7:], atol=5e-3)  # half of the gyro's noise
        z[:8] = *body[7:], *euler(body[3:7])[:2]
        del model._wrenches
    model._wrenches = lambda *_: (wrench, 0.0 * wrench)  # type: ignore[method-assign]
    step = model.step(before, yaw, command, None, free, free)
    for column in (0, 1, 2, 3, 5, 6, 8, 9, 11, 13, 14, 17):
        moved = before.copy()
        moved[column] += 1e-4
        slope = (model.step(moved, yaw, command, None, free, free).state - step.state) / 1e-4
        rows = [column] if column < 8 else range(3) if column < 11 else range(FIRST_FIN + 4)
        np.testing.assert_allclose(step.transition[rows, column], slope[rows], atol=0.03)


def test_reported_motion_replaces_what_is_expected(layout_a: Layout) -> None:
    model, free = MotionModel(layout_a, None, 0.1), np.full(4, np.nan)
    command = np.tile([0.5, 1.5, 0.0], (4, 1))
    reported = np.full((4, 3), np.nan)
    reported[2] = 0.0, 0.0, 0.0
    for _ in range(20):
        wrench, turned = model._wrenches(command, reported, free, np.full(4, np.pi))
    assert (wrench[2] == 0.0).all() and np.linalg.norm(wrench[1]) > 1.0
    assert turned[1] == pytest.approx(-2.0 * wrench[1], rel=1e-6), "about face, the force is the opposite"
