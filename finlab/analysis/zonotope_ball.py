"""How large a ball about zero the wrenches of n thrusters can hold, for one M = sum_i a_i a_i^T.

Thruster i adds y_i b_i, with its force y_i between two limits. Let f_i be half of their range,
a_i = f_i b_i, and rho the unevenness: by what share the stronger way exceeds the mean of both. Then
the radius r of the largest ball keeps

    r^2 <= K(n, m, rho) / tr(M^-1).

See docs/theory/layout-bound.md for the proof.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array

UNEVENNESS = (0.0, 0.1, 0.2, 0.4)
"""Values of rho for which `PLANAR_FACTORS` has K; from the last one on it stays the same."""
PLANAR_FACTORS: Mapping[int, tuple[float, ...]] = {
    4: (5.8285, 5.5339, 5.3362, 5.2361),
    5: (8.5778, 8.1739, 7.9010, 7.7613),
    6: (11.2855, 10.7792, 10.4373, 10.2620),
    7: (13.9690, 13.3639, 12.9564, 12.7475),
    8: (16.6371, 15.9353, 15.4640, 15.2229),
}
"""K(n, n - 2, rho) of n thrusters, rounded up; tests/analysis/uneven_factor.py proves them."""


class BallFactor(NamedTuple):
    """What bounds the balls of some thrusters."""

    factor: float
    """K [1]."""
    force: Array
    """The forces f (n,) [N] for which it holds."""


def ball_factor(least: Array, most: Array, n: int, m: int) -> BallFactor:
    """Returns K and the forces f of thrusters by their limits.

    Args:
        least: least forces (N,) [N].
        most: largest forces (N,) [N].
        n: how many of these N work at once.
        m: dimensions that they have to span, 1 to 6.
    """
    if n == m:
        # Each wrench is given by one set of forces: the weaker way counts.
        return BallFactor(inradius_factor(n, m), np.maximum(np.minimum(most, -least), 0.0))
    half_range = 0.5 * (most - least)
    even = BallFactor(inradius_factor(n, m), half_range)
    if n != m + 2:
        return even
    stronger = np.maximum(most, -least)
    has_range = half_range > 0.0
    own_unevenness = stronger[has_range] / half_range[has_range] - 1.0  # rho_i
    unevenness = float(own_unevenness.min(initial=1.0))
    # The weaker way of the others is raised until all are as uneven: f = stronger / (1 + rho).
    uneven = BallFactor(inradius_factor(n, m, unevenness), stronger / (1.0 + unevenness))
    return min(even, uneven, key=lambda one: one.factor * float(one.force @ one.force))


def inradius_factor(n: int, m: int, unevenness: float = 0.0) -> float:
    """Returns K(n, m, rho), for which r^2 <= K / tr(M^-1) holds of the largest ball.

    It is m (n - m + 1) by Cauchy-Schwarz. With two more thrusters than dimensions, even limits and
    evenly spaced lines in a plane have the largest one, and it falls with rho; there it is convex
    in rho, so that the line between two of its values is above it. It is 0 where n thrusters do not
    span m dimensions.

    Args:
        n: thrusters.
        m: dimensions, 1 to 6.
        unevenness: rho, 0 to 1, the same of all thrusters.
    """
    if n < m:
        return 0.0
    if n == m + 2:
        if n in PLANAR_FACTORS and unevenness > 0.0:
            return float(np.interp(unevenness, UNEVENNESS, PLANAR_FACTORS[n]))
        cotangent = 1.0 / math.tan(math.pi / (2.0 * n))
        return n - 4.0 + 4.0 / n * cotangent**2
    return float(m * (n - m + 1))
