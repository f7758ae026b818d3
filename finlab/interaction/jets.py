"""Jets by a formula of eight constants: how they spread, what they take from whatever stands in
them.

Behind a disc of diameter D with thrust T flows a jet of speed `V0 = sqrt(2 T / (rho A))` (actuator
disc at rest) that spreads and slows down as `D / x` (Blaauw and van de Kaa, 1978). An actuator that
takes in the water of others loses thrust, by a curve through the tests of two thrusters in line and
turned (Dang and Laheij, 2004), and turns the water that comes from the side (momentum); its housing
is dragged along; a jet that meets the hull pushes it back (Nienhuis, 1992). The constants' usual
values were fitted to the formulas of Dang and Laheij as they are quoted; they hold to 0.05 at
distances from 2 to 16 D, turned by up to 30 degrees. The formula itself is in
finlab/core/src/jets.c.
"""

from dataclasses import astuple, dataclass
from typing import Annotated, ClassVar

import numpy as np
from msgspec import Meta

from finlab.arrays import Array
from finlab.interaction.interaction import AtPlaces, InteractionModel, Places

Positive = Annotated[float, Meta(ge=1e-3, le=1e3)]
Share = Annotated[float, Meta(ge=0.0, le=10.0)]
BEHIND = 0.2
"""Distance, in diameters, over which a jet begins."""
GRAZING = 0.3
"""Width of a jet's rim on the hull, as a share of its distance from the centre squared."""
MISSED = 0.1
"""Share of an actuator's force that counts as taken where the formula says that nothing is."""


@dataclass(frozen=True)
class Jets(InteractionModel):
    """What the jets of a robot's actuators take, by a formula. Checked on construction."""

    type: ClassVar[str] = "jets"

    length: Positive = 2.8
    """Distance, in diameters, up to which the middle of a jet keeps its speed."""
    width: Positive = 3.1
    """Distance, in diameters, at which a jet that only spread would be as wide as it begins."""
    spread: Positive = 37.0
    """How narrow a jet is: its speed falls as exp(-spread r^2 / x^2) beside the middle."""
    lag: Positive = 0.62
    """Speed of the inflow over that of the own jet, per share of thrust lost, where that is
    small."""
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
        super().__init__(places, (*astuple(constants)[:-1], BEHIND, GRAZING))
        self.constants = constants

    def at_rest(self, force: Array) -> Array:
        return self.by_core(force, None, False)[0]

    def offset(self, force: Array, inflow: Array | None = None) -> Array:
        return self.by_core(force, inflow, False)[1]

    def effect(self, force: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        return self.by_core(force, inflow, True)[1:]

    def deviation(self, force: Array) -> Array:
        each = np.einsum("...ib,ibw->...iw", self.at_rest(force), self.lever) ** 2
        # A jet that the formula has pass by may be met.
        missed = (MISSED**2 / 3.0) * np.einsum("...ib,icw->...iw", force**2, self.lever**2)
        return np.asarray(self.constants.uncertain * np.sqrt((each + missed).sum(axis=-2)))
