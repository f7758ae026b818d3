"""Which of the wrenches that are expected is answered."""

from dataclasses import replace

import numpy as np
import pytest

from finlab import load_layout
from finlab.allocation import Allocator
from finlab.arrays import Array
from finlab.errors import CommandError
from finlab.evaluation.method_specs import load_method_spec
from finlab.layout import Layout, Servo
from finlab.vehicle.fin_motion import LagStep

PERIOD_S = 0.1
RISING = np.outer(np.arange(1.0, 41.0), [1.0, 0.0, 0.5, 0.0, 0.0, 0.1])
"""What is asked for grows by a newton a tick."""


def in_time(robot: Layout, target: Array, reference: Array) -> Array:
    return Allocator(robot)._whole.method.in_time(target, reference)


def with_pole(pole: float) -> Layout:
    robot = load_layout("A")
    slow = replace(robot.fins[0], servo=Servo(direction_pole=pole))
    return replace(robot, actuators=(slow, *robot.fins[1:]))


@pytest.mark.parametrize("pole", [1.0, 2.0, 3.5])
def test_it_is_the_one_that_the_slowest_fin_is_in_time_for(pole: float) -> None:
    """A filter that follows a ramp lags by what is looked ahead: what it gives is then what is asked for."""
    asked = in_time(with_pole(pole), np.zeros(6), RISING)[0]
    lag, value, rate = LagStep.of(np.array([pole]), PERIOD_S), np.zeros(1), np.zeros(1)
    for tick in range(200):
        value, rate = lag.follow(value, rate, np.array([tick + asked]))
    # Between the ends of the last period, in the middle of the steps that the command takes.
    assert 200.0 - 1.0 < value[0] < 200.0


def test_after_the_last_wrench_comes_the_last() -> None:
    robot = with_pole(3.5)
    np.testing.assert_array_equal(in_time(robot, np.zeros(6), RISING[:2]), RISING[1])
    np.testing.assert_array_equal(in_time(robot, np.ones(6), RISING[:0]), np.ones(6))


def test_the_default_method_answers_it_and_others_answer_the_present() -> None:
    robot, now, later = load_layout("A"), np.array([1.0, 0, 0.5, 0, 0, 0]), [[3.0, 0, 0, 0, 0, 0]] * 9
    for name, answered in (("dual", later[0]), ("analytic", now)):
        result = load_method_spec(name).on(robot).allocate(now, reference=later)
        np.testing.assert_array_equal(result.target, answered)
        np.testing.assert_allclose(result.wrench, answered, atol=1e-3)
    slower = Allocator(robot, period_s=0.4).allocate(now, reference=[[2.0, 0, 0, 0, 0, 0], *later])
    assert 2.0 < slower.target[0] < 3.0, "by then hardly two ticks have gone by"


def test_what_cannot_be_expected_is_named() -> None:
    with pytest.raises(CommandError, match=r"^reference: expected an array of shape \(N, 6\)"):
        Allocator(load_layout("A")).allocate(np.zeros(6), reference=np.zeros(6))
