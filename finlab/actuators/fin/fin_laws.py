"""Laws of fins as formulas: drag propulsion, reactive propulsion, and soft fins; and the law of a
model by its name.

Tables of measured or computed forces have their law in `table_law`, which is imported where a fin
has one.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.fin.fin_model import FinModelSpec
from finlab.actuators.law import Blade, FinLaw, Formula, PlanarLaw
from finlab.arrays import ROUNDING, Array, Values, library_of


class Drag(PlanarLaw):
    """T = 2 rho Cd S rc^2 (2 pi f)^2 (1 - cos 2A) with half amplitude A and frequency f: the law on
    board of U-CAT."""

    def __init__(self, density: Any, drag_coefficient: Any, area: Any, lever: Any) -> None:
        """Takes the parameters of one fin, or arrays (n,) of n fins.

        Args:
            density: density rho of the water [kg/m^3].
            drag_coefficient: Cd of the blade [1].
            area: area S of the blade [m^2].
            lever: distance rc of the blade's centre from the shaft [m].
        """
        # 1 - cos 2A = 2 sin^2 A is written as the latter: it keeps its digits at small amplitudes.
        self.coefficient = 4.0 * density * drag_coefficient * area * lever**2 * (2.0 * math.pi) ** 2
        """Thrust over f^2 sin^2(A) [N s^2]; 4.737 for the defaults."""
        # A rectangle of that area, one edge on the shaft, the centre at the lever.
        length = 2.0 * lever
        self.blade = Blade(length=length, width=area / length, density=density)

    def thrust(self, amplitude: Values, frequency: Values, zero_direction: Values = 0.0) -> Values:
        """See `PlanarLaw`; it does not depend on the zero direction."""
        # Mostly asked of arrays, many times for one answer.
        sin = np.sin if isinstance(amplitude, np.ndarray) else library_of(amplitude).sin
        return self.coefficient * (frequency * sin(amplitude)) ** 2

    def formula(self) -> Formula:
        return Formula("FL_DRAG", {"coefficient": self.coefficient, **self.blade_numbers()})

    def thrust_gradient(
        self, amplitude: Array, frequency: Array, zero_direction: Array
    ) -> tuple[Array, Array, Array | float]:
        # T = c f^2 sin^2 A
        twice = 2.0 * self.coefficient * frequency * np.sin(amplitude)
        return twice * frequency * np.cos(amplitude), twice * np.sin(amplitude), 0.0


_TERMS = 17
"""Terms of the Bessel functions' series: at pi/2, the largest amplitude, they fall below 1e-17
after 11; a few more keep double precision to |x| = 4."""


FEW = 64
"""Up to how many numbers powers are quicker than Horner's scheme."""


def _bessel_coefficients(order: int) -> Array:
    """Coefficients of J_n(x) = (x/2)^n sum_k (-1)^k (x/2)^(2k) / (k! (k+n)!), by k."""
    coefficients = []
    for k in range(_TERMS):
        coefficients.append((-1) ** k / (math.factorial(k) * math.factorial(k + order)))
    return np.array(coefficients)


_J0 = _bessel_coefficients(0)
_J1 = _bessel_coefficients(1)


def _series(coefficients: Array, x: Values) -> Values:
    """The sum of a series in (x/2)^2, by Horner's scheme; of few numbers by their powers, which
    takes a fifth of the time."""
    half_squared = (0.5 * x) ** 2
    if isinstance(x, np.ndarray) and x.size <= FEW:
        powers = np.empty((_TERMS, x.size))
        powers[0] = 1.0
        powers[1:] = half_squared.ravel()
        np.multiply.accumulate(powers, axis=0, out=powers)
        sums = coefficients @ powers
        return sums.reshape(x.shape).astype(x.dtype, copy=False)
    last_first = coefficients[::-1].tolist()
    total = last_first[0]
    for coefficient in last_first[1:]:
        total = total * half_squared + coefficient
    return total


def bessel_j0(x: Values) -> Values:
    """Returns the Bessel function J0 of x (...), |x| <= 4: a polynomial, for arrays, tensors and
    symbols alike."""
    return _series(_J0, x)


def bessel_j1(x: Values) -> Values:
    """Returns the Bessel function J1 of x (...), |x| <= 4."""
    return 0.5 * x * _series(_J1, x)


class Lighthill(PlanarLaw):
    """T = 1/2 m L^2 (2 pi f)^2 A J1(A) with m = pi/4 rho W^2, the water moved per metre of trailing
    edge: the mean thrust of a stiff plate that turns by A about one end, at rest (Lighthill,
    1971)."""

    def __init__(self, density: Any, length: Any, width: Any) -> None:
        """Takes the parameters of one fin, or arrays (n,) of n fins.

        Args:
            density: density rho of the water [kg/m^3].
            length: length L from the shaft [m].
            width: width W of the trailing edge [m].
        """
        virtual_mass = math.pi / 4.0 * density * width**2
        self.coefficient = 0.5 * virtual_mass * length**2 * (2.0 * math.pi) ** 2
        """Thrust over f^2 A J1(A) [N s^2]; 6.20 for the defaults."""
        self.blade = Blade(length, width, density)

    def thrust(self, amplitude: Values, frequency: Values, zero_direction: Values = 0.0) -> Values:
        """See `PlanarLaw`; it does not depend on the zero direction."""
        return self.coefficient * frequency**2 * amplitude * bessel_j1(amplitude)

    def formula(self) -> Formula:
        return Formula("FL_LIGHTHILL", {"coefficient": self.coefficient, **self.blade_numbers()})

    def thrust_gradient(
        self, amplitude: Array, frequency: Array, zero_direction: Array
    ) -> tuple[Array, Array, Array | float]:
        # T = c f^2 A J1(A), and d(A J1)/dA = A J0
        factor = self.coefficient * frequency * amplitude
        return factor * frequency * bessel_j0(amplitude), 2.0 * factor * bessel_j1(amplitude), 0.0


class Soft(PlanarLaw):
    """T = k x^p / (1 + (x / x0)^q) (1 + e cos(phi - phi_e)) with x = A f, along phi + d: ours
    for soft fins, whose thrust saturates and then falls."""

    def __init__(self, k: Any, p: Any, x0: Any, q: Any, e: Any, phi_e: Any, d: Any) -> None:
        """Takes the parameters of one fin, or arrays (n,) of n fins.

        Args:
            k: thrust at x = 1 rad Hz, before it saturates [N].
            p: exponent with which thrust grows [1].
            x0: x from which thrust saturates and falls [rad Hz].
            q: exponent of that fall [1].
            e: unevenness, the share by which thrust differs with direction [1].
            phi_e: zero direction of the largest thrust [rad].
            d: angle from the zero direction to the thrust [rad].
        """
        self._k = k
        self._p = p
        self._x0 = x0
        self._q = q
        self._e = e
        self._phi_e = phi_e
        self.offset = d
        self.unevenness = (e, phi_e)
        self.uniform = not np.any(e)

    def thrust(self, amplitude: Values, frequency: Values, zero_direction: Values) -> Values:
        x = amplitude * frequency
        cos = library_of(zero_direction).cos
        uneven = 1.0 + self._e * cos(zero_direction - self._phi_e)
        return self._k * x**self._p / (1.0 + (x / self._x0) ** self._q) * uneven

    def formula(self) -> Formula:
        numbers = {
            "coefficient": self._k,
            "rise_exponent": self._p,
            "fall_begin": self._x0,
            "fall_exponent": self._q,
            "unevenness": self._e,
            "unevenness_angle": self._phi_e,
            "lean_angle": self.offset,
        }
        return Formula("FL_SOFT", numbers | self.blade_numbers())

    def thrust_gradient(
        self, amplitude: Array, frequency: Array, zero_direction: Array
    ) -> tuple[Array, Array, Array | float]:
        x = amplitude * frequency
        fall = (x / self._x0) ** self._q
        # x dT/dx over T is p - q fall / (1 + fall). At x = 0 the slope of x^p, which may be
        # infinite, is taken a little above.
        x_above_zero = np.maximum(x, ROUNDING)
        size = self._k * x_above_zero**self._p / (1.0 + fall)
        by_x = size / x_above_zero * (self._p - self._q * fall / (1.0 + fall))
        angle = zero_direction - self._phi_e
        uneven = 1.0 + self._e * np.cos(angle)
        by_direction = -size * self._e * np.sin(angle)
        return by_x * uneven * frequency, by_x * uneven * amplitude, by_direction


PLANAR_LAWS: dict[str, type[PlanarLaw]] = {
    # Under the names of `FIN_MODELS`, which has their parameters.
    "drag": Drag,
    "lighthill": Lighthill,
    "soft": Soft,
}
"""Fin model -> law with a formula; its parameters may be arrays, one number for each of n fins."""


def make_law(spec: FinModelSpec) -> FinLaw:
    """Returns the law of one fin's model. Raises DataError: it is a table whose file is missing or
    wrong."""
    values: dict[str, Any] = spec.values()
    if spec.type == "table":
        from finlab.actuators.fin.table_law import kept_table

        return kept_table(values["path"])
    return PLANAR_LAWS[spec.type](**values)


def stack_laws(specs: Sequence[FinModelSpec]) -> list[tuple[NDArray[np.intp], FinLaw]]:
    """Returns the laws of n fins; fins with one formula, and those with tables of as many columns,
    are evaluated together.

    Args:
        specs: models of n fins.

    Returns:
        Laws, each with the indices of its fins among the n.

    Raises:
        DataError: as `make_law`.
    """
    laws = [make_law(spec) for spec in specs]
    families = [(spec.type, law.has_power) for spec, law in zip(specs, laws, strict=True)]
    stacked: list[tuple[NDArray[np.intp], FinLaw]] = []
    for family in dict.fromkeys(families):
        indices = np.array([i for i, own in enumerate(families) if own == family])
        law = _one_law([specs[i] for i in indices], [laws[i] for i in indices])
        stacked.append((indices, law))
    return stacked


def _one_law(specs: list[FinModelSpec], laws: list[FinLaw]) -> FinLaw:
    """One law for fins with one formula, or with tables of as many columns."""
    if all(spec == specs[0] for spec in specs):
        return laws[0]
    if laws[0].measured:
        from finlab.actuators.fin.table_law import GridLaw, TableLaw

        return GridLaw([law.grid for law in laws if isinstance(law, TableLaw)])
    by_fin: list[dict[str, Any]] = [spec.values() for spec in specs]
    parameters = {}
    for name in by_fin[0]:
        parameters[name] = np.array([values[name] for values in by_fin])
    return PLANAR_LAWS[specs[0].type](**parameters)
