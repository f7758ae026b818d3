"""Where the model expects the robot to go, against the simulated body, and its slopes against
differences."""

import numpy as np

from finlab.layout import Layout
from finlab.swim.control.motion_model import FIRST_FIN, MotionModel
from finlab.swim.vehicle.attitude import euler
from finlab.swim.vehicle.fossen import complete_body
from finlab.swim.vehicle.vehicle import Vehicle


def test_the_model_goes_where_the_vehicle_goes_and_its_slopes_are_its_own(layout_a: Layout) -> None:
    """Period by period in a current, against the simulated body; slopes by differences, Munk's
    moments among them: that of water that sinks past a robot under way is the largest of all."""
    vehicle = Vehicle(complete_body(layout_a), (0.05, -0.03, 0.0))
    model = MotionModel(layout_a, 0.1)
    body = np.array([0.0, 0.0, 0.0, 1.0, *np.zeros(9)])
    z = np.zeros(FIRST_FIN + 4)
    z[FIRST_FIN:] = 1.0
    z[8:10] = (0.05, -0.03)
    command = np.array([[0.5, 1.0, 0.1], [0.5, 1.0, 3.0], [0.5, 1.05, 3.1], [0.5, 1.0, 0.0]])
    free = np.full(4, np.nan)
    for _ in range(50):
        wrench, _ = model._wrenches(command, free, free, np.zeros(6))
        for _ in range(5):
            body = vehicle.step(body, wrench.sum(axis=0).tolist(), 0.02)
        w, x, y, q = body[3:7]
        yaw = float(np.arctan2(2 * (w * q + x * y), 1 - 2 * (y * y + q * q)))
        model._wrenches = lambda *_, wrench=wrench: (wrench, 0.0 * wrench)  # type: ignore[method-assign]
        before = z.copy()
        after = model.step(before, yaw, command, free, free).state
        np.testing.assert_allclose(after[:6], body[7:], atol=5e-3)  # half of the gyro's noise
        z[:8] = *body[7:], *euler(body[3:7])[:2]
        del model._wrenches
    model._wrenches = lambda *_: (wrench, 0.0 * wrench)  # type: ignore[method-assign]
    step = model.step(before, yaw, command, free, free)
    assert abs(step.transition[4, 10]) > 0.05, "the case has no moment of Munk's worth the name"
    for column in range(FIRST_FIN + 4):
        moved = before.copy()
        moved[column] += 1e-4
        slope = (model.step(moved, yaw, command, free, free).state - step.state) / 1e-4
        np.testing.assert_allclose(
            step.transition[:, column], slope, 0.2, 0.03, err_msg=f"{column}"
        )


def test_a_fin_that_is_told_to_turn_about_may_go_either_way(layout_a: Layout) -> None:
    """For a second its force may be the opposite of what is expected."""
    model = MotionModel(layout_a, 0.1)
    free = np.full(4, np.nan)
    z = np.zeros(FIRST_FIN + 4)
    z[FIRST_FIN:] = 1.0
    ahead = np.tile([0.5, 1.5, 0.0], (4, 1))
    for _ in range(20):
        step = model.step(z, 0.0, ahead, free, free)
    assert step.turn_about_covariance is None and not model.is_turning_about.any()
    about = ahead.copy()
    about[1, 2] = 3.1
    step = model.step(z, 0.0, about, free, free)
    assert model.is_turning_about.tolist() == [False, True, False, False]
    assert step.turn_about_covariance is not None
    wrench, _ = model._wrenches(about, free, free, z[:6])
    np.testing.assert_array_less(
        np.abs(0.1 * wrench[1] / model.inertia),
        np.sqrt(np.diag(step.turn_about_covariance)) + 1e-12,
    )
    for _ in range(15):
        step = model.step(z, 0.0, about, free, free)
    assert step.turn_about_covariance is None and not model.is_turning_about.any()
