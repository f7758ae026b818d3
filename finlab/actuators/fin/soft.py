"""A soft fin as such fins are measured: its thrust saturates and then falls, and leans off its direction."""

from typing import Any

import numpy as np

from finlab.actuators.law import PlanarLaw
from finlab.arrays import Array, Values, library_of


class Soft(PlanarLaw):
    """T = k x^p / (1 + (x / x0)^q) (1 + e cos(phi - phi_e)) with x = A f, along phi + d."""

    def __init__(self, k: Any, p: Any, x0: Any, q: Any, e: Any, phi_e: Any, d: Any) -> None:
        """Takes thrust scale [N], exponents, saturation [rad Hz], unevenness, its angle and lean [rad]."""
        self._k, self._p, self._x0, self._q, self._e, self._phi_e = k, p, x0, q, e, phi_e
        self.offset = d
        self.uniform = not np.any(e)

    def thrust(self, amplitude: Values, frequency: Values, zero_direction: Values) -> Values:
        x = amplitude * frequency
        cos = library_of(zero_direction).cos
        uneven = 1.0 + self._e * cos(zero_direction - self._phi_e)
        return self._k * x**self._p / (1.0 + (x / self._x0) ** self._q) * uneven

    def thrust_gradient(
        self, amplitude: Array, frequency: Array, zero_direction: Array
    ) -> tuple[Array, Array, Array | float]:
        x = amplitude * frequency
        fall = (x / self._x0) ** self._q
        # x dT/dx over T is p - q fall / (1 + fall); at rest the slope of x^p is taken a hair above zero.
        safe = np.maximum(x, 1e-12)
        size = self._k * safe**self._p / (1.0 + fall)
        by_x = size / safe * (self._p - self._q * fall / (1.0 + fall))
        turned = zero_direction - self._phi_e
        uneven = 1.0 + self._e * np.cos(turned)
        return by_x * uneven * frequency, by_x * uneven * amplitude, -size * self._e * np.sin(turned)
