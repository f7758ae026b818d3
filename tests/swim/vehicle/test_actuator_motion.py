"""How actuators of any kind follow their commands."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from finlab.actuators.thrust_model import PowerLaw
from finlab.layout import Azimuth, Layout, Rudder, Thruster, load_layout
from finlab.swim.vehicle.actuator_motion import ActuatorMotion, FirstOrderLag
from finlab.swim.vehicle.fin_motion import FinLag

LAW = PowerLaw(1.0)
"""Power over force of the thrusters."""
THRUSTER = Thruster(
    "t", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (-20.0, 30.0), LAW, time_constant=0.3, rate=25.0
)
"""A thruster with a lag and a rate."""
AZIMUTH = Azimuth(
    "a",
    (0.0, 0.0, 0.0),
    (0.0, 0.0, 1.0),
    (1.0, 0.0, 0.0),
    (0.0, 50.0),
    LAW,
    turn_rate=1.5,
    time_constant=0.2,
)
"""A pod with a lag and rates."""
RUDDER = Rudder(
    "r",
    (-1.0, 0.0, 0.0),
    (0.0, 0.0, 1.0),
    (1.0, 0.0, 0.0),
    0.01,
    (-0.5, 0.5),
    2.0,
    time_constant=0.1,
    rate=1.0,
)
"""A rudder with a rate."""


@pytest.fixture
def mixed() -> Layout:
    """A robot of all kinds, its fins not side by side."""
    fins = load_layout("pair").actuators
    return Layout("mixed", (THRUSTER, fins[0], AZIMUTH, RUDDER, fins[1]))


@pytest.mark.parametrize("dt", [0.02, 0.1, 0.7])
def test_each_follows_to_first_order_within_its_rate(mixed: Layout, dt: float) -> None:
    """Against the differential equations by SciPy."""
    motion = ActuatorMotion(mixed)
    command = np.full((5, 3), 0.1)
    command[0, 0] = -18.0
    command[2] = (2.0, 40.0, 0.0)
    command[3, 0] = 0.45
    n_steps = round(1.4 / dt)
    for _ in range(n_steps):
        motion.step(command, dt)
    for place, aim, time_constant, rate in (
        ((0, 0), -18.0, 0.3, 25.0),
        ((2, 1), 40.0, 0.2, math.inf),
        ((3, 0), 0.45, 0.1, 1.0),
    ):
        exact = solve_ivp(
            lambda _, x, aim=aim, t=time_constant, r=rate: np.clip((aim - x) / t, -r, r),
            (0.0, n_steps * dt),
            [0.0],
            rtol=1e-9,
            atol=1e-10,
        )
        assert motion.command[place] == pytest.approx(exact.y[0, -1], abs=1e-4)
    assert motion.command[2, 0] == pytest.approx(min(2.0, 1.5 * n_steps * dt))


def test_steps_at_once_are_as_many_single_ones() -> None:
    others = (THRUSTER, AZIMUTH, RUDDER)
    together = FirstOrderLag(others)
    single = FirstOrderLag(others)
    for command in (
        [[-18.0, 0.0, 0.0], [3.0, 40.0, 0.0], [0.45, 0.0, 0.0]],
        [[12.0, 0.0, 0.0], [-3.0, 5.0, 0.0], [math.nan] * 3],
    ):
        values = together.steps(np.array(command), 0.03, 8)
        for k in range(8):
            single.step(np.array(command), 0.03)
            np.testing.assert_allclose(values[k + 1], single.value, rtol=1e-12, atol=1e-13)
    assert together.value[2, 0] == values[0, 2, 0], "a rudder that stops stays where it is"


def test_fins_among_others_move_as_fins_alone(mixed: Layout) -> None:
    motion = ActuatorMotion(mixed)
    alone = FinLag(replace(mixed, actuators=mixed.fins))
    command = np.tile([0.4, 1.0, 0.5], (5, 1))
    for _ in range(7):
        motion.step(command, 0.1)
        alone.step(command[:2], 0.1)
    np.testing.assert_array_equal(motion.command[[1, 4]], alone.command)


def test_an_azimuth_turns_the_short_way_and_one_that_is_lost_stops(mixed: Layout) -> None:
    motion = ActuatorMotion(mixed)
    command = np.zeros((5, 3))
    for angle in (3.0, -3.0):
        command[2] = angle, 10.0, 0.0
        for _ in range(40):
            motion.step(command, 0.1)
    assert motion.direction[2] == pytest.approx(2.0 * math.pi - 3.0)
    assert motion.pushes.tolist() == [True, False, True, True, False]
    command[2] = math.nan
    motion.step(command, 0.1)
    assert motion.command[2].tolist() == pytest.approx([2.0 * math.pi - 3.0, 0.0, 0.0])
    assert motion.pushes.tolist() == [True, False, False, True, False]


def test_the_slowest_actuator_says_how_late_a_robot_is(mixed: Layout) -> None:
    assert mixed.delay_s == pytest.approx(0.2 + 0.2 * 2.0 * math.pi / 1.5)
    assert load_layout("A").delay_s == pytest.approx(2.0 / 3.5)
    assert load_layout("bluerov2_heavy").delay_s == pytest.approx(0.1)
