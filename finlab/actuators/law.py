"""Base of the laws of actuators: command to force in its own frame, and to power, with derivatives.

Own frames are those of `finlab.layout`, of a fin: shaft, zero, shaft x zero. A law's parameters are
numbers, or arrays (n,) where it speaks for n actuators at once. Laws of fins are written once, for
numpy's arrays, torch's tensors (which training differentiates by itself) and CasADi's symbols;
derivatives in closed form stand beside them. The other laws work with numpy's arrays.

The power of a fin is that of a rigid plate that beats in still water, its inertia and its drag: it
turns as theta = A sin(2 pi f t) about its zero direction against the torque J theta'' + K theta'
|theta'|. Driving costs power; braking wins none back. The mean over a cycle of max(torque theta',
0) has the closed form used here: driving ends where sin = s0 with (K A / J) cos^2 = sin.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any, final

import numpy as np

from finlab.actuators.hermite_grid import size_numbers
from finlab.arrays import Array, Values, library_of

OWN_INERTIA = 0.0097
"""Moment of inertia about its shaft of a fin 0.20 m long and 0.10 m wide [kg m^2]: U-CAT's robot
description has a plate of 0.8 kg, 0.22 x 0.10 x 0.02 m, its centre 0.09 m from the shaft."""
EIGHT_PI2 = 8.0 * math.pi**2


@dataclass(frozen=True)
class Blade:
    """A rectangular plate that beats about one of its edges; U-CAT's where nothing else is known.

    Fields are numbers, or arrays (n,) for n fins.
    """

    length: Any = 0.20
    """From the shaft to the tip [m]; U-CAT's robot description has 0.22, its simulator 0.18."""
    width: Any = 0.10
    """Along the shaft [m]."""
    density: Any = 1000.0
    """Of the water [kg/m^3]."""
    drag_coefficient: Any = 2.0
    """Of a plate broadside to the flow."""

    @property
    def virtual_mass(self) -> Any:
        """Water carried per metre of length [kg/m]: pi/4 rho W^2."""
        return 0.25 * math.pi * self.density * self.width**2

    @property
    def drag_per_length(self) -> Any:
        """Normal force per metre of length and squared speed [N s^2/m^3]: 1/2 rho Cd W."""
        return 0.5 * self.density * self.drag_coefficient * self.width

    @property
    def own_inertia(self) -> Any:
        """Moment of inertia [kg m^2] of the blade itself: U-CAT's, in proportion to W L^3."""
        return OWN_INERTIA * (self.length / 0.20) ** 3 * (self.width / 0.10)

    @cached_property
    def inertia(self) -> Any:
        """J [kg m^2]: the blade's own and that of the water it carries."""
        return self.own_inertia + self.virtual_mass * self.length**3 / 3.0

    @cached_property
    def drag(self) -> Any:
        """K [N m s^2]: 1/8 rho Cd W L^4."""
        return 0.25 * self.drag_per_length * self.length**4

    @cached_property
    def _drag_over_inertia(self) -> Any:
        return self.drag / self.inertia

    def power(self, amplitude: Values, frequency: Values) -> Values:
        """Returns the mean mechanical power [W] at half amplitude [rad] and frequency [Hz]."""
        drag, inertia = self._shares(amplitude)
        beat = amplitude * frequency
        return EIGHT_PI2 * frequency * beat * beat * (drag * amplitude + inertia)

    def power_gradient(self, amplitude: Values, frequency: Values) -> tuple[Values, Values]:
        """Returns the power's derivatives by amplitude [W/rad] and frequency [W/Hz]."""
        drag, inertia = self._shares(amplitude)
        scale = EIGHT_PI2 * frequency * frequency * amplitude
        by_amplitude = scale * frequency * (3.0 * drag * amplitude + 2.0 * inertia)
        return by_amplitude, 3.0 * scale * amplitude * (drag * amplitude + inertia)

    def _shares(self, amplitude: Values) -> tuple[Values, Values]:
        """The parts of drag (over A) and of inertia in the mean power over (2 pi f)^3 A^2 / pi."""
        sqrt = library_of(amplitude).sqrt
        twice = 2.0 * self._drag_over_inertia * amplitude
        # Where the torque changes sign: s0 = (drag / inertia) A (1 - s0^2). The mean does not
        # change with s0.
        end = twice / (1.0 + sqrt(1.0 + twice * twice))
        squared = end * end
        drag = self.drag * (end * (1.0 - squared / 3.0) + 2.0 / 3.0)
        return drag, 0.5 * self.inertia * (1.0 - squared)


class ActuatorLaw(ABC):
    """Command to force and power of one actuator, or of n actuators that share a law.

    `inflow` is the velocity (..., n, 3) [m/s] of their places through the water, in their own
    frames; None at rest. Laws that do not feel the flow pass over it.
    """

    feels_flow: bool = False
    """Whether force and power depend on the water that meets the actuator."""

    @abstractmethod
    def force(self, command: Values, inflow: Array | None = None) -> Values:
        """Returns the force (..., n, 3) [N], of fins the mean over a beat, in own frames, of
        commands (..., n, 3), in single or double precision as the commands are."""

    @abstractmethod
    def force_and_jacobian(
        self, command: Array, inflow: Array | None = None
    ) -> tuple[Array, Array]:
        """Returns the force and its derivative by each command in turn (..., n, 3 commands, 3
        axes)."""

    @abstractmethod
    def power(self, command: Values, inflow: Array | None = None) -> Values:
        """Returns the power (..., n) [W] of commands (..., n, 3), of fins the mechanical one."""

    @abstractmethod
    def power_gradient(self, command: Array, inflow: Array | None = None) -> Array:
        """Returns the power's derivatives (..., n, 3) by each command."""


class FinLaw(ActuatorLaw):
    """The law of one flapping fin, or of n fins that share a model. Commands are half amplitude
    [rad], frequency [Hz] and zero direction [rad]."""

    uniform: bool = True
    """Whether the size of the force is the same whatever the zero direction."""
    blade: Blade = Blade()
    """The plate whose beating takes power, where nothing better is known."""

    offset: Any = 0.0
    """Angle [rad] from the zero direction to the thrust, where the law has one for all."""
    unevenness: tuple[float, float] = (0.0, 0.0)
    """e and phi_e: how the size depends on the zero direction, as 1 + e cos(phi - phi_e)."""
    measured: bool = False
    """Whether it is a table of forces rather than a formula."""
    notes: tuple[str, ...] = ()
    """What to know of the law, a sentence each."""

    @property
    def has_power(self) -> bool:
        """Whether it is known what power the fins take."""
        return True

    @abstractmethod
    def grid_numbers(self, lower: Array, upper: Array) -> Array:
        """Returns the law of one fin within limits (3,) as a grid for the core; see `grid_numbers`:
        forces along own axes, or their size alone, without the unevenness."""

    def power(self, command: Values, inflow: Array | None = None) -> Values:
        return self.blade.power(command[..., 0], command[..., 1])

    def power_gradient(self, command: Array, inflow: Array | None = None) -> Array:
        jacobian = np.zeros(command.shape)
        jacobian[..., 0], jacobian[..., 1] = self.blade.power_gradient(
            command[..., 0], command[..., 1]
        )
        return jacobian


class PlanarLaw(FinLaw):
    """A fin whose mean force lies in the plane across its shaft: a size T(A, f, phi), and the
    direction phi + `offset`.

    The response to a price is compiled from size and power in that plane, so that the lower bound
    of the power holds for such laws alone: `force` is final, and no subclass can add a force along
    the shaft. Where the size depends on the zero direction, `uniform` is False and `unevenness`
    says how.
    """

    def grid_numbers(self, lower: Array, upper: Array) -> Array:
        """See `FinLaw`: of the size."""
        even = 1.0 + self.unevenness[0]
        around = self.unevenness[1]
        return size_numbers(lambda a, f: np.asarray(self.thrust(a, f, around) / even), lower, upper)

    @abstractmethod
    def thrust(self, amplitude: Values, frequency: Values, zero_direction: Values) -> Values:
        """Returns the size [N] of the force at half amplitude [rad], frequency [Hz], zero direction
        [rad]."""

    @abstractmethod
    def thrust_gradient(
        self, amplitude: Array, frequency: Array, zero_direction: Array
    ) -> tuple[Array, Array, Array | float]:
        """Returns the thrust's derivatives by amplitude, frequency and zero direction."""

    @final
    def force(self, command: Values, inflow: Array | None = None) -> Values:
        xp = library_of(command)
        amplitude = command[..., 0]
        frequency = command[..., 1]
        zero_direction = command[..., 2]
        thrust = self.thrust(amplitude, frequency, zero_direction)
        direction = zero_direction + self.offset
        if xp is np:
            # Half the time of `stack`, which counts: every answer of an allocator is judged by
            # this.
            force = np.zeros((*thrust.shape, 3), thrust.dtype)
            np.cos(direction, out=force[..., 1])
            np.sin(direction, out=force[..., 2])
            planar = force[..., 1:]
            planar *= thrust[..., None]
            return force
        # Nothing acts along the shaft.
        parts = [xp.zeros_like(thrust), thrust * xp.cos(direction), thrust * xp.sin(direction)]
        return xp.stack(parts, axis=-1)

    @final
    def force_and_jacobian(
        self, command: Array, inflow: Array | None = None
    ) -> tuple[Array, Array]:
        parts = command[..., 0], command[..., 1], command[..., 2]
        direction = parts[2] + self.offset
        cos = np.cos(direction)
        sin = np.sin(direction)
        thrust = self.thrust(*parts)
        force = np.zeros((*thrust.shape, 3))
        jacobian = np.zeros((*thrust.shape, 3, 3))
        force[..., 1] = thrust * cos
        force[..., 2] = thrust * sin
        for k, slope in enumerate(self.thrust_gradient(*parts)):
            jacobian[..., k, 1] = slope * cos
            jacobian[..., k, 2] = slope * sin
        jacobian[..., 2, 1] -= force[..., 2]
        jacobian[..., 2, 2] += force[..., 1]
        return force, jacobian
