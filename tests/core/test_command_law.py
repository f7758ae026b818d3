"""Laws of actuators in the core: forces and power as the plant says, slopes as differences say,
commands that give forces back, and ranges of forces that hold what commands give and no more."""

import ctypes
import math

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from finlab.actuators.hermite_grid import grid_numbers
from finlab.arrays import Array
from finlab.core.fields import actuators_of, numbers_of, struct, tables_begin
from tests.core.internal_functions import (
    EITHER_WAY,
    FIN,
    MOST,
    POD,
    ROBOTS,
    STEERED,
    Box,
    Robot,
    at,
    functions,
    robot_of,
)

STEP = 1e-6
"""Of differences."""


def commands_of(robot: Robot, i: int, rng: np.random.Generator, count: int) -> Array:
    """Commands (count, 3) of an actuator within its limits."""
    actuator = robot.actuators[i]
    lower: Array = actuator["command_min"]
    return np.asarray(lower + rng.random((count, 3)) * (actuator["command_max"] - lower))


def own_axes(robot: Robot, i: int, force: Array) -> Array:
    """A force (3,) of the core in the actuator's own axes, with what comes at no force of its row."""
    actuator = robot.actuators[i]
    told = force.copy()
    told[1] += actuator["pressure_area"] * actuator["zero_lift_drag"]
    return np.asarray(told @ robot.axes[i])


@pytest.mark.parametrize("name", ROBOTS)
def test_forces_are_those_of_the_plant(name: str) -> None:
    for number in range(2):
        robot = robot_of(name, number)
        rng = np.random.default_rng(number)
        for _ in range(20):
            command = np.stack([commands_of(robot, i, rng, 1)[0] for i in range(robot.n)])
            force_of_core = np.stack(
                [own_axes(robot, i, robot.force(i, command[i])[0]) for i in range(robot.n)]
            )
            # Where the law is below a dead band it gives nothing; the core asks for that elsewhere.
            held = np.abs(robot.plant.force(command)).max(axis=1) > 0.0
            most = robot.actuators["row_force_max"].max(axis=1)[:, None]
            error = np.abs(force_of_core - robot.plant.force(command)) / most
            assert error[held].max(initial=0.0) <= 1e-4


@pytest.mark.parametrize("name", ROBOTS)
def test_slopes_of_forces_are_those_of_differences(name: str) -> None:
    rng = np.random.default_rng(1)
    robot = robot_of(name)
    for i in range(robot.n):
        most = robot.actuators[i]["row_force_max"].max()
        for command in commands_of(robot, i, rng, 30):
            _, slope = robot.force(i, command)
            for c in range(3):
                change = STEP * np.eye(3)[c]
                ahead = robot.force(i, command + change)[0]
                back = robot.force(i, command - change)[0]
                np.testing.assert_allclose(
                    slope[c] / most, (ahead - back) / (2 * STEP * most), atol=1e-4
                )


def test_slopes_of_uneven_fins_that_are_commanded_by_force() -> None:
    """While turns are taken, fins are commanded by direction and size of their force, along a
    gauge."""
    robot = robot_of("fins uneven")
    step = 1e-3  # over which the core takes the derivative of a gauge
    rng = np.random.default_rng(2)
    for i in range(robot.n):
        actuator = robot.actuators[i]
        assert actuator["gauge_table"] > 0.0
        actuator["command_kind"] = POD
        for _ in range(20):
            command = np.array(
                [rng.uniform(-3.0, 3.0), actuator["row_force_max"][0] * rng.random(), 0.0]
            )
            force, slope = robot.force(i, command)
            radius = robot.radius(i, command[0])
            direction = np.array([0.0, math.cos(command[0]), math.sin(command[0])])
            np.testing.assert_allclose(force, command[1] * radius * direction, rtol=1e-12)
            for c, change in enumerate((step, 1e-6 * actuator["row_force_max"][0])):
                near = change * np.eye(3)[c]
                ahead = robot.force(i, command + near)[0]
                back = robot.force(i, command - near)[0]
                atol = 1e-5 * actuator["row_force_max"][0]
                np.testing.assert_allclose(
                    slope[c] * change, (ahead - back) / 2.0, atol=atol * change
                )
        actuator["command_kind"] = FIN


@pytest.mark.parametrize("period", [0.0, 5.0])
@pytest.mark.parametrize("is_product", [False, True])
@pytest.mark.parametrize("is_root", [False, True])
def test_a_grid_of_uneven_knots_is_a_cubic_of_each_axis(
    period: float, is_product: bool, is_root: bool
) -> None:
    """Beside scipy's splines with the slopes of Catmull and Rom, one axis after the other, edges
    held."""
    rng = np.random.default_rng(3)
    knots = [np.cumsum(rng.uniform(0.2, 1.0, count)) for count in (4, 5, 6)]
    knots[2] *= 4.0 / knots[2][-1]
    values = rng.uniform(0.5, 2.0, (4, 5, 6, 2))
    block = np.concatenate(
        [np.zeros(tables_begin(1)), grid_numbers(knots, values, period, is_product, is_root)]
    )
    block[3] = 1.0  # one actuator
    assert actuators_of(block)[0]["command_kind"] == 0.0
    actuators_of(block)[0]["command_kind"] = FIN
    actuators_of(block)[0]["law_grid"] = tables_begin(1)
    assert len(numbers_of(np.zeros(1, struct("fl_actuator")))) == tables_begin(1) - tables_begin(0)

    def along(axis: Array, points: Array, x: float, turn: float) -> Array:
        """Values (..., k) at the knots of an axis, the last one, where it is x."""
        if turn:
            x = axis[0] + (x - axis[0]) % turn
            axis = np.concatenate([axis[-2:] - turn, axis, axis[:2] + turn])
            points = np.concatenate([points[-2:], points, points[:2]])
        slope = np.empty_like(points)
        slope[1:-1] = (points[2:] - points[:-2]) / (axis[2:] - axis[:-2])[:, None]
        slope[0] = (points[1] - points[0]) / (axis[1] - axis[0])
        slope[-1] = (points[-1] - points[-2]) / (axis[-1] - axis[-2])
        spline = CubicHermiteSpline(axis, points, slope)
        return np.asarray(spline(np.clip(x, axis[0], axis[-1])))

    def expected(command: Array) -> Array:
        knot_position = command.copy()
        if is_product:
            knot_position[0] = command[0] * command[1]
        values_left = values.reshape(4, -1)
        values_left = along(knots[0], values_left, knot_position[0], 0.0).reshape(5, -1)
        values_left = along(knots[1], values_left, knot_position[1], 0.0).reshape(6, -1)
        value = along(knots[2], values_left, knot_position[2], period)
        return value**2 if is_root else value

    for _ in range(60):
        command = np.array([rng.uniform(0.1, 1.8), rng.uniform(0.1, 3.5), rng.uniform(-6.0, 8.0)])
        force = np.zeros(3)
        slope = np.zeros((3, 3))
        functions().fl_force_of_command(at(block), 0, at(command), at(force), at(slope))
        np.testing.assert_allclose(force[:2], expected(command), rtol=1e-9)
        for c in range(3):
            change = STEP * np.eye(3)[c]
            difference = (expected(command + change) - expected(command - change)) / (2.0 * STEP)
            np.testing.assert_allclose(slope[c, :2], difference, atol=1e-5)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_command_gives_back_the_force_that_it_is_for(name: str) -> None:
    rng = np.random.default_rng(4)
    for number in range(2):
        robot = robot_of(name, number)
        box = robot.whole_box()
        for i in range(robot.n):
            actuator = robot.actuators[i]
            rows = slice(1, 3) if robot.is_plane(i) else slice(0, 1)
            for asked in commands_of(robot, i, rng, 12):
                wanted = np.zeros(2)
                force = robot.force(i, asked)[0][rows]
                wanted[: len(force)] = force * (
                    actuator["command_sign"] if actuator["command_kind"] == 0.0 else 1.0
                )
                if (
                    actuator["flow_speed"] > 0.0
                    and not actuator["force_min"] < wanted[0] < actuator["force_max"]
                ):
                    continue  # stalled: others give as much lift, by less drag
                command = np.zeros(3)
                places = ctypes.byref(box), at(wanted), None, at(command)
                functions().fl_command_for_force(at(robot.block), i, *places)
                assert (command >= actuator["command_min"]).all() and (
                    command <= actuator["command_max"]
                ).all()
                back = robot.force(i, command)[0][rows]
                np.testing.assert_allclose(back, force, atol=2e-3 * actuator["row_force_max"][0])
                if (
                    actuator["command_kind"] == POD and np.hypot(*force) > 1e-3
                ):  # the cheaper way of both
                    assert (
                        robot.power(i, command[1]) <= robot.power(i, asked[1]) * (1.0 + 1e-6) + 1e-9
                    )


def boxes_of(robot: Robot, rng: np.random.Generator) -> Box:
    """A random part of all limits."""
    box = robot.whole_box()
    for i, actuator in enumerate(robot.actuators):
        ends = np.sort(rng.random((2, 3)), axis=0)
        box.command_min[i][:] = actuator["command_min"] + ends[0] * (
            actuator["command_max"] - actuator["command_min"]
        )
        box.command_max[i][:] = actuator["command_min"] + ends[1] * (
            actuator["command_max"] - actuator["command_min"]
        )
    return box


def sizes_and_angles(robot: Robot, i: int, commands: Array) -> tuple[Array, Array | None]:
    """Forces (N,) [N] of commands (N, 3) along their directions, and of planes these directions
    [rad]."""
    actuator = robot.actuators[i]
    if actuator["command_kind"] == POD:
        return np.asarray(commands[:, 1]), np.asarray(commands[:, 0])
    force = np.array([robot.force(i, command)[0] for command in commands])
    if actuator["command_kind"] == STEERED:
        # The size is the thrust of the slipstream; in reverse nothing meets the rudder.
        slipstream = np.asarray(commands[:, 1] + actuator["pressure_area"])
        return slipstream, np.arctan2(force[:, 2], force[:, 1])
    if robot.is_plane(i):
        return np.hypot(force[:, 1], force[:, 2]), np.arctan2(force[:, 2], force[:, 1])
    sign = actuator["command_sign"] if actuator["command_kind"] == 0.0 else 1.0
    return np.asarray(sign * force[:, 0]), None


@pytest.mark.parametrize("name", [name for name in ROBOTS if name != "fins uneven"])
def test_a_range_of_forces_holds_what_commands_of_a_box_give_and_no_more(name: str) -> None:
    rng = np.random.default_rng(5)
    for number in range(2):
        robot = robot_of(name, number)
        box = boxes_of(robot, rng)
        for i in range(robot.n):
            actuator = robot.actuators[i]
            if actuator["unevenness"] != 0.0 or actuator["gauge_table"] != 0.0:
                continue  # the largest force is not the same in all directions
            low = np.array(box.command_min[i])
            high = np.array(box.command_max[i])
            share = np.stack(np.meshgrid(*3 * [np.linspace(0.0, 1.0, 6)]), axis=-1).reshape(-1, 3)
            size, angle = sizes_and_angles(robot, i, low + share * (high - low))
            force_range = functions().fl_force_range(at(robot.block), i, ctypes.byref(box))
            slack = 0.02 * actuator["row_force_max"][0]
            assert size.min() == pytest.approx(force_range.low, abs=slack)
            assert size.max() == pytest.approx(force_range.high, abs=slack)
            if angle is None:
                continue
            pushes = np.abs(size) > slack
            if actuator["command_kind"] == STEERED:
                pushes = size > slack
            error = np.abs(
                [math.remainder(one - force_range.middle, 2.0 * math.pi) for one in angle[pushes]]
            )
            assert error.max(initial=0.0) <= force_range.half + 1e-3
            if pushes.any() and force_range.half < 3.0:
                assert error.max() >= force_range.half - 1e-3


def test_pods_either_way_are_among_the_robots() -> None:
    robot = robot_of(EITHER_WAY)
    assert (robot.actuators["force_table_reverse"] > 0.0).all() and (
        robot.actuators["command_kind"] == POD
    ).all()


@pytest.mark.parametrize("name", ["azimuths", EITHER_WAY])
def test_an_arc_that_lacks_a_rounding_of_a_turn_is_all_round(name: str) -> None:
    robot = robot_of(name)
    for i in np.flatnonzero(robot.actuators["command_kind"] == POD).tolist():
        for lack, is_whole in ((0.0, True), (3e-10, True), (1e-8, False), (0.3, False)):
            box = robot.whole_box()
            half = math.pi - lack
            box.command_min[i][0] = 0.4 - half
            box.command_max[i][0] = 0.4 + half
            force_range = functions().fl_force_range(at(robot.block), i, ctypes.byref(box))
            assert (force_range.half == math.pi) == is_whole
            assert force_range.half == pytest.approx(half, abs=1e-9)
            assert force_range.middle == pytest.approx(0.4, abs=1e-12)
            assert force_range.low == box.command_min[i][1]
            assert force_range.high == box.command_max[i][1]


def power_and_forces(robot: Robot, command: Array, lost: Array) -> tuple[float, Array]:
    """Power [W] and forces (n, 2) [N] along the rows of commands (n, 3), actuators `lost` (n,)."""
    work = robot.work()
    gone = lost.astype(np.uint8)
    state = ctypes.c_void_p(gone.ctypes.data), None
    assert functions().fl_span_of_question(at(robot.block), work, *state)
    commands = np.zeros((MOST, 3))
    commands[: robot.n] = command
    force = np.zeros((MOST, 2))
    power = functions().fl_power_of_commands
    power.restype = ctypes.c_double
    cost = power(at(robot.block), work, at(commands), at(force))
    return float(cost), force[: robot.n]


@pytest.mark.parametrize("name", ROBOTS)
def test_power_and_forces_of_commands_are_those_of_the_plant(name: str) -> None:
    for number in range(2):
        robot = robot_of(name, number)
        rng = np.random.default_rng([1, number])
        for command in robot.plant.sample(rng, (6,)):
            lost = np.arange(robot.n) == rng.integers(2 * robot.n)
            power, force = power_and_forces(robot, command, lost)
            plant_power = robot.plant.power(command)
            # A law has no power in its dead band, where the core has that of the force.
            gives_force = np.abs(robot.plant.force(command)).max(axis=1) > 0.0
            if gives_force[~lost].all():
                # A fin has many beats for one force, of which the core knows the cheapest.
                most = plant_power[~lost].sum()
                assert power <= most * (1.0 + 2e-3) + 1e-6
                if not (robot.actuators["command_kind"] == FIN).any():
                    assert power == pytest.approx(most, rel=2e-3, abs=1e-6)
            assert not force[lost].any()
            for i in np.flatnonzero(~lost).tolist():
                law, _ = robot.force(i, np.ascontiguousarray(command[i]))
                rows = law[1:] if robot.is_plane(i) else law[:2]
                sign = (
                    robot.actuators[i]["command_sign"]
                    if robot.actuators[i]["command_kind"] == 0.0
                    else 1.0
                )
                np.testing.assert_allclose(force[i], sign * rows, atol=1e-12)


@pytest.mark.parametrize("number", range(3))
def test_foils_of_a_flow_cost_their_drag_at_the_speed_of_the_flow(number: int) -> None:
    robot = robot_of("rudders", number)
    rng = np.random.default_rng([2, number])
    foils = robot.actuators["flow_speed"] > 0.0
    assert foils.any()
    command = robot.plant.sample(rng, (1,))[0]
    power, force = power_and_forces(robot, command, np.zeros(robot.n, bool))
    others, _ = power_and_forces(robot, command, foils)
    rest = robot.actuators["pressure_area"] * robot.actuators["zero_lift_drag"]
    drag = robot.actuators["flow_speed"] * (force[:, 1] + rest)
    assert power - others == pytest.approx(drag[foils].sum(), rel=1e-9)
