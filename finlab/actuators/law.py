"""Base of the laws of actuators: command to force in the own frame, and to power, with derivatives.

Own frames are those of `finlab.layout`, of a fin: shaft, zero, shaft x zero. A law's parameters are
numbers, or arrays (n,) where it holds for n actuators at once. Laws of fins are written once, for
numpy's arrays, torch's tensors (which training differentiates by itself) and CasADi's symbols;
derivatives in closed form stand with them. The other laws work with numpy's arrays.

The power of a fin is that of a rigid plate that beats in still water, its inertia and its drag: it
turns as theta = A sin(2 pi f t) about its zero direction against the torque J theta'' + K theta'
|theta'|. Driving costs power; braking recovers none. The mean over a cycle of max(torque theta', 0)
has the closed form used here: driving ends where sin = s0 with (K A / J) cos^2 = sin.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, final

import numpy as np

from finlab.actuators.hermite_grid import size_numbers
from finlab.arrays import Array, Values, library_of

OWN_INERTIA = 0.0097
"""Moment of inertia about its shaft of a fin 0.20 m long and 0.10 m wide [kg m^2]: U-CAT's robot
description has a plate of 0.8 kg, 0.22 x 0.10 x 0.02 m, its centre 0.09 m from the shaft."""
OWN_LENGTH = 0.20
"""Length of that fin [m]."""
OWN_WIDTH = 0.10
"""Width of that fin [m]."""
EIGHT_PI2 = 8.0 * math.pi**2
"""(2 pi)^3 / pi: of the mean power of a beat."""


@dataclass(frozen=True)
class Blade:
    """A rectangular plate that beats about one of its edges; U-CAT's where nothing else is known.

    Fields are numbers, or arrays (n,) for n fins.

    Args:
        length: from the shaft to the tip [m]; U-CAT's robot description has 0.22, its simulator
            0.18.
        width: along the shaft [m].
        density: density of the water [kg/m^3].
        drag_coefficient: that of a plate broadside to the flow [1].
    """

    length: Any = OWN_LENGTH
    width: Any = OWN_WIDTH
    density: Any = 1000.0
    drag_coefficient: Any = 2.0

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
        return OWN_INERTIA * (self.length / OWN_LENGTH) ** 3 * (self.width / OWN_WIDTH)

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
        """K / J [1/rad]."""
        return self.drag / self.inertia

    def power(self, amplitude: Values, frequency: Values) -> Values:
        """Returns the mean mechanical power of a beat.

        Args:
            amplitude: half amplitude A (...) [rad].
            frequency: frequency f (...) [Hz].

        Returns:
            8 pi^2 f^3 A^2 (k A + j) (...) [W], where k and j are the parts of drag and inertia.
        """
        drag, inertia = self._parts(amplitude)
        beat = amplitude * frequency
        return EIGHT_PI2 * frequency * beat * beat * (drag * amplitude + inertia)

    def power_gradient(self, amplitude: Values, frequency: Values) -> tuple[Values, Values]:
        """Returns the derivatives of `power` by amplitude (...) [W/rad] and by frequency (...)
        [W/Hz]. Those of k and j by the amplitude cancel, since s0 is where the torque is 0."""
        drag, inertia = self._parts(amplitude)
        scale = EIGHT_PI2 * frequency * frequency * amplitude
        by_amplitude = scale * frequency * (3.0 * drag * amplitude + 2.0 * inertia)
        by_frequency = 3.0 * scale * amplitude * (drag * amplitude + inertia)
        return by_amplitude, by_frequency

    def _parts(self, amplitude: Values) -> tuple[Values, Values]:
        """Parts of drag, over A, and of inertia in the mean power over (2 pi f)^3 A^2 / pi."""
        # Mostly asked of arrays, many times for one answer.
        sqrt = np.sqrt if isinstance(amplitude, np.ndarray) else library_of(amplitude).sqrt
        # The torque changes sign where s0 = (K A / J) (1 - s0^2).
        twice_ratio = 2.0 * self._drag_over_inertia * amplitude
        s0 = twice_ratio / (1.0 + sqrt(1.0 + twice_ratio * twice_ratio))
        s0_squared = s0 * s0
        drag = self.drag * (s0 * (1.0 - s0_squared / 3.0) + 2.0 / 3.0)
        inertia = 0.5 * self.inertia * (1.0 - s0_squared)
        return drag, inertia


class Formula(NamedTuple):
    """A law as the core evaluates it, see `finlab/core/src/actuator_formulas.c`."""

    kind: str
    """Its name there: `FL_DRAG` ..."""
    numbers: Mapping[str, Any]
    """Fields of `fl_formula` by name, numbers or arrays (n,)."""


class PowerFormula(NamedTuple):
    """The power of n actuators as the core evaluates it, see `fl_use_laws` in `finlab.h`."""

    formula: Formula
    """Of the actuators; of those with a curve kind and dead band alone."""
    curves: Sequence[Array | None] | None
    """Curves of the measured ones, None of the others; None where none is measured."""


class ActuatorLaw(ABC):
    """Command to force and power of one actuator, or of n actuators that share a law.

    Of one actuator the axis n is left out of all shapes.
    """

    feels_flow: bool = False
    """Whether force and power depend on the water that meets the actuator."""

    @abstractmethod
    def force(self, command: Values, inflow: Array | None = None) -> Values:
        """Returns the force of commands.

        Args:
            command: commands (..., n, 3) [rad, Hz or N, by kind].
            inflow: velocity (..., n, 3) of the actuators' points through the water, own frames
                [m/s]; None at rest. Laws that do not feel the flow ignore it.

        Returns:
            Forces (..., n, 3), own frames [N], of fins the mean over a beat; in single or double
            precision as the commands are.
        """

    @abstractmethod
    def force_and_jacobian(
        self, command: Array, inflow: Array | None = None
    ) -> tuple[Array, Array]:
        """Returns the force, and its derivative by the command.

        Args:
            command: commands (..., n, 3).
            inflow: as for `force`.

        Returns:
            Forces (..., n, 3) [N], and derivatives (..., n, 3 numbers of the command, 3 axes).
        """

    @abstractmethod
    def power(self, command: Values, inflow: Array | None = None) -> Values:
        """Returns the power of commands.

        Args:
            command: commands (..., n, 3).
            inflow: as for `force`.

        Returns:
            Power (..., n) [W], of fins the mechanical one.
        """

    @abstractmethod
    def power_gradient(self, command: Array, inflow: Array | None = None) -> Array:
        """Returns the derivatives (..., n, 3) of `power` by each number of the command."""

    def formula(self) -> Formula | None:
        """Returns the law as the core evaluates it; None of one that is no formula there."""
        return None

    def power_formula(self) -> PowerFormula | None:
        """Returns the power as the core evaluates it; None of one that it cannot."""
        formula = self.formula()
        return None if formula is None else PowerFormula(formula, None)


class FinLaw(ActuatorLaw):
    """Base of the laws of one flapping fin, or of n fins with the same model. Commands are half
    amplitude [rad], frequency [Hz] and zero direction [rad]."""

    uniform: bool = True
    """Whether the size of the force does not depend on the zero direction."""
    blade: Blade = Blade()
    """The plate whose beating takes power, where no power was measured."""

    offset: Any = 0.0
    """Angle from the zero direction to the thrust, of a law that has one for all commands [rad]."""
    unevenness: tuple[float, float] = (0.0, 0.0)
    """e [1] and phi_e [rad] of the factor 1 + e cos(phi - phi_e), by which the size of the force
    depends on the zero direction phi."""
    measured: bool = False
    """Whether it is a table of forces rather than a formula."""
    notes: tuple[str, ...] = ()
    """Remarks of a table's file, a sentence each."""

    @property
    def has_power(self) -> bool:
        """Whether it is known what power the fins take."""
        return True

    @abstractmethod
    def grid_numbers(self, lower: Array, upper: Array) -> Array:
        """Returns the law of one fin as a grid for the core, see `hermite_grid.grid_numbers`: of
        the forces along own axes, or of their size alone, without the unevenness.

        Args:
            lower: least command (3,) [rad, Hz, rad].
            upper: greatest command (3,).
        """

    def power(self, command: Values, inflow: Array | None = None) -> Values:
        return self.blade.power(command[..., 0], command[..., 1])

    def power_gradient(self, command: Array, inflow: Array | None = None) -> Array:
        by_amplitude, by_frequency = self.blade.power_gradient(command[..., 0], command[..., 1])
        gradient = np.zeros(command.shape)
        gradient[..., 0] = by_amplitude
        gradient[..., 1] = by_frequency
        return gradient


def planar_force(thrust: Array, direction: Array) -> Array:
    """Returns forces across the shafts of fins.

    Args:
        thrust: size of the force (...) [N].
        direction: of the force, from the zero axis towards shaft x zero (...) [rad].

    Returns:
        Forces (..., 3) [N], own frames.
    """
    # Half the time of `stack`: the plant evaluates this for many answers of an allocator.
    force = np.zeros((*thrust.shape, 3), thrust.dtype)
    np.cos(direction, out=force[..., 1])
    np.sin(direction, out=force[..., 2])
    planar = force[..., 1:]
    planar *= thrust[..., None]
    return force


class PlanarLaw(FinLaw):
    """A fin whose mean force lies in the plane across its shaft: a size T(A, f, phi), and the
    direction phi + `offset`.

    The response to a price is compiled from size and power in that plane, so that the lower bound
    of the power holds for such laws alone: `force` is final, and no subclass can add a force along
    the shaft. Where the size depends on the zero direction, `uniform` is False and `unevenness`
    says how.
    """

    def grid_numbers(self, lower: Array, upper: Array) -> Array:
        """See `FinLaw`: of the size, which is largest, by 1 + e, at phi_e."""
        e, phi_e = self.unevenness

        def size(amplitude: Array, frequency: Array) -> Array:
            return np.asarray(self.thrust(amplitude, frequency, phi_e) / (1.0 + e))

        return size_numbers(size, lower, upper)

    def blade_numbers(self) -> dict[str, Any]:
        """Returns the fields of a `Formula` that tell of the blade."""
        return {"blade_drag": self.blade.drag, "blade_inertia": self.blade.inertia}

    @abstractmethod
    def thrust(self, amplitude: Values, frequency: Values, zero_direction: Values) -> Values:
        """Returns the size of the force.

        Args:
            amplitude: half amplitude A (...) [rad].
            frequency: frequency f (...) [Hz].
            zero_direction: zero direction phi (...) [rad].

        Returns:
            Thrust (...) [N].
        """

    @abstractmethod
    def thrust_gradient(
        self, amplitude: Array, frequency: Array, zero_direction: Array
    ) -> tuple[Array, Array, Array | float]:
        """Returns the derivatives of `thrust` by amplitude (...) [N/rad], by frequency (...) [N/Hz]
        and by zero direction (...) [N/rad]."""

    @final
    def force(self, command: Values, inflow: Array | None = None) -> Values:
        amplitude = command[..., 0]
        frequency = command[..., 1]
        zero_direction = command[..., 2]
        thrust = self.thrust(amplitude, frequency, zero_direction)
        direction = zero_direction + self.offset
        if isinstance(command, np.ndarray):
            return planar_force(thrust, direction)
        xp = library_of(command)
        # Nothing acts along the shaft.
        parts = [xp.zeros_like(thrust), thrust * xp.cos(direction), thrust * xp.sin(direction)]
        return xp.stack(parts, axis=-1)

    @final
    def force_and_jacobian(
        self, command: Array, inflow: Array | None = None
    ) -> tuple[Array, Array]:
        amplitude = command[..., 0]
        frequency = command[..., 1]
        zero_direction = command[..., 2]
        direction = zero_direction + self.offset
        cos = np.cos(direction)
        sin = np.sin(direction)
        thrust = self.thrust(amplitude, frequency, zero_direction)
        force = np.zeros((*thrust.shape, 3))
        jacobian = np.zeros((*thrust.shape, 3, 3))
        force[..., 1] = thrust * cos
        force[..., 2] = thrust * sin
        gradient = self.thrust_gradient(amplitude, frequency, zero_direction)
        for k, slope in enumerate(gradient):
            jacobian[..., k, 1] = slope * cos
            jacobian[..., k, 2] = slope * sin
        # The force turns with the zero direction.
        jacobian[..., 2, 1] -= force[..., 2]
        jacobian[..., 2, 2] += force[..., 1]
        return force, jacobian
