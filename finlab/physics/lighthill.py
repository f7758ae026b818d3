"""Reactive propulsion: Lighthill's large-amplitude elongated-body theory for a rigid fin in still water."""

import math

import torch
from torch import Tensor

from finlab.layout.fin_model import MODEL_DEFAULTS
from finlab.physics.drag import direct_thrust

_DEFAULT = MODEL_DEFAULTS["lighthill"]

# J1(x) = x/2 sum_k (-1)^k (x/2)^(2k) / (k! (k+1)!). An amplitude is at most pi/2, where the terms fall below
# 1e-17 after k = 11; a few more keep float64 exact to |x| = 4. A polynomial differentiates to any order,
# which torch.special.bessel_j1 does not.
_J1_COEFFICIENTS = tuple((-1) ** k / (math.factorial(k) * math.factorial(k + 1)) for k in range(17))


def bessel_j1(x: Tensor) -> Tensor:
    """Returns the Bessel function J1 of x, |x| <= 4, differentiable to any order."""
    squared = torch.square(x / 2)
    total = torch.full_like(x, _J1_COEFFICIENTS[-1])
    for coefficient in reversed(_J1_COEFFICIENTS[:-1]):
        total = total * squared + coefficient
    return x / 2 * total


class Lighthill:
    """T = 1/2 m L^2 (2 pi f)^2 A J1(A) with m = pi/4 rho W^2, the water moved per metre of trailing edge."""

    name = "lighthill"

    def __init__(
        self,
        density: float = _DEFAULT["density"],
        length: float = _DEFAULT["length"],
        width: float = _DEFAULT["width"],
    ) -> None:
        """Takes water density [kg/m^3], fin length from the shaft [m] and trailing-edge width [m]."""
        virtual_mass = math.pi / 4.0 * density * width**2
        self.coefficient = 0.5 * virtual_mass * length**2 * (2.0 * math.pi) ** 2
        """Thrust over f^2 A J1(A) [N s^2]; 6.20 for the defaults."""

    def thrust(self, amplitude: Tensor, frequency: Tensor) -> Tensor:
        """Returns the mean thrust [N] at half amplitude [rad] and frequency [Hz], same shape."""
        return self.coefficient * torch.square(frequency) * amplitude * bessel_j1(amplitude)

    def force(self, command: Tensor) -> Tensor:
        """Returns the mean force (..., 3) [N] in the fin frame of command (..., 3) [rad, Hz, rad]."""
        amplitude, frequency, zero_direction = command.unbind(dim=-1)
        return direct_thrust(self.thrust(amplitude, frequency), zero_direction)
