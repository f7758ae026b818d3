"""Jets by a formula of eight constants: how they spread, what they take from whatever stands in them.

Behind a disc of diameter D with thrust T flows a jet of speed `V0 = sqrt(2 T / (rho A))` (actuator disc at
rest) that spreads and slows down as `D / x` (Blaauw and van de Kaa, 1978). An actuator that takes in the
water of others loses thrust, by a curve through the tests of two thrusters in line and turned (Dang and
Laheij, 2004), and turns the water that comes from the side (momentum); its housing is dragged along; a jet
that meets the hull pushes it back (Nienhuis, 1992). The constants' usual values were fitted to the formulas
of Dang and Laheij as they are quoted; they hold to 0.05 at distances from 2 to 16 D, turned by up to 30
degrees.
"""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from msgspec import Meta

from finlab.arrays import AnyArray, Array
from finlab.files.schema import Checked
from finlab.interaction.interaction import DENSITY, AtPlaces, Places, complex_slope, jets_of, with_own

Positive = Annotated[float, Meta(ge=1e-3, le=1e3)]
Share = Annotated[float, Meta(ge=0.0, le=10.0)]
BEHIND = 0.2
"""Distance, in diameters, over which a jet begins."""
MISSED = 0.1
"""Share of an actuator's force that counts as taken where the formula says that nothing is."""
GRAZING = 0.3
"""Width of a jet's rim on the hull, as a share of its distance from the centre squared."""


@dataclass(frozen=True)
class Jets(Checked):
    """What the jets of a robot's actuators take, by a formula. Checked on construction."""

    type: ClassVar[str] = "jets"

    length: Positive = 2.8
    """Distance, in diameters, up to which the middle of a jet keeps its speed."""
    width: Positive = 3.1
    """Distance, in diameters, at which a jet that only spread would be as wide as it begins."""
    spread: Positive = 37.0
    """How narrow a jet is: its speed falls as exp(-spread r^2 / x^2) beside the middle."""
    lag: Positive = 0.62
    """Speed of the inflow over that of the own jet, per share of thrust lost, where that is small."""
    most: Positive = 0.78
    """One over the largest share of thrust that can be lost."""
    side: Share = 0.3
    """Share of the momentum of water taken in from the side that is a force."""
    housing: Share = 0.05
    """Drag coefficient of what stands in a jet, by the area of its disc."""
    hull: Share = 0.6
    """Share of the thrust with which a jet pushes the hull where it meets it."""
    uncertain: Share = 0.0
    """Standard deviation of what the jets take, as a share of it."""

    def of(self, places: Places) -> "JetInteraction":
        """Returns the interaction of a robot's actuators."""
        return JetInteraction(self, places)


class JetInteraction(AtPlaces):
    """The formula for one robot."""

    def __init__(self, constants: Jets, places: Places) -> None:
        super().__init__(places)
        self.constants = constants
        size = np.maximum(places.diameter, 1e-9)
        self._from = (places.position - places.position[:, None]) / size[:, None, None]
        """Way (source, receiver, 3) in diameters."""
        self._area = 0.25 * np.pi * places.diameter**2
        center, half = places.hull
        self._hull = None if not half.all() else ((places.position - center) / half, 1.0 / half)
        self._meets = ~np.eye(len(size), dtype=bool) & (places.diameter > 0.0)[:, None]

    def at_rest(self, force: Array) -> Array:
        return np.asarray(self._taken(force, self._water(force).sum(axis=-3)))

    def slope_at_rest(self, force: Array) -> tuple[Array, Array]:
        shape = (*force.shape, force.shape[-2], 3)
        flat = complex_slope(lambda some: self._water(some).reshape(*some.shape[:-1], -1), force)
        water, turned = flat[0].reshape(*shape[:-3], *shape[-2:]).sum(axis=-3), flat[1].reshape(shape)
        both = np.concatenate([force, water], axis=-1)
        change, slope = complex_slope(lambda some: self._taken(some[..., :3], some[..., 3:]), both)
        own, by_water = slope[..., :3, :], slope[..., 3:, :]
        return change, with_own(np.einsum("...jaiu,...iub->...jaib", turned, by_water), own)

    def deviation(self, force: Array) -> Array:
        each = np.einsum("...ib,ibw->...iw", self.at_rest(force), self.lever) ** 2
        # A jet that the formula has pass by may be met.
        missed = (MISSED**2 / 3.0) * np.einsum("...ib,icw->...iw", force**2, self.lever**2)
        return np.asarray(self.constants.uncertain * np.sqrt((each + missed).sum(axis=-2)))

    def _water(self, force: AnyArray) -> Any:
        """Velocity (..., n, n, 3) [m/s] that the jet of each actuator gives to the water at each other
        one."""
        known = self.constants
        _, ahead, speed = jets_of(force, self.places.diameter)
        along = -(self._from * ahead[..., None, :]).sum(-1)
        beside = (self._from**2).sum(-1) - along * along
        middle = (1.0 + (along / known.length) ** 4) ** -0.25
        begun = 0.5 * self._meets * (1.0 + np.tanh(along / BEHIND))
        narrow = np.exp(-known.spread * beside / (along * along + known.width**2))
        return -(speed[..., None] * middle * begun * narrow)[..., None] * ahead[..., None, :]

    def _taken(self, force: AnyArray, water: AnyArray) -> Any:
        """Forces (..., n, 3) [N] that come of water (..., n, 3) [m/s] that meets the actuators."""
        known = self.constants
        thrust, ahead, speed = jets_of(force, self.places.diameter)
        against = -(water * ahead).sum(-1)
        share = against / speed
        lost = share / (known.lag + known.most * np.sqrt(share * share + 1e-4))
        across = water + against[..., None] * ahead
        if self._hull is not None:
            lost = lost + known.hull * self._met(ahead)
        moved = known.side * DENSITY * self._area * speed
        size = np.sqrt((water * water).sum(-1) + 1e-12)
        dragged = 0.5 * DENSITY * known.housing * self._area * size
        return moved[..., None] * across + dragged[..., None] * water - lost[..., None] * force

    def _met(self, ahead: AnyArray) -> Any:
        """Share (..., n) of each jet that meets the hull: a force along the jet, which has the same torque
        wherever on the jet it acts."""
        assert self._hull is not None
        place, shrink = self._hull
        course = -ahead * shrink
        squared = (course * course).sum(-1) + 1e-300
        towards = -(place * course).sum(-1)
        beside = (place * place).sum(-1) - towards * towards / squared
        facing = towards / np.sqrt(squared)
        return 0.25 * (1.0 + np.tanh((1.0 - beside) / GRAZING)) * (1.0 + np.tanh(facing / GRAZING))
