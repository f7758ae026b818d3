"""Limits of the forces of a robot's actuators and of their directions, for one target or many."""

from dataclasses import dataclass, fields
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
        return not (self.low[self._planes] > 0.0).any()

    @property
    def _planes(self) -> slice:
        return slice(len(self.low) - len(self.half), None)

    @cached_property
    def squared_gap(self) -> Array:
        """Squares of the prices (p, 1) or (p, N) [W^2/N^2] below which a plane's direction is undecided."""
        planes = self._planes
        low, high = self.low[planes], self.high[planes]
        least = NOTHING * self.high_cost[planes] / np.maximum(high, 1e-300)
        turning = TURNING * self.low_cost[planes] / np.maximum(low, 1e-300)
        return np.asarray(np.where(low > 0.0, np.maximum(turning, least), least) ** 2 + 1e-300)

    @cached_property
    def forked(self) -> NDArray[np.intp]:
        """Places of the planes whose set has a gap: wide arcs, and arcs of forces that cannot rest."""
        restless = (self.low[self._planes] > 0.0) & (self.half > 0.0)
        wide = (self.half < np.pi) & ((self.half > 0.5 * np.pi) | restless)
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
        most = np.maximum(self.low_cost, self.high_cost)
        if len(self.reversing):
            most = most + np.zeros(max(most.shape[1], self.reverse_cost.shape[1]))
            most[self._planes] = np.maximum(most[self._planes], self.reverse_cost)
        return np.asarray(most.sum(axis=0))

    @property
    def parts(self) -> tuple[Array, ...]:
        """All arrays, in order."""
        return tuple(getattr(self, field.name) for field in fields(self))

    def take(self, columns: NDArray[np.intp]) -> "Sets":
        """The same for some of the targets."""
        return Sets(*(a if a.shape[-1] == 1 else a[:, columns] for a in self.parts))
