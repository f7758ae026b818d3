"""Numbers that the core is given once, against what they stand for."""

import math

import numpy as np
import pytest

from finlab.allocation.dual.robot import POINTS, gauge_numbers
from finlab.arrays import Array
from tests.any_robot import AnyRobot
from tests.mixed_robots import T200, T200_FORCE, bluerov2_heavy, load

DENSE = np.linspace(0.0, 2.0 * math.pi, 200_001)


def uneven(direction: Array) -> Array:
    """A gauge of forces in all directions, smooth and convex."""
    return 1.0 + 0.15 * np.cos(direction - 0.4) + 0.02 * np.sin(2.0 * direction)


def test_the_support_function_of_a_gauge_and_its_derivative() -> None:
    count = 360
    gauge = uneven(np.arange(count) * 2.0 * math.pi / count)
    deflection = np.linspace(-1.0, 1.0, POINTS)
    numbers = gauge_numbers(gauge, deflection)
    assert numbers[0] == POINTS
    support, slope, own, kept = numbers[1:].reshape(POINTS, 4).T
    for place, angle in enumerate(np.arange(POINTS) * 2.0 * math.pi / POINTS):
        # h(angle) = max over psi of rho(psi) cos(angle - psi); h' = -rho sin(angle - psi) at the best psi.
        worth = uneven(DENSE) * np.cos(angle - DENSE)
        best = int(worth.argmax())
        assert support[place] == pytest.approx(worth[best], abs=1e-6)
        derivative = -uneven(DENSE[best]) * math.sin(angle - DENSE[best])
        assert slope[place] == pytest.approx(derivative, abs=1e-4)
        assert own[place] == pytest.approx(float(uneven(np.array(angle))), abs=2e-5)
    np.testing.assert_array_equal(kept, deflection)


def test_the_largest_power_is_that_of_all_thrusters_at_their_dearer_end() -> None:
    robot = AnyRobot().method(load(bluerov2_heavy())).compiled.robot
    dearer = max(T200["forward"] * T200_FORCE[1] ** 1.5, T200["reverse"] * abs(T200_FORCE[0]) ** 1.5)
    assert robot.largest_power == pytest.approx(8.0 * dearer, rel=1e-3)
