"""Jets by a formula of eight constants: how they spread, and what they take from actuators and
hull.

Behind a disc of diameter D with thrust T flows a jet of speed `V0 = sqrt(2 T / (rho A))` (actuator
disc at rest) that spreads and slows down as `D / x` (Blaauw and van de Kaa, 1978). An actuator that
takes in the water of others loses thrust, by a curve through the tests of two thrusters in line and
turned (Dang and Laheij, 2004), and turns the water that comes from the side (momentum); its housing
is dragged along; a jet that meets the hull pushes it back (Nienhuis, 1992). The constants' usual
values were fitted to the formulas of Dang and Laheij as they are quoted; they hold to 0.05 at
distances from 2 to 16 D, turned by up to 30 degrees. The formula is given in
docs/theory/interaction.md and computed in finlab/core/src/jets.c; here are its constants.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Annotated, ClassVar

import numpy as np
from msgspec import Meta

from finlab.arrays import Array
from finlab.interaction.interaction import InteractionModel, JetGeometry, PointInteraction

Positive = Annotated[float, Meta(ge=1e-3, le=1e3)]
"""A constant above 0 [1]."""
Coefficient = Annotated[float, Meta(ge=0.0, le=10.0)]
"""A share, or a coefficient [1]."""
ONSET_LENGTH = 0.2
"""Distance over which a jet begins, in diameters [1]."""
RIM_WIDTH = 0.3
"""Width of a jet's rim on the hull, over its squared distance from the centre [1]."""
UNMODELLED_SHARE = 0.1
"""Coefficient of an actuator's force that may be lost where the formula has no loss [1]."""


@dataclass(frozen=True)
class Jets(InteractionModel):
    """What the jets of a robot's actuators take, by a formula. Checked on construction.

    All arguments are ratios [1].

    Args:
        length: distance up to which the middle of a jet keeps its speed, in diameters [1].
        width: distance at which a jet that only spread would be as wide as it begins, in diameters
            [1].
        spread: how narrow a jet is: its speed falls as exp(-spread r^2 / x^2) off its axis [1].
        lag: speed of the inflow over that of the own jet, per share of thrust lost, where that is
            small [1].
        most: one over the largest share of thrust that can be lost [1].
        side: share of the momentum of water taken in from the side that is a force [1].
        housing: drag coefficient of what stands in a jet, by the area of its disc [1].
        hull: share of the thrust with which a jet pushes the hull where it meets it [1].
        uncertain: standard deviation of what the jets take, as a share of it [1].
    """

    type: ClassVar[str] = "jets"

    length: Positive = 2.8
    width: Positive = 3.1
    spread: Positive = 37.0
    lag: Positive = 0.62
    most: Positive = 0.78
    side: Coefficient = 0.3
    housing: Coefficient = 0.05
    hull: Coefficient = 0.6
    uncertain: Coefficient = 0.0

    def of(self, geometry: JetGeometry) -> "JetInteraction":
        """Returns the interaction of a robot's actuators."""
        return JetInteraction(self, geometry)


class JetInteraction(PointInteraction):
    """The formula of jets for one robot, which the core computes."""

    def __init__(
        self, constants: Jets, geometry: JetGeometry, changed: Mapping[str, float] | None = None
    ) -> None:
        """Prepares one robot.

        Args:
            constants: of the formula.
            geometry: points and jets of its n actuators, and its hull.
            changed: constants by name that the formula has in place of these; they need not be
                such as a layout may name.
        """
        values = asdict(constants) | dict(changed or {})
        *formula_constants, _uncertain = values.values()
        super().__init__(geometry, (*formula_constants, ONSET_LENGTH, RIM_WIDTH))
        self.constants = constants

    @property
    def core_constants(self) -> Array:
        return self.table

    def constants_in_lanes(self, lanes: int) -> Array:
        return self.table_in_lanes(lanes)

    def at_rest(self, force: Array) -> Array:
        return self.compute_in_core(force, None, False)[0]

    def offset(self, force: Array, inflow: Array | None = None) -> Array:
        return self.compute_in_core(force, inflow, False)[1]

    def effect(self, force: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        return self.compute_in_core(force, inflow, True)[1:]

    def deviation(self, force: Array, inflow: Array | None = None) -> Array:
        modelled = np.einsum("...ib,ibw->...iw", self.at_rest(force), self.lever)
        # A jet may meet an actuator that it misses by the formula. In which direction that force
        # goes is unknown: each axis of the body has a third of its variance.
        variance_per_axis = UNMODELLED_SHARE**2 / 3.0
        unmodelled = variance_per_axis * np.einsum("...ib,icw->...iw", force**2, self.lever**2)
        variance = (modelled**2 + unmodelled).sum(axis=-2)
        return np.asarray(self.constants.uncertain * np.sqrt(variance))
