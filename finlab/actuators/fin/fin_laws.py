"""Laws of fins: drag propulsion, reactive propulsion, soft fins as they are measured; which model
has which.

Tables of measured or computed forces have their law in `table_law`, which is imported where a fin
has one.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.fin.fin_model import FinModelSpec
from finlab.actuators.law import Blade, FinLaw, PlanarLaw
from finlab.arrays import Array, Values, library_of


class Drag(PlanarLaw):
    """T = 2 rho Cd S rc^2 (2 pi f)^2 (1 - cos 2A) with half amplitude A and frequency f: the law on
    board of U-CAT."""

    def __init__(self, density: Any, drag_coefficient: Any, area: Any, lever: Any) -> None:
        """Takes water density [kg/m^3], drag coefficient, fin area [m^2] and lever to its centre
        [m]."""
        # 1 - cos 2A = 2 sin^2 A is written as the latter below: it keeps its digits at small
        # amplitudes.
        self.coefficient = 4.0 * density * drag_coefficient * area * lever**2 * (2.0 * math.pi) ** 2
        """Thrust over f^2 sin^2(A) [N s^2]; 4.737 for the defaults."""
        # A rectangle of that area whose centre lies at the lever, one edge on the shaft.
        self.blade = Blade(2.0 * lever, area / (2.0 * lever), density)

    def thrust(self, amplitude: Values, frequency: Values, zero_direction: Values = 0.0) -> Values:
        """See `PlanarLaw`; the zero direction does not matter."""
        return self.coefficient * (frequency * library_of(amplitude).sin(amplitude)) ** 2

    def thrust_gradient(
        self, amplitude: Array, frequency: Array, zero_direction: Array
    ) -> tuple[Array, Array, Array | float]:
        beat = 2.0 * self.coefficient * frequency * np.sin(amplitude)
        return beat * frequency * np.cos(amplitude), beat * np.sin(amplitude), 0.0


# J_n(x) = (x/2)^n sum_k (-1)^k (x/2)^(2k) / (k! (k+n)!). An amplitude is at most pi/2, where the
# terms fall below 1e-17 after k = 11; a few more keep float64 exact to |x| = 4.
_TERMS = 17
_J0, _J1 = (
    tuple((-1) ** k / (math.factorial(k) * math.factorial(k + n)) for k in range(_TERMS))
    for n in (0, 1)
)


def _series(coefficients: tuple[float, ...], x: Values) -> Values:
    squared = (0.5 * x) ** 2
    total = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        total = total * squared + coefficient
    return total


def bessel_j0(x: Values) -> Values:
    """Returns the Bessel function J0 of x, |x| <= 4: a polynomial, for arrays, tensors and symbols
    alike."""
    return _series(_J0, x)


def bessel_j1(x: Values) -> Values:
    """Returns the Bessel function J1 of x, |x| <= 4."""
    return 0.5 * x * _series(_J1, x)


class Lighthill(PlanarLaw):
    """T = 1/2 m L^2 (2 pi f)^2 A J1(A) with m = pi/4 rho W^2, the water moved per metre of trailing
    edge: the mean thrust of a stiff plate that turns by A about one end, at rest (Lighthill,
    1971)."""

    def __init__(self, density: Any, length: Any, width: Any) -> None:
        """Takes water density [kg/m^3], fin length from the shaft [m] and trailing-edge width
        [m]."""
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


class Soft(PlanarLaw):
    """T = k x^p / (1 + (x / x0)^q) (1 + e cos(phi - phi_e)) with x = A f, along phi + d: our form
    for soft fins, whose thrust saturates and then falls."""

    def __init__(self, k: Any, p: Any, x0: Any, q: Any, e: Any, phi_e: Any, d: Any) -> None:
        """Takes thrust scale [N], exponents, saturation [rad Hz], unevenness, its angle and lean
        [rad]."""
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

    def thrust_gradient(
        self, amplitude: Array, frequency: Array, zero_direction: Array
    ) -> tuple[Array, Array, Array | float]:
        x = amplitude * frequency
        fall = (x / self._x0) ** self._q
        # x dT/dx over T is p - q fall / (1 + fall); at rest the slope of x^p is taken a hair above
        # zero.
        safe = np.maximum(x, 1e-12)
        size = self._k * safe**self._p / (1.0 + fall)
        by_x = size / safe * (self._p - self._q * fall / (1.0 + fall))
        turned = zero_direction - self._phi_e
        uneven = 1.0 + self._e * np.cos(turned)
        return (
            by_x * uneven * frequency,
            by_x * uneven * amplitude,
            -size * self._e * np.sin(turned),
        )


PLANAR_LAWS: dict[str, type[PlanarLaw]] = {
    # Under the names of `FIN_MODELS`, which has their parameters.
    "drag": Drag,
    "lighthill": Lighthill,
    "soft": Soft,
}
"""Fin model -> law with a formula; its parameters may be arrays, one number for each of n fins."""


def make_law(spec: FinModelSpec) -> FinLaw:
    """Returns the law of one fin model. Raises DataError: it is a table whose file is missing or
    wrong."""
    values: dict[str, Any] = spec.values()
    if spec.type == "table":
        from finlab.actuators.fin.table_law import kept_table

        return kept_table(values["path"])
    return PLANAR_LAWS[spec.type](**values)


def stack_laws(specs: Sequence[FinModelSpec]) -> list[tuple[NDArray[np.intp], FinLaw]]:
    """Returns the laws of n fins as (places, law); fins of one formula, and those with tables of as
    many columns, are evaluated together. Errors as for `make_law`."""
    laws = [make_law(spec) for spec in specs]
    kinds = [(spec.type, law.has_power) for spec, law in zip(specs, laws, strict=True)]
    groups: list[tuple[NDArray[np.intp], FinLaw]] = []
    for kind in dict.fromkeys(kinds):
        places = np.array([i for i, own in enumerate(kinds) if own == kind])
        groups.append((places, _together([specs[i] for i in places], [laws[i] for i in places])))
    return groups


def _together(specs: list[FinModelSpec], laws: list[FinLaw]) -> FinLaw:
    """One law for fins of one formula, or with tables of as many columns."""
    if all(spec == specs[0] for spec in specs):
        return laws[0]
    if laws[0].measured:
        from finlab.actuators.fin.table_law import GridLaw, TableLaw

        return GridLaw([law.grid for law in laws if isinstance(law, TableLaw)])
    rows: list[dict[str, Any]] = [spec.values() for spec in specs]
    return PLANAR_LAWS[specs[0].type](
        **{name: np.array([row[name] for row in rows]) for name in rows[0]}
    )
