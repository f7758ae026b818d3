"""Drag propulsion: the cycle-mean thrust law that U-CAT uses on board. The default fin model."""

import math
from typing import Any

import numpy as np

from finlab.actuators.fin.blade import Blade
from finlab.actuators.law import PlanarLaw
from finlab.arrays import Array, Values, library_of


class Drag(PlanarLaw):
    """T = 2 rho Cd S rc^2 (2 pi f)^2 (1 - cos 2A) with half amplitude A and frequency f."""

    def __init__(self, density: Any, drag_coefficient: Any, area: Any, lever: Any) -> None:
        """Takes water density [kg/m^3], drag coefficient, fin area [m^2] and lever to its centre [m]."""
        # 1 - cos 2A = 2 sin^2 A is written as the latter below: it keeps its digits at small amplitudes.
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
