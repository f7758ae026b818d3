"""Support functions of uneven fins: what a price in some direction is worth to a fin with a gauge.

A fin that gives the share `rho(psi)` of its force in direction `psi` has the conjugate `C(|s| sigma(theta))`,
with `sigma(theta) = max over psi of rho(psi) cos(theta - psi)`, the support function of its gauge's hull.
"""

import numpy as np

from finlab.actuators.response import POINTS
from finlab.arrays import Array
from finlab.layout.axes import TURN


class Gauges:
    """Gauges of the p planes of one robot, for many prices."""

    def __init__(self, gauges: list[Array | None]) -> None:
        """Takes the gauge (G,) of each plane; None where it is alike all round."""
        self.places = np.array([i for i, gauge in enumerate(gauges) if gauge is not None], dtype=np.intp)
        shaped = [gauge for gauge in gauges if gauge is not None]
        both = [_support(gauge) for gauge in shaped]
        self._rho = np.array(shaped)
        self._sigma = np.array([sigma for sigma, _ in both])
        self._slope = np.array([slope for _, slope in both])

    def __bool__(self) -> bool:
        return len(self.places) > 0

    def along(self, angle: Array) -> Array:
        """Gauges (g, N) in directions (g, N) of the force."""
        count = self._rho.shape[1]
        place = (angle / TURN) % 1.0 * count
        cell = place.astype(np.intp) % count
        t = place - np.floor(place)
        row = np.arange(len(self._rho))[:, None]
        before, first, last, after = (self._rho[row, (cell + k) % count] for k in (-1, 0, 1, 2))
        m0, m1 = 0.5 * (last - before), 0.5 * (after - first)
        rise = last - first
        found: Array = first + t * (m0 + t * (3.0 * rise - 2.0 * m0 - m1 + t * (m0 + m1 - 2.0 * rise)))
        return found

    def support(self, angle: Array) -> tuple[Array, Array, Array]:
        """Support function and its first two derivatives (g, N) for directions (g, N) of the price."""
        step = TURN / POINTS
        place = (angle / TURN) % 1.0 * POINTS
        cell = place.astype(np.intp) % POINTS
        t = place - np.floor(place)
        row, after = np.arange(len(self._sigma))[:, None], (cell + 1) % POINTS
        first, last = self._sigma[row, cell], self._sigma[row, after]
        m0, m1 = self._slope[row, cell] * step, self._slope[row, after] * step
        rise = last - first
        b, c = 3.0 * rise - 2.0 * m0 - m1, m0 + m1 - 2.0 * rise
        value = first + t * (m0 + t * (b + t * c))
        return value, (m0 + t * (2.0 * b + 3.0 * t * c)) / step, (2.0 * b + 6.0 * t * c) / step**2


def _support(gauge: Array) -> tuple[Array, Array]:
    """Support function and its derivative (POINTS,) of one gauge (G,); the parabola through the best three
    directions stands for the gauge between them."""
    count, step = len(gauge), TURN / len(gauge)
    angle = np.arange(POINTS) * TURN / POINTS
    psi = np.arange(count) * step
    worth = gauge * np.cos(angle[:, None] - psi)
    best = worth.argmax(axis=1)
    row = np.arange(POINTS)
    before, at, after = (worth[row, (best + k) % count] for k in (-1, 0, 1))
    bend = before - 2.0 * at + after
    offset = np.clip(np.where(bend < 0.0, 0.5 * (before - after) / np.minimum(bend, -1e-300), 0.0), -0.5, 0.5)
    sigma = at + offset * (0.5 * (after - before) + 0.5 * offset * bend)
    g0, g1, g2 = (gauge[(best + k) % count] for k in (-1, 0, 1))
    rho = g1 + offset * (0.5 * (g2 - g0) + 0.5 * offset * (g0 - 2.0 * g1 + g2))
    direction = psi[best] + offset * step
    return sigma, -rho * np.sin(angle - direction)
