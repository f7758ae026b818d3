"""Responses of one actuator in the core: worth as much as the best of many forces of its set, with
forces that are the gradient of that worth, and slopes that are those of the forces."""

import ctypes
import math

import numpy as np
import pytest

from finlab.arrays import Array
from tests.core.internal_functions import (
    POD,
    ROBOTS,
    LineResponse,
    Robot,
    Set,
    Tangent,
    at,
    functions,
    robot_of,
)

N_ANGLES = 361
"""How many angles of a sector are scanned."""
SIZES = 121
"""Denser towards both ends, where prices rise most."""
BLEND = 1e-5
"""Width, over the largest cost, in which two answers are blended."""


def forces_of(robot: Robot, i: int, limits: Set) -> tuple[Array, Array]:
    """Forces (N, 2) along the rows of an actuator that its set has, and their power (N,) [W]."""
    branches = [(limits.force_min, limits.force_max, 0.0, -1.0 if limits.is_flipped else 1.0)]
    if limits.force_max_reverse > 0.0:
        branches.append((0.0, limits.force_max_reverse, math.pi, -1.0))
    force = list[Array]()
    power = list[Array]()
    for low, high, rotation, sign in branches:
        share = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, SIZES if robot.is_plane(i) else 1201))
        size = low + share * (high - low)
        cost = np.array([robot.power(i, sign * one) for one in size])
        if not robot.is_plane(i):
            drag = np.array([robot.drag(i, one) for one in size])
            force.append(np.stack([size, drag], axis=-1))
            power.append(cost)
            continue
        angle = (
            limits.sector_center
            + rotation
            + limits.sector_half_angle * np.linspace(-1.0, 1.0, N_ANGLES)
        )
        radius = np.array([robot.radius(i, one) for one in angle])
        if limits.reverses_straight and sign < 0.0:
            angle = np.full(N_ANGLES, math.pi)
            radius = np.ones(N_ANGLES)
        direction = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
        force.append((size[:, None, None] * direction).reshape(-1, 2))
        power.append(np.repeat(cost, N_ANGLES))
    return np.concatenate(force), np.concatenate(power)


def sets_of(robot: Robot, i: int, rng: np.random.Generator) -> list[Set]:
    """All that an actuator may give, and parts of it: some sizes, some directions, one way."""
    actuator = robot.actuators[i]
    low, high, middle, half = (
        float(actuator[name])
        for name in ("force_min", "force_max", "sector_center", "sector_half_angle")
    )
    ends = np.sort(low + rng.random((2, 2)) * (high - low), axis=1)
    sets = [robot.whole_set(i), robot.set_of(i, *ends[0], middle, half)]
    if robot.is_plane(i):
        for share in (0.02, 0.3, 0.7):
            narrow = share * half
            center = middle + (rng.uniform(-1.0, 1.0) * (half - narrow))
            sets.append(robot.set_of(i, *ends[1], center, narrow))
        if actuator["command_kind"] == POD and low < 0.0:
            sets.append(robot.set_of(i, low, 0.3 * low, middle, half))
    return sets


def prices_of(robot: Robot, i: int, rng: np.random.Generator, count: int) -> Array:
    """Prices (count, 2) along the rows of an actuator: of small forces, up to more than the largest
    one's."""
    actuator = robot.actuators[i]
    top = (
        robot.table(actuator["force_table"])[0] * actuator["power_scale"] / actuator["force_scale"]
    )
    size = top * 10.0 ** rng.uniform(-1.5, 0.3, count)
    angle = rng.uniform(-np.pi, np.pi, count)
    price = np.stack([size * np.cos(angle), size * np.sin(angle)], axis=-1)
    if actuator["rows"] == 1.0:
        return np.asarray(price * [1.0, 0.0])
    if actuator["flow_speed"] > 0.0:  # drag is paid, a little or much, or welcome
        price[:, 1] = actuator["flow_speed"] * rng.uniform(-3.0, 0.75, count)
    return price


def worth(force: Array, power: Array, price: Array) -> float:
    """The most that forces (N, 2) are worth at prices (2,), less their power (N,) [W]."""
    return float((force @ price - power).max())


@pytest.mark.parametrize("name", ROBOTS)
def test_a_response_is_worth_as_much_as_the_best_force_of_its_set(name: str) -> None:
    rng = np.random.default_rng(1)
    robot = robot_of(name, 1)
    for i in range(robot.n):
        for limits in sets_of(robot, i, rng):
            force, power = forces_of(robot, i, limits)
            for price in prices_of(robot, i, rng, 12):
                best = worth(force, power, price)
                conjugate = robot.response(i, limits, price).conjugate
                # Between points of the scan there may be more; blends and soft turns add a little.
                scale = np.abs(price).max() * np.abs(force).max() + power.max()
                soft = math.sqrt(limits.price_floor_squared) * np.abs(force).max()
                assert -1e-6 * scale <= conjugate - best <= 5e-4 * scale + soft, (i, price)


def differences(
    robot: Robot, i: int, limits: Set, price: Array, step: float
) -> tuple[Array, Array]:
    """Gradient (2,) of the conjugate by the prices, and derivatives (2, 2) of the force, by
    differences."""
    rows = 1 if robot.actuators[i]["rows"] == 1.0 else 2
    gradient = np.zeros(2)
    slope = np.zeros((2, 2))
    for q in range(rows):
        change = step * np.eye(2)[q]
        ahead = robot.response(i, limits, price + change)
        back = robot.response(i, limits, price - change)
        gradient[q] = (ahead.conjugate - back.conjugate) / (2.0 * step)
        slope[q] = (np.array(ahead.force) - np.array(back.force)) / (2.0 * step)
    return gradient, slope


def check_derivatives(robot: Robot, i: int, limits: Set, price: Array) -> bool:
    """Whether a response is the gradient of its worth, and its slopes are those of its force; not
    judged where two steps of differences disagree, as at the end of a table."""
    size = float(np.abs(price).max())
    fine = differences(robot, i, limits, price, 1e-6 * size)
    rough = differences(robot, i, limits, price, 3e-6 * size)
    response = robot.response(i, limits, price)
    most = robot.actuators[i]["row_force_max"].max()
    if np.abs(fine[1] - rough[1]).max() * size > 1e-3 * most:
        return False
    np.testing.assert_allclose(response.force, fine[0], atol=1e-4 * most)
    slope = np.array([[response.xx, response.xy], [response.xy, response.yy]])
    np.testing.assert_allclose(slope * size, fine[1] * size, atol=2e-3 * most)
    return True


@pytest.mark.parametrize("name", ROBOTS)
def test_forces_and_slopes_are_derivatives_of_the_conjugate(name: str) -> None:
    rng = np.random.default_rng(2)
    robot = robot_of(name, 1)
    is_met = list[bool]()
    for i in range(robot.n):
        for limits in sets_of(robot, i, rng):
            is_met += [
                check_derivatives(robot, i, limits, price) for price in prices_of(robot, i, rng, 12)
            ]
    assert np.mean(is_met) > 0.8


def test_slopes_between_two_answers_are_those_of_their_blend() -> None:
    """Ends of wide arcs, and both ways of a pod, are blended where they are worth as much."""
    blended = 0
    for name in ("wide arcs", "pods either way"):
        robot = robot_of(name, 1)
        for i in range(robot.n):
            limits = robot.whole_set(i)
            if not limits.is_forked and not limits.force_max_reverse > 0.0:
                continue
            top = (
                robot.table(robot.actuators[i]["force_table"])[0]
                * robot.actuators[i]["power_scale"]
            )
            crossing_price = crossing(robot, i, limits, top / robot.actuators[i]["force_scale"])
            if crossing_price is None:
                continue
            for aside in (-3e-6, 0.0, 1e-5):
                turn = np.array(
                    [math.cos(crossing_price[1] + aside), math.sin(crossing_price[1] + aside)]
                )
                blended += check_blend(robot, i, limits, crossing_price[0] * turn)
    assert blended >= 6


def crossing(robot: Robot, i: int, limits: Set, top: float) -> tuple[float, float] | None:
    """Size and direction of a price at which the force changes sides; None where it does
    nowhere."""
    size = top
    angle = limits.sector_center + np.linspace(-np.pi, np.pi, 73) + 0.01
    force = [
        np.array(robot.response(i, limits, size * np.array([math.cos(a), math.sin(a)])).force)
        for a in angle
    ]
    apart = [np.linalg.norm(b - a) for a, b in zip(force, force[1:], strict=False)]
    k = int(np.argmax(apart))
    low = angle[k]
    high = angle[k + 1]
    if apart[k] < 0.3 * robot.actuators[i]["row_force_max"][0]:
        return None
    for _ in range(50):
        middle = 0.5 * (low + high)
        price = size * np.array([math.cos(middle), math.sin(middle)])
        at_middle = np.array(robot.response(i, limits, price).force)
        if np.linalg.norm(at_middle - force[k]) < np.linalg.norm(at_middle - force[k + 1]):
            low = middle
        else:
            high = middle
    return size, float(low)


def check_blend(robot: Robot, i: int, limits: Set, price: Array) -> bool:
    """The same as `check_derivatives` with steps that are small beside the width of the blend."""
    step = 1e-9 * float(np.abs(price).max())
    gradient, slope = differences(robot, i, limits, price, 100.0 * step)
    _, rough = differences(robot, i, limits, price, 200.0 * step)
    response = robot.response(i, limits, price)
    own = np.array([[response.xx, response.xy], [response.xy, response.yy]])
    most = robot.actuators[i]["row_force_max"][0]
    np.testing.assert_allclose(response.force, gradient, atol=2e-3 * most)
    np.testing.assert_allclose(
        own, slope, atol=0.02 * np.abs(own).max() + np.abs(slope - rough).max()
    )
    return True


@pytest.mark.parametrize("number", range(3))
def test_turning_costs_what_it_costs_and_is_weighed_against_the_force(number: int) -> None:
    """At each angle the best force, less what it costs to turn there: beside a scan of all
    angles."""
    rng = np.random.default_rng([3, number])
    for name in ("azimuths", "pods either way"):
        robot = robot_of(name, number)
        for i in range(robot.n):
            for limits in sets_of(robot, i, rng):
                price = prices_of(robot, i, rng, 1)[0]
                force, power = forces_of(robot, i, limits)
                if limits.sector_half_angle >= np.pi:
                    limits.turn_origin = rng.uniform(-np.pi, np.pi)
                else:
                    limits.turn_origin = (
                        limits.sector_center + limits.sector_half_angle * rng.uniform(-1.0, 1.0)
                    )
                limits.turn_cost = (
                    np.abs(price).max() * np.abs(force).max() * 10.0 ** rng.uniform(-2.0, 0.5)
                )
                limits.slope_max = functions().fl_largest_slope(at(robot.block), i)
                best = max(turned_worth(robot, i, limits, force, power, price))
                response = robot.response(i, limits, price)
                scale = np.abs(price).max() * np.abs(force).max() + power.max() + limits.turn_cost
                assert -1e-6 * scale <= response.conjugate - best <= 1e-3 * scale
                check_derivatives(robot, i, limits, price)


def turned_worth(
    robot: Robot, i: int, limits: Set, force: Array, power: Array, price: Array
) -> list[float]:
    """What forces of both ways are worth at angles around the one before, less the cost of turning
    there."""
    low = limits.sector_center - limits.sector_half_angle
    high = limits.sector_center + limits.sector_half_angle
    if limits.sector_half_angle >= np.pi:
        low = limits.turn_origin - np.pi
        high = limits.turn_origin + np.pi
    worth_of_angles = list[float]()
    branches = [(limits.force_min, limits.force_max, -1.0 if limits.is_flipped else 1.0, 1.0)]
    if limits.force_max_reverse > 0.0:
        branches.append((0.0, limits.force_max_reverse, -1.0, -1.0))
    for least, most, sign, direction in branches:
        size = np.linspace(least, most, 121)
        cost = np.array([robot.power(i, sign * one) for one in size])
        for angle in np.linspace(low, high, N_ANGLES):
            along = direction * (price[0] * math.cos(angle) + price[1] * math.sin(angle))
            worth_of_angles.append(
                float((along * size - cost).max())
                - limits.turn_cost / 2.0 * (angle - limits.turn_origin) ** 2
            )
    return worth_of_angles


@pytest.mark.parametrize("name", ROBOTS)
def test_a_set_goes_as_far_along_prices_as_its_farthest_force(name: str) -> None:
    rng = np.random.default_rng(4)
    robot = robot_of(name, 2)
    for i in range(robot.n):
        for limits in sets_of(robot, i, rng):
            force, _ = forces_of(robot, i, limits)
            for price in prices_of(robot, i, rng, 8):
                found = np.zeros(2)
                functions().fl_support_of_set(
                    at(robot.block), i, ctypes.byref(limits), at(price), at(found), None
                )
                best = (force @ price).max()
                scale = np.abs(price).max() * max(np.abs(force).max(), 1e-9)
                assert found @ price == pytest.approx(best, abs=2e-3 * scale)


def test_a_foil_on_its_tangent_answers_with_the_best_step() -> None:
    rng = np.random.default_rng(5)
    robot = robot_of("rudders")
    for _ in range(40):
        tangent = Tangent()
        tangent.force[:] = rng.normal(size=2)
        tangent.force_slope[:] = rng.normal(size=2)
        tangent.cost = rng.random()
        tangent.cost_slope = rng.normal()
        tangent.curvature = rng.uniform(0.5, 4.0)
        limits = robot.whole_set(0)
        limits.force_min = -rng.uniform(0.1, 1.0)
        limits.force_max = rng.uniform(0.1, 1.0)
        limits.tangent = ctypes.addressof(tangent)
        price = rng.normal(size=2)
        step = np.linspace(limits.force_min, limits.force_max, 20_001)
        force = np.array(tangent.force) + step[:, None] * np.array(tangent.force_slope)
        cost = tangent.cost + tangent.cost_slope * step + 0.5 * tangent.curvature * step**2
        value = force @ price - cost
        response = robot.response(0, limits, price)
        assert response.conjugate == pytest.approx(value.max(), abs=1e-7)
        np.testing.assert_allclose(response.force, force[value.argmax()], atol=1e-3)
        gradient, slope = differences(robot, 0, limits, price, 1e-6)
        np.testing.assert_allclose(response.force, gradient, atol=1e-6)
        np.testing.assert_allclose(
            [[response.xx, response.xy], [response.xy, response.yy]], slope, atol=1e-6
        )


@pytest.mark.parametrize("name", ROBOTS)
def test_a_table_s_force_power_and_price_belong_together(name: str) -> None:
    """c*(v) = v T - c(T), T = dc*/dv, and the price at which a force is given is dc/dT."""
    rng = np.random.default_rng(6)
    robot = robot_of(name, 1)
    for i in range(robot.n):
        actuator = robot.actuators[i]
        for offset in {
            actuator["force_table"],
            actuator["force_table_reverse"] or actuator["force_table"],
        }:
            table = robot.table(offset).copy()
            top = table[0]
            largest = table[3 + 3 * int(table[1])]
            for price in top * rng.random(20) ** 3:
                response = force_of_price(table, price)
                step = 1e-6 * price  # cells are narrower the lower the price
                ahead = force_of_price(table, price + step)
                back = force_of_price(table, price - step)
                force = (ahead.conjugate - back.conjugate) / (2.0 * step)
                slope = (ahead.force - back.force) / (2.0 * step)
                assert response.force == pytest.approx(force, abs=1e-5 * largest)
                assert response.slope * price == pytest.approx(slope * price, abs=1e-4 * largest)
                paid = np.zeros(1)
                power = functions().fl_marginal_cost(
                    at(table), ctypes.c_double(response.force), at(paid)
                )
                assert price * response.force - power == pytest.approx(
                    response.conjugate, abs=1e-7 * top * largest
                )
                if table[3] < response.force < largest * (1.0 - 1e-6):
                    response_again = force_of_price(table, float(paid[0]))
                    assert response_again.force == pytest.approx(response.force, abs=1e-6 * largest)
            beyond = force_of_price(table, 1.5 * top)
            at_top = force_of_price(table, top)
            assert beyond.force == largest
            assert beyond.conjugate - at_top.conjugate == pytest.approx(
                0.5 * top * largest, rel=1e-9
            )


def force_of_price(table: Array, price: float) -> LineResponse:
    """Force, slope and conjugate of a table at a price."""
    response: LineResponse = functions().fl_force_of_price(at(table), ctypes.c_double(price))
    return response


@pytest.mark.parametrize("number", range(3))
def test_where_drag_is_welcome_a_foil_answers_with_its_chord(number: int) -> None:
    """With the most drag that the hull of its curve has at a lift: that between the ends."""
    rng = np.random.default_rng([8, number])
    robot = robot_of("rudders", number)
    foils = np.flatnonzero(robot.actuators["flow_speed"] > 0.0).tolist()
    assert foils
    for i in foils:
        speed = float(robot.actuators[i]["flow_speed"])
        for limits in sets_of(robot, i, rng):
            low, high = limits.force_min, limits.force_max
            lift = np.linspace(low, high, 201)
            ends = robot.drag(i, low), robot.drag(i, high)
            drag = np.interp(lift, (low, high), ends)
            at_rest = robot.power(i, low) - speed * ends[0]
            power = at_rest + speed * drag
            for _ in range(6):
                price = speed * np.array([rng.normal(), rng.uniform(1.5, 4.0)])
                told = robot.response(i, limits, price)
                value = float((price[0] * lift + price[1] * drag - power).max())
                scale = np.abs(price).max() * max(np.abs(lift).max(), drag.max())
                assert told.conjugate == pytest.approx(value, abs=0.02 * scale)
                check_slopes_of_foil(robot, i, limits, price)
            for _ in range(6):  # where drag is nearly paid for, it is softened
                price = speed * np.array([rng.normal(), rng.uniform(0.7, 1.3)])
                check_slopes_of_foil(robot, i, limits, price)


def check_slopes_of_foil(robot: Robot, i: int, limits: Set, price: Array) -> None:
    """Forces are the gradient of the conjugate, and slopes those of the forces."""
    told = robot.response(i, limits, price)
    gradient, slope = differences(robot, i, limits, price, 1e-5 * np.abs(price).max())
    largest = float(np.abs(robot.actuators[i]["row_force_max"]).max())
    np.testing.assert_allclose(told.force, gradient, atol=1e-4 * largest)
    own = [[told.xx, told.xy], [told.xy, told.yy]]
    rounding = 1e-6 * largest / np.abs(price).max()
    np.testing.assert_allclose(own, slope, atol=1e-2 * np.abs(own).max() + rounding)
