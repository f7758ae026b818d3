"""The pseudo-inverse with the one thing that the default method takes from a reference.

It divides what there is to gain: what comes of knowing how late fins are, and what of dividing forces well.
"""

from finlab.allocation.baselines.analytic import Analytic
from finlab.allocation.in_time import in_time
from finlab.arrays import Array

TICK_S = 0.1
"""Time between the wrenches of a reference [s]."""


class AnalyticAhead(Analytic):
    """`analytic`, handed the wrench that its fins will be in time for."""

    name = "analytic-ahead"

    def in_time(self, target: Array, reference: Array) -> Array:
        """See `Method`."""
        return in_time(self.layout, target, reference, TICK_S)
