"""Tables of force over price and gauges of directions in the core, beside scipy's cubic splines of
the same knots."""

import math

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from tests.core.internal_functions import REAL, GaugePoint, LineResponse, at, functions

CELLS = (1, 2, 7, 16)


class ForceTable:
    """A table of force over price, and the same cubics in scipy."""

    def __init__(self, cells: int, seed: int) -> None:
        """Makes a table whose force rises about as a root of the price.

        Args:
            cells: how many.
            seed: of the random law.
        """
        rng = np.random.default_rng([cells, seed])
        self.price_max = rng.uniform(0.5, 20.0)
        self.force_max = rng.uniform(5.0, 60.0)
        self.price = self.price_max * (np.arange(cells + 1) / cells) ** 4
        """Prices of the knots, Eq. 5."""
        rise = rng.uniform(0.5, 1.5, cells)
        force = np.append(0.0, np.cumsum(rise)) * self.force_max / rise.sum()
        # Slopes below those of the secants on both sides keep each cubic rising.
        secant = np.diff(force) / np.diff(self.price)
        slope = rng.uniform(0.5, 1.5, cells + 1) * np.minimum(
            np.append(secant[0], secant), np.append(secant, secant[-1])
        )
        self.force = CubicHermiteSpline(self.price, force, slope)
        self.slope = self.force.derivative()
        self.conjugate = self.force.antiderivative()
        knots = np.stack([force, slope, self.conjugate(self.price)], axis=1)
        self.numbers = np.concatenate([[self.price_max, cells, 0.0], knots.ravel()])

    def response(self, price: float) -> LineResponse:
        """What the core says of a price [W/N]."""
        told: LineResponse = functions().fl_force_of_price(at(self.numbers), REAL(price))
        return told

    def power(self, force: float) -> tuple[float, float]:
        """Power [W] of a force [N] and its price [W/N], by the core."""
        price = np.zeros(1)
        power = functions().fl_marginal_cost(at(self.numbers), REAL(force), at(price))
        return float(power), float(price[0])


@pytest.mark.parametrize("cells", CELLS)
@pytest.mark.parametrize("seed", range(3))
def test_force_slope_and_conjugate_are_those_of_cubics_between_the_knots(
    cells: int, seed: int
) -> None:
    table = ForceTable(cells, seed)
    rng = np.random.default_rng(seed)
    inside = table.price_max * rng.random(60) ** 3
    for price in [0.0, *inside, *(table.price[:-1] * (1.0 + 1e-9))]:
        told = table.response(price)
        assert told.force == pytest.approx(float(table.force(price)), rel=1e-9, abs=1e-12)
        assert told.slope == pytest.approx(float(table.slope(price)), rel=1e-6)
        assert told.conjugate == pytest.approx(float(table.conjugate(price)), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("cells", CELLS)
def test_beyond_its_prices_a_table_gives_its_least_and_largest_force(cells: int) -> None:
    table = ForceTable(cells, 5)
    for price in (-1.0, math.nan, 0.0):
        told = table.response(price)
        assert told.force == told.conjugate == 0.0
    whole = float(table.conjugate(table.price_max))
    for above in (0.0, 0.3, 4.0):
        told = table.response(table.price_max + above)
        assert told.force == pytest.approx(table.force_max)
        assert told.slope == 0.0
        assert told.conjugate == pytest.approx(whole + above * table.force_max)


@pytest.mark.parametrize("cells", CELLS)
@pytest.mark.parametrize("seed", range(3))
def test_a_force_costs_what_it_is_worth_at_its_price(cells: int, seed: int) -> None:
    """P(T) = v T - c*(v) at the price v with T(v) = T, found by bisection."""
    table = ForceTable(cells, seed)
    rng = np.random.default_rng([7, seed])
    knots = table.force(table.price)
    for force in [*(table.force_max * rng.random(40) ** 2), *knots]:
        power, price = table.power(force)
        wanted = brentq(
            lambda one, force=force: float(table.force(one)) - force,
            -1e-12,
            table.price_max * (1.0 + 1e-12),
            xtol=1e-15 * table.price_max,
        )
        assert price == pytest.approx(wanted, rel=1e-6, abs=1e-9 * table.price_max)
        assert power == pytest.approx(
            wanted * force - float(table.conjugate(wanted)),
            rel=1e-9,
            abs=1e-12 * table.price_max * table.force_max,
        )


class Gauge:
    """A gauge of directions with random points, and the same cubics in scipy."""

    def __init__(self, points: int, seed: int) -> None:
        """Makes a gauge.

        Args:
            points: how many directions.
            seed: of its random numbers.
        """
        rng = np.random.default_rng([points, seed])
        support = rng.uniform(0.8, 1.2, points)
        slope = rng.normal(size=points)
        radius = rng.uniform(0.8, 1.2, points)
        self.lean = rng.uniform(-math.pi, math.pi, points)
        """Angles [rad] from commands to forces, which pass the end of a turn here and there."""
        self.points = points
        columns = np.stack([support, slope, radius, self.lean], axis=1)
        self.numbers = np.concatenate([[points], columns.ravel()])
        turn = 2.0 * math.pi * np.arange(points + 1) / points
        around = np.arange(points + 1) % points
        self.support = CubicHermiteSpline(turn, support[around], slope[around])
        between_neighbours = (np.roll(radius, -1) - np.roll(radius, 1)) / (2.0 * turn[1])
        self.radius = CubicHermiteSpline(turn, radius[around], between_neighbours[around])


@pytest.mark.parametrize("points", [3, 8, 36])
def test_a_gauge_s_support_and_radius_are_those_of_periodic_cubics(points: int) -> None:
    gauge = Gauge(points, 1)
    rng = np.random.default_rng(points)
    for angle in [0.0, *rng.uniform(-7.0, 14.0, 80)]:
        turned = angle % (2.0 * math.pi)
        size = rng.uniform(0.1, 3.0)
        told: GaugePoint = functions().fl_gauge_support(
            at(gauge.numbers), REAL(size * math.cos(angle)), REAL(size * math.sin(angle))
        )
        assert told.value == pytest.approx(float(gauge.support(turned)), abs=1e-9)
        assert told.slope == pytest.approx(float(gauge.support(turned, 1)), abs=1e-7)
        assert told.bend == pytest.approx(float(gauge.support(turned, 2)), abs=1e-5)
        radius = functions().fl_gauge_radius(at(gauge.numbers), REAL(angle))
        assert radius == pytest.approx(float(gauge.radius(turned)), abs=1e-9)


@pytest.mark.parametrize("points", [3, 8, 36])
def test_a_gauge_s_lean_goes_the_short_way_from_point_to_point(points: int) -> None:
    gauge = Gauge(points, 2)
    for angle in np.random.default_rng(points).uniform(-7.0, 14.0, 80):
        cell, share = divmod((angle / (2.0 * math.pi) % 1.0) * points, 1.0)
        first = gauge.lean[int(cell)]
        last = gauge.lean[(int(cell) + 1) % points]
        short_way = math.remainder(last - first, 2.0 * math.pi)
        lean = functions().fl_gauge_lean(at(gauge.numbers), REAL(angle))
        assert lean == pytest.approx(first + share * short_way, abs=1e-9)


def test_an_angle_that_is_no_number_reads_the_first_point_of_a_gauge() -> None:
    gauge = Gauge(8, 3)
    radius = functions().fl_gauge_radius(at(gauge.numbers), REAL(math.nan))
    assert radius == pytest.approx(float(gauge.radius(0.0)))
