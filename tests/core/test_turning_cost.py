"""The response of a pod where turning costs kappa / 2 d^2 (Eq. 16 and 17), beside a fine scan over
angles; and where that response jumps."""

import ctypes
import math

import numpy as np
import pytest

from finlab.arrays import Array
from tests.core.internal_functions import (
    REAL,
    Response,
    Robot,
    Set,
    State,
    at,
    functions,
    in_the_core,
    pods_either_way,
)

SIZES = 1201
"""Sizes of force in a scan."""
ANGLES = 7201
"""Angles in a scan."""
FINE = 1e-5
"""Share of the largest force up to which a short move is no jump (`FINE` of the core)."""
NEARLY = 1e-6
"""Share of a window up to which two angles are the same (`NEARLY` of the core)."""
FREE = 3
"""The pod of `pods_either_way` that turns freely."""


@pytest.fixture(scope="module")
def robot() -> Robot:
    """Four pods that push either way, the last of which turns freely."""
    return in_the_core(pods_either_way(5))


def turning_set(robot: Robot, i: int, origin: float, turn_cost: float, reverse: bool) -> Set:
    """The set of a pod that turns from an angle [rad], at a cost [W/rad^2]."""
    actuator = robot.actuators[i]
    force_min = actuator["force_min"] if reverse else 0.0
    limits = robot.set_of(
        i,
        force_min,
        actuator["force_max"],
        actuator["sector_center"],
        actuator["sector_half_angle"],
    )
    limits.turn_cost = turn_cost
    limits.turn_origin = origin
    limits.slope_max = functions().fl_largest_slope(at(robot.block), i)
    return limits


def respond(robot: Robot, i: int, limits: Set, price: Array) -> Response:
    """The response of a pod to a price (2,) [W/N], where turning costs."""
    response: Response = functions().fl_response_with_turning(
        at(robot.block), i, ctypes.byref(limits), at(price)
    )
    return response


def window_of(limits: Set) -> tuple[float, float]:
    """Least and largest angle [rad]: those of the sector, or half a turn to both sides."""
    if limits.sector_half_angle >= math.pi:
        return limits.turn_origin - math.pi, limits.turn_origin + math.pi
    return (
        limits.sector_center - limits.sector_half_angle,
        limits.sector_center + limits.sector_half_angle,
    )


def best_of_scan(robot: Robot, i: int, limits: Set, price: Array) -> float:
    """The conjugate [W] of Eq. 16 by a scan over sizes and angles."""
    size = np.linspace(-limits.force_max_reverse, limits.force_max, SIZES)
    cost = np.array([robot.power(i, one) for one in size])
    angle = np.linspace(*window_of(limits), ANGLES)
    along = price[0] * np.cos(angle) + price[1] * np.sin(angle)
    best = np.array([(v * size - cost).max() for v in along])
    turn = angle - limits.turn_origin
    return float((best - limits.turn_cost / 2.0 * turn**2).max())


def top_price(robot: Robot, i: int) -> float:
    """About the price [W/N] of a pod's largest force."""
    actuator = robot.actuators[i]
    return float(2.0 * robot.power(i, actuator["force_max"]) / actuator["force_max"])


def cases_of(robot: Robot, i: int, rng: np.random.Generator) -> list[tuple[Set, Array]]:
    """Sets of a pod and prices (2,), where turning costs little and where it costs much."""
    actuator = robot.actuators[i]
    cases = []
    for share in (0.03, 0.3, 3.0):
        for reverse in (False, True):
            size = top_price(robot, i) * rng.uniform(0.2, 1.2)
            towards = rng.uniform(-math.pi, math.pi)
            price = size * np.array([math.cos(towards), math.sin(towards)])
            half = min(actuator["sector_half_angle"], math.pi)
            origin = actuator["sector_center"] + half * rng.uniform(-1.0, 1.0)
            turn_cost = share * size * actuator["force_max"]
            cases.append((turning_set(robot, i, origin, turn_cost, reverse), price))
    return cases


@pytest.mark.parametrize("i", range(4))
def test_a_response_is_worth_as_much_as_the_best_of_all_angles(robot: Robot, i: int) -> None:
    rng = np.random.default_rng(i)
    for limits, price in cases_of(robot, i, rng):
        response = respond(robot, i, limits, price)
        low, high = window_of(limits)
        assert low - 1e-9 <= response.angle <= high + 1e-9
        best = best_of_scan(robot, i, limits, price)
        scale = float(np.hypot(*price)) * limits.force_max
        assert -1e-6 * scale <= response.conjugate - best <= 1e-5 * scale
        # What the force says of itself is that conjugate, and it lies along the angle.
        force = np.array(response.force)
        size = force @ [math.cos(response.angle), math.sin(response.angle)]
        assert math.hypot(*force) == pytest.approx(abs(size), abs=1e-9 * limits.force_max)
        turn = response.angle - limits.turn_origin
        value = force @ price - robot.power(i, size) - limits.turn_cost / 2.0 * turn**2
        assert value == pytest.approx(response.conjugate, abs=1e-5 * scale)


@pytest.mark.parametrize("i", range(4))
def test_forces_are_the_gradient_and_their_derivatives_the_hessian(robot: Robot, i: int) -> None:
    """By central differences, except next to a jump or to the end of a size or an angle."""
    rng = np.random.default_rng(10 + i)
    smooth = 0
    for limits, price in cases_of(robot, i, rng):
        response = respond(robot, i, limits, price)
        hessian = np.array([[response.xx, response.xy], [response.xy, response.yy]])
        step = 1e-5 * float(np.hypot(*price))
        gradient = np.zeros(2)
        change = np.zeros((2, 2))
        angles = []
        for k in range(2):
            ahead = respond(robot, i, limits, price + step * np.eye(2)[k])
            behind = respond(robot, i, limits, price - step * np.eye(2)[k])
            gradient[k] = (ahead.conjugate - behind.conjugate) / (2.0 * step)
            change[k] = (np.array(ahead.force) - np.array(behind.force)) / (2.0 * step)
            angles += [ahead.angle, behind.angle]
        if max(angles) - min(angles) > 0.01:
            continue
        np.testing.assert_allclose(gradient, response.force, atol=1e-3 * limits.force_max)
        if np.abs(change - hessian).max() <= 0.02 * np.abs(hessian).max():
            smooth += 1
    assert smooth >= 4


@pytest.mark.parametrize("reverse", [False, True])
def test_a_free_pod_answers_alike_on_both_sides_of_half_a_turn(robot: Robot, reverse: bool) -> None:
    """Its price and the angle from which it turns turned together, its response turns with them:
    there is no seam at +-pi."""
    origin = 0.4
    limits = turning_set(robot, FREE, origin, 0.3 * top_price(robot, FREE), reverse)
    for towards in (-2.9, -1.2, 0.1, 1.7, 3.0):
        price = 0.6 * top_price(robot, FREE) * np.array([math.cos(towards), math.sin(towards)])
        first = respond(robot, FREE, limits, price)
        for turn in (math.pi - origin - 0.05, math.pi - origin + 0.05, -2.0, 2.0 * math.pi):
            turned_limits = Set.from_buffer_copy(limits)
            turned_limits.turn_origin = origin + turn
            rotation = np.array(
                [[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]
            )
            second = respond(robot, FREE, turned_limits, rotation @ price)
            np.testing.assert_allclose(
                second.force, rotation @ first.force, atol=1e-6 * limits.force_max
            )
            assert second.conjugate == pytest.approx(first.conjugate, rel=1e-9)
            assert second.angle - turn == pytest.approx(first.angle, abs=1e-6)


def test_a_free_pod_goes_the_shorter_way_across_half_a_turn(robot: Robot) -> None:
    """From just below pi to a price just above it, not around the whole circle."""
    limits = turning_set(robot, FREE, math.pi - 0.1, 0.01 * top_price(robot, FREE), False)
    towards = -math.pi + 0.2
    price = top_price(robot, FREE) * np.array([math.cos(towards), math.sin(towards)])
    angle = respond(robot, FREE, limits, price).angle
    assert math.pi - 0.1 < angle <= math.pi + 0.2 + 1e-9


def states(
    force: Array, moved: Array, dy_ds: Array, push_angle: tuple[float, float]
) -> tuple[State, State]:
    """Two states in which the first pod has a force (2,) and one that moved on from there [N], with
    derivatives (2, 3) at both, and the angles at which it pushes [rad]."""
    one = State()
    other = State()
    one.force[0][:] = force
    other.force[0][:] = force + moved
    one.dy_ds[0][:] = dy_ds[0]
    other.dy_ds[0][:] = dy_ds[1]
    one.push_angle[0] = push_angle[0]
    other.push_angle[0] = push_angle[1]
    return one, other


def has_jumped(
    robot: Robot, limits: Set, pair: tuple[State, State], step: Array, is_short: bool
) -> bool:
    """Whether the first pod's response jumps between two states, a step (2,) of its price apart."""
    one, other = pair
    return bool(
        functions().fl_has_jumped(
            at(robot.block),
            0,
            ctypes.byref(limits),
            ctypes.byref(one),
            ctypes.byref(other),
            at(step),
            int(is_short),
        )
    )


def derivatives_of(moved: Array, step: Array, rng: np.random.Generator) -> Array:
    """A symmetric matrix (xx, xy, yy) that takes a step of the price to a move of the force."""
    xy = rng.normal()
    xx = (moved[0] - xy * step[1]) / step[0]
    yy = (moved[1] - xy * step[0]) / step[1]
    return np.array([xx, xy, yy])


def test_a_short_step_jumps_where_half_its_move_is_beyond_both_derivatives(robot: Robot) -> None:
    rng = np.random.default_rng(3)
    limits = turning_set(robot, 0, 0.0, 1.0, False)
    largest = float(robot.actuators[0]["row_force_max"][0])
    for _ in range(30):
        angle = rng.uniform(-math.pi, math.pi)
        direction = np.array([math.cos(angle), math.sin(angle)])
        force = 0.5 * largest * direction
        moved = 1e-3 * largest * rng.normal(size=2)
        step = rng.uniform(0.3, 1.0, 2) * rng.choice([-1.0, 1.0], 2)
        off = rng.normal(size=2)
        off *= float(np.hypot(*moved) / np.hypot(*off))
        told = derivatives_of(moved - 0.45 * off, step, rng)
        untold = derivatives_of(moved - 0.55 * off, step, rng)
        pushes = (angle, angle)
        for derivatives, is_jump in (
            ((told, told), False),
            ((told, untold), False),
            ((untold, told), False),
            ((untold, untold), True),
        ):
            pair = states(force, moved, np.array(derivatives), pushes)
            assert has_jumped(robot, limits, pair, step, is_short=True) == is_jump
        # A long step, or a move that is rounding, is none.
        pair = states(force, moved, np.array([untold, untold]), pushes)
        assert not has_jumped(robot, limits, pair, step, is_short=False)
        tiny = moved * (0.9 * FINE * largest / float(np.hypot(*moved)))
        pair = states(force, tiny, np.zeros((2, 3)), pushes)
        assert not has_jumped(robot, limits, pair, step, is_short=True)
        pair = states(force, tiny * (1.1 / 0.9), np.zeros((2, 3)), pushes)
        assert has_jumped(robot, limits, pair, step, is_short=True)


def test_a_change_of_sides_is_a_jump_of_any_step(robot: Robot) -> None:
    largest = float(robot.actuators[0]["row_force_max"][0])
    one_way = turning_set(robot, 0, 0.0, 1.0, False)
    either_way = turning_set(robot, 0, 0.0, 1.0, True)
    ahead = np.array([0.4 * largest, 0.0])
    nothing = np.zeros(2)
    flat = np.zeros((2, 3))
    step = np.ones(2)

    def jumps(limits: Set, begin: Array, end: Array) -> bool:
        pair = states(begin, end - begin, flat, (0.0, 0.0))
        return has_jumped(robot, limits, pair, step, is_short=False)

    assert jumps(either_way, ahead, -ahead)
    assert jumps(either_way, ahead, nothing)
    assert jumps(either_way, nothing, ahead)
    assert not jumps(one_way, ahead, nothing)
    assert not jumps(either_way, ahead, 1.5 * ahead)
    assert not jumps(either_way, 1e-3 * ahead, -1e-3 * ahead)


def test_the_response_itself_jumps_where_two_angles_are_worth_the_same(robot: Robot) -> None:
    """A price against the pod's angle turns it one way or the other; between two prices of one side
    its derivatives tell how it moves."""
    largest = float(robot.actuators[FREE]["row_force_max"][0])
    limits = turning_set(robot, FREE, 0.3, 0.05 * top_price(robot, FREE) * largest, False)
    size = top_price(robot, FREE)
    answers = []
    prices = []
    for angle_step in (-2e-6, -1e-6, 1e-6, 2e-6):
        towards = 0.3 + math.pi + angle_step
        prices.append(size * np.array([math.cos(towards), math.sin(towards)]))
        answers.append(respond(robot, FREE, limits, prices[-1]))
    for k, is_jump in ((0, False), (1, True), (2, False)):
        one = State()
        other = State()
        for state, answer in ((one, answers[k]), (other, answers[k + 1])):
            state.force[FREE][:] = answer.force
            state.dy_ds[FREE][:] = (answer.xx, answer.xy, answer.yy)
            state.push_angle[FREE] = answer.angle
        step = prices[k + 1] - prices[k]
        has_jumped = functions().fl_has_jumped(
            at(robot.block),
            FREE,
            ctypes.byref(limits),
            ctypes.byref(one),
            ctypes.byref(other),
            at(step),
            1,
        )
        assert bool(has_jumped) == is_jump
    assert abs(answers[1].angle - answers[2].angle) > 0.5


@pytest.mark.parametrize("i", range(4))
def test_a_jump_is_cut_between_its_angles_or_in_the_middle_of_the_window(
    robot: Robot, i: int
) -> None:
    limits = turning_set(robot, i, robot.actuators[i]["sector_center"] + 0.05, 1.0, False)
    low, high = window_of(limits)
    one = low + 0.2 * (high - low)
    for apart, middle in (
        (0.5, one + 0.25 * (high - low)),
        (2.0 * NEARLY, one + NEARLY * (high - low)),
        (0.5 * NEARLY, (low + high) / 2.0),
        (0.0, (low + high) / 2.0),
    ):
        for first, second in ((0.0, apart), (apart, 0.0)):
            marked = Set.from_buffer_copy(limits)
            begin = one + first * (high - low)
            end = one + second * (high - low)
            functions().fl_mark_jump(ctypes.byref(marked), REAL(begin), REAL(end))
            assert marked.has_jumped == 1
            assert marked.jump_angle == pytest.approx(middle, abs=1e-9)
