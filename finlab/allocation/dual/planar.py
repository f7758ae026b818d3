"""Answers of planes: the directions of their forces, and blends of two ways to answer.

A blend gives what the smooth larger one of two conjugates asks for, so that Newton's method has a derivative
where an answer goes over from one end of an arc, or from one side of a pod, to the other.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.response import POINTS
from finlab.arrays import Array
from finlab.axes import TURN


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
        return np.asarray(first + t * (m0 + t * (3.0 * rise - 2.0 * m0 - m1 + t * (m0 + m1 - 2.0 * rise))))

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


class Fan(NamedTuple):
    """Directions of the forces of planes, with their gauges (p, N), and what changes them."""

    along: Array
    """Prices along the directions of the force, times the gauges [W/N]."""
    first: Array
    second: Array
    xx: Array
    """First-first part of the change of direction with the price, over the force [N/W]."""
    xy: Array
    yy: Array
    beyond: NDArray[np.bool_] | None
    """Which are at an end of their arc; None where all arcs are full circles."""
    other: Array | None
    """The angle of the other end [rad]."""


class Planar(NamedTuple):
    """Answers of planes (p, N)."""

    first: Array
    second: Array
    xx: Array
    xy: Array
    yy: Array

    @classmethod
    def of(cls, fan: Fan, size: Array, slope: Array) -> "Planar":
        """The answers along a fan of directions, of sizes and their derivatives (p, N)."""
        x, y, steep_x = fan.first, fan.second, slope * fan.first
        xx, xy = steep_x * x + size * fan.xx, steep_x * y + size * fan.xy
        return cls(size * x, size * y, xx, xy, slope * y * y + size * fan.yy)


def end_of(angle: Array, gauges: Gauges | None) -> tuple[Array, Array]:
    """The directions (p, N) of forces at angles (p, N), with the gauges' sizes."""
    x, y = np.cos(angle), np.sin(angle)
    if gauges:
        rho = gauges.along(angle[gauges.places])
        x[gauges.places] *= rho
        y[gauges.places] *= rho
    return x, y


def share_of(ahead: Array, width: Array) -> Array:
    """Share of the first of two answers whose conjugate is higher by `ahead` [W], in a blend of a width."""
    return np.asarray(0.5 * (1.0 + ahead / np.sqrt(ahead * ahead + width * width)))


def blend(
    planar: Planar,
    conjugate: Array,
    places: NDArray[np.intp],
    other: Planar,
    others: Array,
    width: Array,
    where: NDArray[np.bool_],
) -> None:
    """Blend, in place, the answers and conjugates (p, N) of planes at some places (q,) with other ones
    (q, N), where they may give these, to those of the smooth larger one of both conjugates."""
    ahead = conjugate[places] - others
    root = np.sqrt(ahead * ahead + width * width)
    share = np.where(where, share_of(ahead, width), 1.0)
    turn = np.where(where, 0.5 * width * width / root**3, 0.0)
    dx, dy = planar.first[places] - other.first, planar.second[places] - other.second
    for own, new, extra in zip(planar, other, (0.0, 0.0, dx * dx, dx * dy, dy * dy), strict=True):
        own[places] = share * own[places] + (1.0 - share) * new + turn * extra
    conjugate[places] += np.where(where, 0.5 * (root - ahead), 0.0)
