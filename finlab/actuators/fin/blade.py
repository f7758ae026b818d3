"""The power that beating a fin takes: a rigid plate in still water, its inertia and its drag.

The blade turns as theta = A sin(2 pi f t) about its zero direction against the torque
J theta'' + K theta' |theta'|. Driving costs power; braking wins none back. The mean over a cycle of
max(torque theta', 0) has the closed form used here: driving ends where sin = s0 with (K A / J) cos^2 = sin.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from finlab.arrays import Values, library_of

OWN_INERTIA = 0.0097
"""Moment of inertia about its shaft of a fin 0.20 m long and 0.10 m wide [kg m^2]: U-CAT's robot description
has a plate of 0.8 kg, 0.22 x 0.10 x 0.02 m, its centre 0.09 m from the shaft."""
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
        # Where the torque changes sign: s0 = (drag / inertia) A (1 - s0^2). The mean does not change with s0.
        end = twice / (1.0 + sqrt(1.0 + twice * twice))
        squared = end * end
        drag = self.drag * (end * (1.0 - squared / 3.0) + 2.0 / 3.0)
        return drag, 0.5 * self.inertia * (1.0 - squared)
