"""A robot that is not built as drawn: its centre of gravity lies elsewhere, and its fins are mounted askew.

The fins' law is the layout's. The robot is ballasted to lie level all the same, so its centre of buoyancy is
where the layout says, seen from the true centre of gravity.
"""

import math

import numpy as np

from finlab.layout import Layout
from finlab.layout.arrays import force_effectiveness
from finlab.sim.fin_force import MeanForce

CENTER = (-0.016, 0.012, 0.0)
"""The true centre of gravity as the layout's frame sees it [m]: 2 cm off."""
ASKEW = math.radians(5.0)
"""How far fins are turned about the vertical [rad], one this way and the next that way."""


class OffsetForce(MeanForce):
    """The fins of one layout."""

    def __init__(self, layout: Layout) -> None:
        super().__init__(layout)
        turned = np.where(np.arange(layout.n_fins) % 2 == 0, ASKEW, -ASKEW)
        self.effectiveness = force_effectiveness(
            layout.position - np.array(CENTER), layout.mounting_angle + turned
        )
