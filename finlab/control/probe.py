"""Short, small beats of fins that are taken for lost, by which a repaired one is noticed."""

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.physics import plant_of

FORCE_N = 0.6
"""Force of a whole fin that is probed [N], or what it can give if that is less."""
LENGTH_S = 1.5
"""How long a probe lasts [s]; a fin takes half a second to swing up."""
HALVINGS = 40
"""Steps of the search for the frequency."""


class Probe:
    """Beats for the fins of one layout; one fin at a time."""

    def __init__(self, layout: Layout, every_s: float, period_s: float) -> None:
        """Takes the layout, the time between two probes [s] (0 for none) and between calls [s]."""
        plant = plant_of(layout)
        self._amplitude = layout.lower[:, 0] + 0.75 * (layout.upper[:, 0] - layout.lower[:, 0])
        slow, fast = layout.lower[:, 1].copy(), layout.upper[:, 1].copy()
        for _ in range(HALVINGS):
            middle = 0.5 * (slow + fast)
            weak = plant.thrust(self._amplitude, middle) < FORCE_N
            slow, fast = np.where(weak, middle, slow), np.where(weak, fast, middle)
        self._frequency = fast
        self._every, self._length = round(every_s / period_s), round(LENGTH_S / period_s)
        self._count = 0

    def added(self, command: Array, lost: NDArray[np.bool_], direction: Array) -> Array:
        """The command (n, 3) with the probe of a lost fin, if it is time, about where the fin points (n,)."""
        if self._every == 0 or not lost.any():
            self._count = 0
            return command
        self._count += 1
        turn, tick = divmod(self._count, self._every)
        if turn == 0 or tick >= self._length:
            return command
        fins = np.flatnonzero(lost)
        fin = fins[turn % len(fins)]
        result = command.copy()
        result[fin] = self._amplitude[fin], self._frequency[fin], direction[fin]
        return result
