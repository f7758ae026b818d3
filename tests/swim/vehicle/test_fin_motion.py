"""How fins follow their commands: lag, limits, and the power of their beating."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from finlab.actuators.law import OWN_INERTIA, Blade
from finlab.assets import shipped_layouts
from finlab.layout import Layout, Servo, load_layout
from finlab.swim.vehicle.fin_motion import COPPER_LOSS, FinLag, FinMotion

STEP_S = 0.01
"""A step of the simulation [s]."""


@pytest.fixture(scope="module")
def pair() -> Layout:
    """Two fins."""
    return load_layout(shipped_layouts()["pair"])


def driven(layout: Layout, servo: Servo) -> Layout:
    """The layout with the same servo at all fins."""
    return replace(layout, actuators=tuple(replace(fin, servo=servo) for fin in layout.fins))


def flapping(
    layout: Layout,
    amplitude: float,
    frequency: float,
    direction: float,
    copper_loss: float = COPPER_LOSS,
) -> FinMotion:
    """Fins that have followed a command for long."""
    motion = FinMotion(layout, copper_loss)
    motion.value[0] = amplitude
    motion.value[1] = frequency
    motion.value[2] = direction
    return motion


def test_the_filters_are_critically_damped_and_exact(pair: Layout) -> None:
    """Against the differential equation x'' = k (k/4 (x* - x) - x') by SciPy."""
    slow = Servo(amplitude_pole=3.0, frequency_pole=5.0, direction_pole=2.0)
    layout = pair.replace_actuator(pair.names[1], servo=slow)
    motion = FinMotion(layout)
    command = np.array([[0.3, 1.0, 1.2], [0.5, 0.7, -0.4]])
    for _ in range(37):
        motion.step(command, STEP_S)
    for value, aim, gains in (
        (motion.value[0], command[:, 0], (15.0, 6.0)),
        (motion.value[1], command[:, 1], (15.0, 10.0)),
        (motion.value[2], command[:, 2], (7.0, 4.0)),
    ):
        for i, k in enumerate(gains):
            exact = solve_ivp(
                lambda _, y, k=k, goal=aim[i]: [y[1], k * (k / 4 * (goal - y[0]) - y[1])],
                (0.0, 37 * STEP_S),
                [0.0, 0.0],
                rtol=1e-10,
                atol=1e-12,
            )
            assert value[i] == pytest.approx(exact.y[0, -1], abs=1e-8)


def test_fins_turn_the_short_way_over_the_seam(pair: Layout) -> None:
    motion = FinMotion(pair)
    motion.value[2][:] = 3.0
    for _ in range(300):
        motion.step(np.tile([0.2, 1.0, -3.0], (2, 1)), STEP_S)
    np.testing.assert_allclose(motion.value[2], 2 * math.pi - 3.0, atol=1e-3)


def test_speed_limit_cuts_fast_flapping_and_turning(pair: Layout) -> None:
    motion = FinMotion(driven(pair, Servo(speed_limit=4.0)))
    speeds = []
    for _ in range(300):
        motion.step(np.tile([0.6, 2.0, 3.1], (2, 1)), STEP_S)
        speeds.append(np.abs(motion.value[0] * 2 * math.pi * motion.value[1]).max())
    assert speeds[-1] == pytest.approx(4.0) and max(speeds) <= 4.0 + 1e-9
    for _ in range(30):  # the frequency falls, the amplitude may grow again
        motion.step(np.tile([0.6, 1.0, 3.1], (2, 1)), STEP_S)
        assert np.abs(motion.value[0] * 2 * math.pi * motion.value[1]).max() <= 4.0 + 1e-9
    free = FinMotion(pair)
    slow = FinMotion(driven(pair, Servo(speed_limit=0.5)))
    for _ in range(50):
        for each in (free, slow):
            each.step(np.tile([0.05, 0.1, 3.0], (2, 1)), STEP_S)
    assert slow.value[2][0] < free.value[2][0] - 0.5


def test_accelerations_are_those_of_the_speed(pair: Layout) -> None:
    """Fins that beat, grow, gather speed and turn at once."""
    motion = flapping(pair, 0.2, 1.0, 0.3)
    dt = 1e-4
    command = np.array([[0.5, 1.7, 1.8], [0.1, 0.4, -0.9]])
    angles = []
    speeds = []
    found = []
    for _ in range(1000):
        steps = motion.steps(command, dt, 3)
        angles.extend(steps.angle)
        speeds.extend(steps.speed)
        found.extend(steps.acceleration)
        np.testing.assert_allclose(steps.angle[-1], motion.angle, rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.diff(angles, axis=0)[5:] / dt, speeds[6:], atol=0.02)
    np.testing.assert_allclose(np.diff(speeds, axis=0)[5:] / dt, found[6:], atol=0.1)
    assert np.abs(found).max() > 20.0


def test_mean_power_is_what_a_sinusoid_has(pair: Layout) -> None:
    """Mean of |I alpha omega| over a cycle: I A^2 (2 pi f)^3 / pi; the others have closed forms,
    too."""
    amplitude = 0.4
    frequency = 1.25
    command = np.tile([amplitude, frequency, 0.0], (2, 1))
    n_steps = 10 * round(1 / (frequency * STEP_S))
    steps = flapping(pair, amplitude, frequency, 0.0, 0.7).steps(command, STEP_S, n_steps)
    cold = flapping(pair, amplitude, frequency, 0.0, 0.0).steps(command, STEP_S, n_steps)
    inertial = steps.inertial_power[:, 0]
    torque = cold.driving_power[:, 0]
    driving = steps.driving_power[:, 0]
    swing = 2 * math.pi * frequency
    assert np.mean(inertial) == pytest.approx(
        OWN_INERTIA * amplitude**2 * swing**3 / math.pi, rel=0.01
    )
    assert np.mean(torque) == pytest.approx(Blade().power(amplitude, frequency), rel=0.01)
    # The mean squared torque: parts of inertia and of drag.
    squares = 0.5 * Blade().inertia ** 2 + 0.375 * (Blade().drag * amplitude) ** 2
    heat = 0.7 * amplitude**2 * swing**4 * squares
    assert np.mean(driving) == pytest.approx(Blade().power(amplitude, frequency) + heat, rel=0.01)


def test_steps_at_once_are_as_many_single_ones(pair: Layout) -> None:
    """Fins of which one stops on the way."""
    together = flapping(pair, 0.3, 1.2, 0.4)
    single = flapping(pair, 0.3, 1.2, 0.4)
    for command in ([[0.5, 1.7, 2.9], [0.2, 0.6, -3.0]], [[0.5, 1.0, 1.0], [math.nan] * 3]):
        steps = together.steps(np.array(command), STEP_S, 9)
        for k in range(9):
            alone = single.steps(np.array(command), STEP_S, 1)
            for values, value in zip(steps, alone, strict=True):
                np.testing.assert_array_equal(values[k], value[0])
        np.testing.assert_array_equal(together.command, single.command)
    assert steps.beats[:, 0].all() and not steps.beats[:, 1].any()
    assert (together.command[1, :2] == 0.0).all() and (together.rate[:, 1] == 0.0).all()
    assert (np.abs(steps.mean_command[..., 2]) <= math.pi).all()


def test_one_step_per_period_follows_as_the_small_steps_do(layout_a: Layout) -> None:
    rng = np.random.default_rng(5)
    slow = Servo(amplitude_pole=3.0, frequency_pole=2.0, direction_pole=1.5)
    layout = layout_a.replace_actuator("back_left", servo=slow)
    lag = FinLag(layout)
    motion = FinMotion(layout)
    low = layout.lower
    high = layout.upper
    for _ in range(40):
        command = low + rng.uniform(size=low.shape) * (high - low) * (0.9, 0.9, 0.5)
        for _ in range(10):
            motion.step(command, 0.01)
        lag.step(command, 0.1)
        np.testing.assert_allclose(lag.command, motion.command, atol=0.02)
    command[1] = np.nan
    motion.step(command, 0.1)
    lag.step(command, 0.1)
    still = lag.command
    np.testing.assert_allclose(still[1], motion.command[1], atol=0.02)
    assert still[1, 0] == still[1, 1] == 0.0 and lag.value[2][1] == still[1, 2]
