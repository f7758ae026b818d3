"""What the actuators of a robot may give, for one target or many: limits of forces and their directions."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.precision import NOTHING

TURNING = 1e-2
"""Price, as a share of the mean one of the least force, over which a force that cannot rest turns round."""


@dataclass(frozen=True, eq=False)
class Sets:
    """What the n actuators may give: (n, 1) for all targets alike, or (n, N). Lines first."""

    low: Array
    """Least force, of planes least size [N]."""
    high: Array
    """Largest force or size [N]."""
    low_cost: Array
    """Power at the least force [W]."""
    high_cost: Array
    """Power at the largest force [W]."""
    middle: Array
    """Middles of the arcs of the p planes (p, 1) or (p, N) [rad]."""
    half: Array
    """Halves of these arcs [rad]; pi for full circles."""
    reverse: Array
    """Largest sizes (p, 1) or (p, N) [N] of forces against these arcs; 0 where there are none."""
    reverse_cost: Array
    """Power at them [W]."""
    flipped: Array
    """1 where a plane gives its reverse only, about whose arc the other arrays speak then, else 0."""

    @cached_property
    def arcs(self) -> bool:
        """Whether any arc is less than a full circle."""
        return bool((self.half < np.pi).any())

    @cached_property
    def rests(self) -> bool:
        """Whether all planes can rest."""
        return not (self.low[len(self.low) - len(self.half) :] > 0.0).any()

    @cached_property
    def squared_gap(self) -> Array:
        """Squares of the prices (p, 1) or (p, N) [W^2/N^2] below which a plane's direction is undecided."""
        planes = slice(len(self.low) - len(self.half), None)
        low, least = (
            self.low[planes],
            NOTHING * self.high_cost[planes] / np.maximum(self.high[planes], 1e-300),
        )
        turning = TURNING * self.low_cost[planes] / np.maximum(low, 1e-300)
        return np.asarray(np.where(low > 0.0, np.maximum(turning, least), least) ** 2 + 1e-300)

    @cached_property
    def forked(self) -> NDArray[np.intp]:
        """Places of the planes whose set has a gap: wide arcs, and arcs of forces that cannot rest."""
        arc = self.half < np.pi
        low = self.low[len(self.low) - len(self.half) :]
        wide = arc & ((self.half > 0.5 * np.pi) | ((low > 0.0) & (self.half > 0.0)))
        return np.flatnonzero(wide.any(axis=1))

    @cached_property
    def reversing(self) -> NDArray[np.intp]:
        """Places of the planes that push either way, of any of the targets."""
        return np.flatnonzero((self.reverse > 0.0).any(axis=1))

    @cached_property
    def ways(self) -> tuple["Sets", "Sets"]:
        """What these planes alone give forward, and in reverse."""
        places = self.reversing
        none, planes = np.zeros((len(places), 1)), len(self.low) - len(self.half) + places
        low, high, low_cost, high_cost = (values[planes] for values in self.parts[:4])
        middle, half, reverse, reverse_cost, flipped = (values[places] for values in self.parts[4:])
        reverse_cost = np.where(reverse > 0.0, reverse_cost, 0.0)
        forward = Sets(low, high, low_cost, high_cost, middle, half, none, none, flipped)
        return forward, Sets(
            none, reverse, low_cost, reverse_cost, middle + np.pi, half, none, none, none + 1.0
        )

    @cached_property
    def most_cost(self) -> Array:
        """Power (1,) or (N,) [W] of all actuators at the dearer ends of their sets."""
        found: Array = np.maximum(self.low_cost, self.high_cost)
        if len(self.reversing):
            planes = slice(len(self.low) - len(self.half), None)
            found = found + np.zeros(max(found.shape[1], self.reverse_cost.shape[1]))
            found[planes] = np.maximum(found[planes], self.reverse_cost)
        return np.asarray(found.sum(axis=0))

    @property
    def parts(self) -> tuple[Array, ...]:
        """All arrays, in order."""
        ends = self.low, self.high, self.low_cost, self.high_cost
        return *ends, self.middle, self.half, self.reverse, self.reverse_cost, self.flipped

    def take(self, columns: NDArray[np.intp]) -> "Sets":
        """The same for some of the targets."""
        return Sets(*(a if a.shape[-1] == 1 else a[:, columns] for a in self.parts))
