"""What sensors see of a robot: rates, noise, bias, delay and losses."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.swim.control import Measurement
from finlab.swim.simulation import NO_NOISE, NOISE_ALONE, SensorSettings
from finlab.swim.simulation.devices import NORMALS_AT_ONCE, NormalNumbers, Sensor, Sensors
from finlab.swim.vehicle.attitude import euler

STATE = np.zeros(13)
STATE[:4] = (1.0, 2.0, -3.0, 1.0)
STATE[7] = 0.2
"""State (13,) of a robot at 1, 2, -3 m, upright, with a surge of 0.2 m/s."""


def seen(settings: SensorSettings, steps: int, seed: int = 0) -> list[Measurement]:
    """What sensors say of a robot that stays as it is, every 0.01 s."""
    sensors = Sensors(settings, np.random.default_rng(seed))
    return [sensors.measure(0.01 * k, STATE.tolist()) for k in range(steps)]


def new(values: list[float] | Array) -> int:
    """How many times a value is another one than before."""
    return 1 + int((np.diff(values) != 0.0).sum())


def test_they_sample_at_their_rates_with_their_noise() -> None:
    found = seen(NOISE_ALONE, 6000)
    assert new([s.position[0] for s in found]) == 600 and new([s.velocity[0] for s in found]) == 300
    assert new([s.depth for s in found]) == 1200 and new([s.rates[2] for s in found]) == 3000
    assert np.std([s.depth for s in found]) == pytest.approx(0.005, rel=0.1)


def test_perfect_sensors_say_what_is_true_at_once() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        state = rng.standard_normal(13)
        state[3:7] /= np.linalg.norm(state[3:7])
        found = Sensors(NO_NOISE, rng).measure(0.0, state.tolist())
        np.testing.assert_allclose(
            found.as_array(), [*state[:3], *euler(state[3:7]), *state[7:]], rtol=1e-12, atol=1e-12
        )


def test_what_is_late_is_of_a_while_ago() -> None:
    settings = replace(NO_NOISE, marker=replace(NO_NOISE.marker, rate_hz=50.0)).later(0.1)
    sensors = Sensors(settings, np.random.default_rng(0))
    state = STATE.copy()
    for k in range(100):
        state[:3] = 0.02 * k
        found = sensors.measure(0.02 * k, state.tolist())
        assert found.position[0] == pytest.approx(0.02 * max(k - 5, 0)), (
            "at rest before the beginning"
        )
        assert found.depth <= 0.0
    assert settings.dvl.delay_s == pytest.approx(0.1) and NO_NOISE.dvl.delay_s == 0.0


def test_lost_samples_leave_the_last_ones_standing() -> None:
    settings = replace(NO_NOISE, pressure=Sensor(20.0, (0.01,), (0.0,), dropout=0.3))
    found = np.array([s.depth for s in seen(settings, 40_000)])[::5]
    assert (np.diff(found) != 0.0).mean() == pytest.approx(0.7, abs=0.03)


def test_what_no_sensor_has_is_refused() -> None:
    usual = SensorSettings().dvl
    for wrong in ({"rate_hz": 0.0}, {"delay_s": -0.1}, {"dropout": 1.0}, {"noise": (np.nan,) * 3}):
        with pytest.raises(FinlabError, match="sensors: dvl: expected"):
            SensorSettings(dvl=replace(usual, **wrong))


def test_noise_comes_in_the_order_of_its_generator() -> None:
    numbers = NormalNumbers(np.random.default_rng(3))
    taken = []
    for count in (1, 5, 4, 3) * 200:
        few = numbers.take(count)
        assert len(few) == count
        taken += few
    assert len(taken) > 4 * NORMALS_AT_ONCE
    assert taken == np.random.default_rng(3).standard_normal(len(taken)).tolist()
