"""Forces of propellers with a rudder by direction in the core, beside searches over the
deflections of their law in Python."""

import math

import numpy as np
import pytest

from finlab.actuators.propeller_rudder import SteeredLaw
from finlab.arrays import Array
from finlab.layout.layout import Layout
from tests.core.internal_functions import REAL, STEERED, Robot, at, functions, robot_of

DEFLECTIONS = 200_001
"""Deflections of a search."""
MARGIN = 2e-4
"""Angle [rad] by which the core's curve goes on beyond the ends of the arc."""


def curve_of(layout: Layout, i: int) -> tuple[Array, Array]:
    """Deflections [rad] of one of them within its limits, and g (K, 2) there."""
    unit = layout.actuators[i]
    deflection = np.linspace(unit.deflection[0] - MARGIN, unit.deflection[1] + MARGIN, DEFLECTIONS)
    g, _ = SteeredLaw([unit]).direction(deflection[:, None])
    return deflection, g[:, 0]


def steered_of(robot: Robot) -> list[int]:
    """Which actuators of a robot are propellers with a rudder."""
    return np.flatnonzero(robot.actuators["command_kind"] == STEERED).tolist()


@pytest.mark.parametrize("number", range(2))
def test_the_support_is_that_of_the_law(number: int) -> None:
    """The largest s.g of all deflections, and the g that gives it."""
    robot = robot_of("slipstreams", number)
    rng = np.random.default_rng(number)
    for i in steered_of(robot):
        _, g = curve_of(robot.layout, i)
        for price in rng.uniform(-1.5, 1.5, 12):
            x = math.cos(price)
            y = math.sin(price)
            told = functions().fl_steered_support(at(robot.block), i, REAL(x), REAL(y))
            worth = g @ [x, y]
            best = g[int(worth.argmax())]
            assert told.value == pytest.approx(float(worth.max()), rel=1e-7)
            assert told.slope == pytest.approx(float(best @ [-y, x]), abs=1e-5)


@pytest.mark.parametrize("number", range(2))
def test_the_bend_is_the_derivative_of_the_slope(number: int) -> None:
    robot = robot_of("slipstreams", number)
    step = 1e-4
    for i in steered_of(robot):
        for price in (-0.05, 0.02, 0.06):
            slopes = []
            for angle in (price - step, price + step):
                told = functions().fl_steered_support(
                    at(robot.block), i, REAL(math.cos(angle)), REAL(math.sin(angle))
                )
                slopes.append(told.slope)
            middle = functions().fl_steered_support(
                at(robot.block), i, REAL(math.cos(price)), REAL(math.sin(price))
            )
            assert middle.bend == pytest.approx((slopes[1] - slopes[0]) / (2.0 * step), rel=1e-3)


@pytest.mark.parametrize("number", range(2))
def test_a_direction_has_its_deflection_and_size(number: int) -> None:
    """Beyond the ends of the arc those of the nearer end."""
    robot = robot_of("slipstreams", number)
    rng = np.random.default_rng(number)
    for i in steered_of(robot):
        deflection, g = curve_of(robot.layout, i)
        angle = np.arctan2(g[:, 1], g[:, 0])
        for direction in rng.uniform(1.3 * angle[0], 1.3 * angle[-1], 12):
            row = at(robot.block), i, REAL(direction)
            wanted = float(np.interp(direction, angle, deflection))
            size = float(np.interp(direction, angle, np.hypot(g[:, 0], g[:, 1])))
            assert functions().fl_steered_deflection(*row) == pytest.approx(wanted, abs=1e-7)
            assert functions().fl_steered_radius(*row) == pytest.approx(size, rel=1e-7)
