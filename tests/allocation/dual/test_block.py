"""What the core is given of a robot, against what it stands for, and what is kept between
questions."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from finlab.actuators.thrust_model import PowerLaw
from finlab.allocation import Allocator
from finlab.allocation.dual.block import POINTS, _usual_price, gauge_numbers
from finlab.arrays import Array
from finlab.core.fields import actuators_of
from finlab.layout import Azimuth, Layout, load_layout
from tests.allocator_cache import AllocatorCache
from tests.random_robots import T200, T200_FORCE, bluerov2_heavy, layout_of, load

FINE_ANGLES = np.linspace(0.0, 2.0 * math.pi, 20_001)
"""Angles of a scan [rad], so fine that its best one is as good as exact."""


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
        # h(angle) = max over psi of rho(psi) cos(angle - psi); h' = -rho sin(angle - psi) at the
        # best psi.
        support_of_angles = uneven(FINE_ANGLES) * np.cos(angle - FINE_ANGLES)
        first = FINE_ANGLES[int(support_of_angles.argmax())]
        ends = (first - 1e-3, first + 1e-3)
        best = minimize_scalar(
            lambda psi, angle=angle: -float(uneven(psi) * math.cos(angle - psi)),
            bounds=ends,
            method="bounded",
            options={"xatol": 1e-10},
        )
        assert support[place] == pytest.approx(-best.fun, abs=3e-7)
        derivative = -uneven(best.x) * math.sin(angle - best.x)
        assert slope[place] == pytest.approx(float(derivative), abs=5e-5)
        assert own[place] == pytest.approx(float(uneven(np.array(angle))), abs=2e-5)
    np.testing.assert_array_equal(kept, deflection)


def test_the_largest_power_is_that_of_all_thrusters_at_their_dearer_end() -> None:
    robot = AllocatorCache().method(load(bluerov2_heavy())).compiled
    dearer = max(
        T200["forward"] * T200_FORCE[1] ** 1.5, T200["reverse"] * abs(T200_FORCE[0]) ** 1.5
    )
    assert robot.largest_power == pytest.approx(8.0 * dearer, rel=1e-3)


def test_the_usual_price_of_a_thruster_is_that_of_its_dearer_end() -> None:
    """P = c F^1.5 has the price dP/dF = 1.5 c sqrt(F)."""
    response = AllocatorCache().method(load(bluerov2_heavy())).compiled.responses[0]
    ahead = 1.5 * T200["forward"] * math.sqrt(T200_FORCE[1])
    astern = 1.5 * T200["reverse"] * math.sqrt(-T200_FORCE[0])
    assert _usual_price(response) == pytest.approx(max(ahead, astern), rel=0.02)


@pytest.mark.parametrize(
    ("ends", "reverse", "half", "is_needed"),
    [
        ((-30.0, 40.0), 0.3, math.pi, False),  # all round, as strong and as cheap ahead
        ((-30.0, 40.0), 0.5, math.pi, False),
        ((-30.0, 40.0), 0.2, math.pi, True),  # cheaper in reverse
        ((-50.0, 40.0), 0.3, math.pi, True),  # stronger
        ((-30.0, 40.0), 0.3, 2.0, True),  # not all round
    ],
)
def test_a_pod_is_searched_in_reverse_only_where_that_brings_anything(
    ends: tuple[float, float], reverse: float, half: float, is_needed: bool
) -> None:
    model = PowerLaw(0.3, reverse)
    pod = Azimuth("pod", (0.3, 0, 0), (0, 0, 1), (1, 0, 0), ends, model, (-half, half))
    actuator = actuators_of(AllocatorCache().method(Layout("one", (pod,))).compiled.block)[0]
    assert actuator["force_min"] == pytest.approx(ends[0])
    assert actuator["force_min_needed"] == (actuator["force_min"] if is_needed else 0.0)


def test_a_method_in_a_flow_is_kept_for_the_next_question() -> None:
    method = AllocatorCache().method(load_layout("torpedo"))
    slow = np.array([1.0, 0, 0, 0, 0, 0])
    fast = np.array([2.0, 0, 0, 0, 0, 0])
    slow_method = method.at(slow)
    assert slow_method is not method and method.at(slow.copy()) is slow_method
    assert method.at(fast) is not slow_method and method.at(None) is method


def test_axes_that_come_together_only_are_told_where_they_are_asked_for_apart() -> None:
    thruster = bluerov2_heavy()["actuators"][0] | {
        "position_m": [0.0, 0.1, 0.0],
        "axis": [1.0, 0.0, 0.0],
    }
    allocator = Allocator(
        load(layout_of("aside", [thruster]))
    )  # 1 N along x turns by -0.1 N m about z
    together = allocator.allocate([10.0, 0.0, 0.0, 0.0, 0.0, -1.0])
    apart = allocator.allocate([10.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert together.reachable and not any("apart" in note for note in together.notes)
    assert any("Fx" in note and "Tz" in note and "apart" in note for note in apart.notes)


@pytest.mark.parametrize("exponent", [1.5, 2.0])
def test_the_usual_price_is_that_of_a_cost_of_power_one_and_a_half_from_half_the_force(
    exponent: float,
) -> None:
    """From the price p of half of the largest force: p sqrt(2), but at most the largest price."""
    model = PowerLaw(0.3, exponent=exponent)
    pod = Azimuth("pod", (0.3, 0, 0), (0, 0, 1), (1, 0, 0), (0.0, 40.0), model)
    (response,) = AllocatorCache().method(Layout("one", (pod,))).compiled.responses
    of_half = exponent * 0.3 * 20.0 ** (exponent - 1.0)
    of_all = exponent * 0.3 * 40.0 ** (exponent - 1.0)
    expected = min(math.sqrt(2.0) * of_half, of_all)
    assert _usual_price(response) == pytest.approx(expected, rel=0.02)
    if exponent > 1.5:
        assert expected < 0.8 * of_all
