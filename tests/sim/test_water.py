"""How water moves: currents that turn, waves by theory, and what a body feels of both."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from finlab.errors import FinlabError
from finlab.layout import Body
from finlab.sim import Changing, SteadyCurrent, Still, Water, Waves
from finlab.vehicle.body import GRAVITY
from finlab.vehicle.vehicle import Vehicle

PLACE = (0.7, -0.3, -1.2)
LONG = Waves(height_m=0.3, period_s=3.0, spread_rad=0.0, components=1, seed=4)


def velocity(water: Water, place: Sequence[float], time: float) -> np.ndarray:
    return np.array(water.flow(place, time).velocity)


@pytest.mark.parametrize(
    "water",
    [
        Still(),
        SteadyCurrent((0.1, 0.2, 0.0)),
        Waves(seed=3),
        Changing(SteadyCurrent((0.1, 0.0, 0.02)), Waves(seed=2), 2.0, 5.0),
    ],
    ids=lambda water: water.name,
)
def test_accelerations_are_those_of_the_velocity(water: Water) -> None:
    h = 1e-5
    for time in (0.0, 3.7, 5.2, 9.0):
        slope = (velocity(water, PLACE, time + h) - velocity(water, PLACE, time - h)) / (2 * h)
        np.testing.assert_allclose(water.flow(PLACE, time).acceleration, slope, atol=1e-7)


def test_one_wave_is_that_of_linear_theory() -> None:
    """Deep water: w^2 = g k, circles whose radius falls with exp(k z), and no divergence."""
    pace = 2 * math.pi / 3.0 * (1.25 / math.log(2.0)) ** 0.25
    number, amplitude = pace**2 / GRAVITY, 0.25 * 0.3 * math.sqrt(2.0)
    times = np.linspace(0.0, 2 * math.pi / pace, 50)
    deep = np.array([velocity(LONG, PLACE, t) for t in times])
    radius = amplitude * pace * math.exp(-1.2 * number)
    np.testing.assert_allclose(np.hypot(deep[:, 0], deep[:, 2]), radius, rtol=1e-9)
    np.testing.assert_allclose(deep[-1], deep[0], atol=1e-9)
    h = 1e-5
    slopes = [
        (velocity(LONG, (0.7 + h, -0.3, -1.2), 1.0) - velocity(LONG, (0.7 - h, -0.3, -1.2), 1.0))[0],
        (velocity(LONG, (0.7, -0.3, -1.2 + h), 1.0) - velocity(LONG, (0.7, -0.3, -1.2 - h), 1.0))[2],
    ]
    assert sum(slopes) / (2 * h) == pytest.approx(0.0, abs=1e-9) and abs(slopes[0]) > 1e-8
    length = math.tau / number  # it runs along x: the same a wavelength further on
    np.testing.assert_allclose(
        velocity(LONG, (0.7 + length, -0.3, -1.2), 1.0), velocity(LONG, PLACE, 1.0), atol=1e-9
    )


def test_waves_are_as_high_as_they_are_said_to_be() -> None:
    """Four standard deviations of the surface, which rises as fast as the water there."""
    water = Waves(height_m=0.4, period_s=2.0, seed=2)
    times = np.arange(0.0, 600.0, 0.05)
    rising = np.array([velocity(water, (0.0, 0.0, 0.0), t)[2] for t in times])
    surface = np.cumsum(rising) * 0.05
    assert 4.0 * np.std(surface - surface.mean()) == pytest.approx(0.4, rel=0.1)
    assert (velocity(water, PLACE, 1.0) != velocity(Waves(0.4, 2.0, seed=5), PLACE, 1.0)).all()
    drifting = Waves(0.4, 2.0, seed=2, current=(0.1, 0.0, 0.0))
    np.testing.assert_allclose(velocity(drifting, PLACE, 3.0) - velocity(water, PLACE, 3.0), (0.1, 0, 0))


def test_a_body_as_heavy_as_water_goes_with_it() -> None:
    """In water that is shaken as a whole nothing but its attitude tells a neutral body from the water."""
    vehicle = Vehicle(
        Body(
            mass_kg=20.0,
            inertia_kgm2=(0.5, 0.6, 0.7),
            added_mass=(9.0, 15.0, 30.0, 0.1, 0.2, 0.3),
            linear_damping=(5.0,) * 6,
            quadratic_damping=(20.0,) * 6,
        )
    )
    state = np.zeros(13)
    state[3:7] = np.array([0.8, 0.2, -0.3, 0.48]) / np.linalg.norm([0.8, 0.2, -0.3, 0.48])
    dt, w = 0.005, 2.0
    for k in range(800):
        t = (k + 0.5) * dt
        vehicle.current = (0.2 * math.sin(w * t), 0.1 * math.sin(w * t), 0.0)
        vehicle.acceleration = (0.2 * w * math.cos(w * t), 0.1 * w * math.cos(w * t), 0.0)
        state = vehicle.step(state, [0.0] * 6, dt)
    moved = np.array((0.2, 0.1)) * (1.0 - math.cos(w * 4.0)) / w
    np.testing.assert_allclose(state[:3], [*moved, 0.0], atol=2e-4)
    np.testing.assert_allclose(state[10:], 0.0, atol=1e-6)


@pytest.mark.parametrize(
    "make",
    [
        lambda: SteadyCurrent((0.1, 0.2)),
        lambda: SteadyCurrent((0.1, math.nan, 0.0)),
        lambda: Changing(Still(), Still(), 1.0, over_s=0.0),
        lambda: Waves(height_m=0.0),
        lambda: Waves(period_s=-1.0),
        lambda: Waves(components=0),
        lambda: Changing(Still(), Still(), math.nan),
        lambda: Changing(Still(), Still(), 1.0, 0.0),
        lambda: Waves(spread_rad=-0.1),
    ],
)
def test_water_that_is_none_is_refused(make: object) -> None:
    with pytest.raises(FinlabError, match="water: "):
        make()  # type: ignore[operator]
