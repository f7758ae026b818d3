"""Reactive propulsion: Lighthill's large-amplitude elongated-body theory for a rigid fin in still water."""

import math
from typing import Any

from finlab.actuators.fin.blade import Blade
from finlab.actuators.law import PlanarLaw
from finlab.arrays import Array, Values

# J_n(x) = (x/2)^n sum_k (-1)^k (x/2)^(2k) / (k! (k+n)!). An amplitude is at most pi/2, where the terms fall
# below 1e-17 after k = 11; a few more keep float64 exact to |x| = 4.
_TERMS = 17
_J0, _J1 = (
    tuple((-1) ** k / (math.factorial(k) * math.factorial(k + n)) for k in range(_TERMS)) for n in (0, 1)
)


def _series(coefficients: tuple[float, ...], x: Values) -> Values:
    squared = (0.5 * x) ** 2
    total = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        total = total * squared + coefficient
    return total


def bessel_j0(x: Values) -> Values:
    """Returns the Bessel function J0 of x, |x| <= 4: a polynomial, for arrays, tensors and symbols alike."""
    return _series(_J0, x)


def bessel_j1(x: Values) -> Values:
    """Returns the Bessel function J1 of x, |x| <= 4."""
    return 0.5 * x * _series(_J1, x)


class Lighthill(PlanarLaw):
    """T = 1/2 m L^2 (2 pi f)^2 A J1(A) with m = pi/4 rho W^2, the water moved per metre of trailing edge."""

    def __init__(self, density: Any, length: Any, width: Any) -> None:
        """Takes water density [kg/m^3], fin length from the shaft [m] and trailing-edge width [m]."""
        virtual_mass = math.pi / 4.0 * density * width**2
        self.coefficient = 0.5 * virtual_mass * length**2 * (2.0 * math.pi) ** 2
        """Thrust over f^2 A J1(A) [N s^2]; 6.20 for the defaults."""
        self.blade = Blade(length, width, density)

    def thrust(self, amplitude: Values, frequency: Values, zero_direction: Values = 0.0) -> Values:
        """See `PlanarLaw`; the zero direction does not matter."""
        return self.coefficient * frequency**2 * amplitude * bessel_j1(amplitude)

    def thrust_gradient(
        self, amplitude: Array, frequency: Array, zero_direction: Array
    ) -> tuple[Array, Array, Array | float]:
        beat = self.coefficient * frequency * amplitude
        # d(A J1)/dA = A J0
        return beat * frequency * bessel_j0(amplitude), 2.0 * beat * bessel_j1(amplitude), 0.0
