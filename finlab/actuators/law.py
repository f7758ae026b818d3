"""Base of the laws of actuators: command to force in its own frame, and to power, with derivatives.

Own frames are those of `finlab.layout`, of a fin: shaft, zero, shaft x zero. A law's parameters are numbers,
or arrays (n,) where it speaks for n actuators at once. Laws of fins are written once, for numpy's arrays,
torch's tensors (which training differentiates by itself) and CasADi's symbols; derivatives in closed form
stand beside them. The other laws work with numpy's arrays.
"""

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from finlab.actuators.fin.blade import Blade
from finlab.arrays import Array, Values, library_of


class ActuatorLaw(ABC):
    """Command to force and power of one actuator, or of n actuators that share a law.

    `inflow` is the velocity (..., n, 3) [m/s] of their places through the water, in their own frames; None at
    rest. Laws that do not feel the flow pass over it.
    """

    feels_flow: bool = False
    """Whether force and power depend on the water that meets the actuator."""

    @abstractmethod
    def force(self, command: Values, inflow: Array | None = None) -> Values:
        """Returns the force (..., n, 3) [N], of fins the mean over a beat, in own frames, of commands
        (..., n, 3), in single or double precision as the commands are."""

    @abstractmethod
    def force_and_jacobian(self, command: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        """Returns the force and its derivative by each command in turn (..., n, 3 commands, 3 axes)."""

    @abstractmethod
    def power(self, command: Values, inflow: Array | None = None) -> Values:
        """Returns the power (..., n) [W] of commands (..., n, 3), of fins the mechanical one."""

    @abstractmethod
    def power_gradient(self, command: Array, inflow: Array | None = None) -> Array:
        """Returns the power's derivatives (..., n, 3) by each command."""


class FinLaw(ActuatorLaw):
    """The law of one flapping fin, or of n fins that share a model. Commands are half amplitude [rad],
    frequency [Hz] and zero direction [rad]."""

    uniform: bool = True
    """Whether the size of the force is the same whatever the zero direction."""
    blade: Blade = Blade()
    """The plate whose beating takes power, where nothing better is known."""

    def power(self, command: Values, inflow: Array | None = None) -> Values:
        return self.blade.power(command[..., 0], command[..., 1])

    def power_gradient(self, command: Array, inflow: Array | None = None) -> Array:
        jacobian = np.zeros(command.shape)
        jacobian[..., 0], jacobian[..., 1] = self.blade.power_gradient(command[..., 0], command[..., 1])
        return jacobian


class PlanarLaw(FinLaw):
    """A fin whose mean force lies in the plane that its tip sweeps: a size and a direction."""

    offset: Any = 0.0
    """Angle [rad] from the zero direction to the thrust."""

    @abstractmethod
    def thrust(self, amplitude: Values, frequency: Values, zero_direction: Values) -> Values:
        """Returns the size [N] of the force at half amplitude [rad], frequency [Hz], zero direction [rad]."""

    @abstractmethod
    def thrust_gradient(
        self, amplitude: Array, frequency: Array, zero_direction: Array
    ) -> tuple[Array, Array, Array | float]:
        """Returns the thrust's derivatives by amplitude, frequency and zero direction."""

    def force(self, command: Values, inflow: Array | None = None) -> Values:
        xp = library_of(command)
        amplitude, frequency, zero_direction = command[..., 0], command[..., 1], command[..., 2]
        thrust = self.thrust(amplitude, frequency, zero_direction)
        direction = zero_direction + self.offset
        if xp is np:
            # Half the time of `stack`, which counts: every answer of an allocator is judged by this.
            force = np.zeros((*thrust.shape, 3), thrust.dtype)
            np.multiply(thrust, np.cos(direction), out=force[..., 1])
            np.multiply(thrust, np.sin(direction), out=force[..., 2])
            return force
        # Nothing acts along the shaft.
        planar = [xp.zeros_like(thrust), thrust * xp.cos(direction), thrust * xp.sin(direction)]
        return xp.stack(planar, axis=-1)

    def force_and_jacobian(self, command: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        parts = command[..., 0], command[..., 1], command[..., 2]
        direction = parts[2] + self.offset
        cos, sin = np.cos(direction), np.sin(direction)
        thrust = self.thrust(*parts)
        force = np.zeros((*thrust.shape, 3))
        jacobian = np.zeros((*thrust.shape, 3, 3))
        force[..., 1], force[..., 2] = thrust * cos, thrust * sin
        for k, slope in enumerate(self.thrust_gradient(*parts)):
            jacobian[..., k, 1], jacobian[..., k, 2] = slope * cos, slope * sin
        jacobian[..., 2, 1] -= force[..., 2]
        jacobian[..., 2, 2] += force[..., 1]
        return force, jacobian
