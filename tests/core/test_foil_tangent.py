"""A foil near to a command in the core: beside the plant's own law, by differences."""

import ctypes

import numpy as np
import pytest

from finlab.arrays import Array
from tests.core.internal_functions import REAL, Robot, Set, Tangent, at, functions, robot_of
from tests.core.test_foil_drag import stalling_robot

STEP = 1e-6
"""Of differences [rad]."""
NUMBERS = range(4)


def foils_of(robot: Robot) -> list[int]:
    """Which actuators are foils in a flow."""
    return [int(i) for i in np.flatnonzero(robot.actuators["flow_speed"] > 0.0)]


def tangent_at(robot: Robot, i: int, angle: float) -> Tangent:
    """The tangent of a foil at an angle [rad]."""
    tangent = Tangent()
    functions().fl_foil_at(at(robot.block), i, REAL(angle), ctypes.byref(tangent))
    return tangent


def angles_of(robot: Robot, i: int, rng: np.random.Generator, count: int) -> Array:
    """Angles (count,) [rad] within the limits of a foil."""
    own = robot.actuators[i]
    return np.asarray(rng.uniform(own["command_min"][0], own["command_max"][0], count))


@pytest.mark.parametrize("number", NUMBERS)
def test_forces_and_cost_at_an_angle_are_those_of_the_plant(number: int) -> None:
    """Lift, the drag beyond that at rest, and the power that the whole drag takes from the flow."""
    robot = stalling_robot(number)
    rng = np.random.default_rng(number)
    for i in foils_of(robot):
        own = robot.actuators[i]
        own["uncertainty_cost"] = 0.0
        at_rest = own["pressure_area"] * own["zero_lift_drag"]
        for angle in angles_of(robot, i, rng, 10):
            command = robot.plant.lower.copy()
            command[i, 0] = angle
            own_force = robot.plant.force(command)[i]
            tangent = tangent_at(robot, i, angle)
            whole = robot.axes[i].T @ [tangent.force[0], tangent.force[1] + at_rest, 0.0]
            largest = float(np.abs(own["row_force_max"]).max())
            np.testing.assert_allclose(whole, own_force, atol=2e-4 * largest)
            drag = tangent.force[1] + at_rest
            assert tangent.cost == pytest.approx(own["flow_speed"] * drag)
            power = robot.plant.power(command)[i]
            assert tangent.cost == pytest.approx(power, abs=2e-4 * own["flow_speed"] * largest)


@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize("uncertain", [0.0, 0.3])
def test_slopes_at_an_angle_are_those_of_differences(number: int, uncertain: float) -> None:
    robot = stalling_robot(number)
    rng = np.random.default_rng(10 + number)
    for i in foils_of(robot):
        own = robot.actuators[i]
        own["uncertainty_cost"] = uncertain
        at_rest = own["pressure_area"] * own["zero_lift_drag"]
        size = float(own["pressure_area"])
        for angle in angles_of(robot, i, rng, 10):
            tangent = tangent_at(robot, i, angle)
            ahead, back = (tangent_at(robot, i, angle + step) for step in (STEP, -STEP))
            for k in range(2):
                slope = (ahead.force[k] - back.force[k]) / (2.0 * STEP)
                assert tangent.force_slope[k] == pytest.approx(slope, abs=1e-3 * size)
            slope = (ahead.cost - back.cost) / (2.0 * STEP)
            scale = size * (float(own["flow_speed"]) + uncertain * size)
            assert tangent.cost_slope == pytest.approx(slope, abs=1e-3 * scale)
            # What an uncertain force costs: its square, of lift and of the whole drag.
            lift, drag = tangent.force[0], tangent.force[1] + at_rest
            squared = uncertain * (lift**2 + drag**2)
            assert tangent.cost == pytest.approx(own["flow_speed"] * drag + squared)
        own["uncertainty_cost"] = 0.0


@pytest.mark.parametrize("number", NUMBERS)
def test_a_tangent_is_curved_as_its_cost_less_the_worth_of_its_force(number: int) -> None:
    """And its set turns by a quarter of the range at most, within the limits."""
    robot = stalling_robot(number)
    rng = np.random.default_rng(20 + number)
    box = robot.whole_box()
    for i in foils_of(robot):
        own = robot.actuators[i]
        low, high = (float(own[name][0]) for name in ("command_min", "command_max"))
        for angle in [low, high, *angles_of(robot, i, rng, 8)]:
            price = rng.normal(size=2) * own["flow_speed"]
            tangent = Tangent()
            limits = Set()
            drawn = (REAL(angle), at(price), ctypes.byref(tangent), ctypes.byref(limits))
            functions().fl_draw_tangent(at(robot.block), i, ctypes.byref(box), *drawn)
            known = tangent_at(robot, i, angle)
            assert tangent.cost == known.cost and tangent.force[:] == known.force[:]
            assert limits.tangent == ctypes.addressof(tangent)

            def slope_at(turned: float, i: int = i, price: Array = price) -> float:
                """Slope of the cost less the worth of the force."""
                there = tangent_at(robot, i, turned)
                return float(there.cost_slope - price @ np.array(there.force_slope))

            step = 1e-4 * (high - low)
            bend = abs(slope_at(angle + step) - slope_at(angle)) / step
            least = 1e-4 * own["flow_speed"] * own["pressure_area"]
            assert tangent.curvature == pytest.approx(max(bend, least), rel=1e-6)
            quarter = 0.25 * (high - low)
            assert limits.force_min == pytest.approx(max(low - angle, -quarter))
            assert limits.force_max == pytest.approx(min(high - angle, quarter))
            # No step within the set costs more than is said of its ends.
            turn = np.linspace(limits.force_min, limits.force_max, 9)
            cost = tangent.cost + tangent.cost_slope * turn + tangent.curvature * turn**2 / 2.0
            assert limits.cost_at_min == limits.cost_at_max >= cost.max() * (1.0 - 1e-12)


def test_the_last_lift_of_a_table_is_where_the_foil_stalls() -> None:
    robot = robot_of("rudders", 1)
    lift_end = functions().fl_lift_end
    lift_end.restype = ctypes.POINTER(ctypes.c_double)
    for i in foils_of(robot):
        curve = robot.table(robot.actuators[i]["command_table"])
        points = curve[1 : 1 + 2 * int(curve[0])].reshape(-1, 2)
        actuator = robot.actuators[i : i + 1]
        lift, angle = lift_end(at(robot.block), ctypes.c_void_p(actuator.ctypes.data))[:2]
        assert (lift, angle) == tuple(points[-1])
        # It is the largest, and at an angle of attack just there the law gives it.
        assert lift == points[:, 0].max()
        stalled = tangent_at(robot, i, float(robot.actuators[i]["zero_lift_angle"] + angle))
        expected = lift * robot.actuators[i]["pressure_area"]
        assert abs(stalled.force[0]) == pytest.approx(expected, rel=1e-3)
