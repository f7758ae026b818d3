"""Drag propulsion: the cycle-mean thrust law that U-CAT uses on board. The default fin model."""

import math

import torch
from torch import Tensor

from finlab.layout.fin_model import MODEL_DEFAULTS

_DEFAULT = MODEL_DEFAULTS["drag"]


def direct_thrust(thrust: Tensor, zero_direction: Tensor) -> Tensor:
    """Returns thrust (...) [N] along zero direction (...) [rad] as a fin-frame force (..., 3) [N].

    A flapping fin's mean force lies in the plane its tip sweeps: nothing acts along the shaft.
    """
    along_shaft = torch.zeros_like(thrust)
    return torch.stack(
        [along_shaft, thrust * torch.cos(zero_direction), thrust * torch.sin(zero_direction)], dim=-1
    )


class Drag:
    """T = 2 rho Cd S rc^2 (2 pi f)^2 (1 - cos 2A) with half amplitude A and frequency f."""

    name = "drag"

    def __init__(
        self,
        density: float = _DEFAULT["density"],
        drag_coefficient: float = _DEFAULT["drag_coefficient"],
        area: float = _DEFAULT["area"],
        lever: float = _DEFAULT["lever"],
    ) -> None:
        """Takes water density [kg/m^3], drag coefficient, fin area [m^2] and lever to its centre [m]."""
        # 1 - cos 2A = 2 sin^2 A is written as the latter below: it keeps its digits at small amplitudes.
        self.coefficient = 4.0 * density * drag_coefficient * area * lever**2 * (2.0 * math.pi) ** 2
        """Thrust over f^2 sin^2(A) [N s^2]; 4.737 for the defaults."""

    def thrust(self, amplitude: Tensor, frequency: Tensor) -> Tensor:
        """Returns the mean thrust [N] at half amplitude [rad] and frequency [Hz], same shape."""
        return self.coefficient * torch.square(frequency * torch.sin(amplitude))

    def force(self, command: Tensor) -> Tensor:
        """Returns the mean force (..., 3) [N] in the fin frame of command (..., 3) [rad, Hz, rad]."""
        amplitude, frequency, zero_direction = command.unbind(dim=-1)
        return direct_thrust(self.thrust(amplitude, frequency), zero_direction)
