"""Bessel functions and Lighthill's law against independent ones, over all of the promised range."""

import math

import numpy as np
import pytest
from scipy.special import j0, j1

from finlab.physics.lighthill import Lighthill, bessel_j0, bessel_j1


def test_exact_over_the_promised_range() -> None:
    x = np.linspace(-4.0, 4.0, 401)
    assert bessel_j0(x) == pytest.approx(j0(x), rel=0.0, abs=3e-15)
    assert bessel_j1(x) == pytest.approx(j1(x), rel=0.0, abs=3e-15)


def test_the_law_by_hand() -> None:
    law = Lighthill(1000.0, 0.1, 0.04)
    moved = math.pi / 4 * 1000.0 * 0.04**2
    a, f = np.array([0.2, 0.6, 1.5]), np.array([0.5, 2.0, 1.0])
    thrust = 0.5 * moved * (0.1 * 2 * math.pi * f) ** 2 * a * j1(a)
    assert law.thrust(a, f) == pytest.approx(thrust, rel=1e-12)
    by_a, by_f, by_d = law.thrust_slopes(a, f, np.zeros(3))
    assert by_a == pytest.approx(0.5 * moved * (0.1 * 2 * math.pi * f) ** 2 * a * j0(a), rel=1e-12)
    assert by_f == pytest.approx(2 * thrust / f, rel=1e-12)
    assert by_d == 0.0
