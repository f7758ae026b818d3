"""Answers of planes: the directions of their forces, and blends of two ways to answer.

A blend gives what the smooth larger one of two conjugates asks for, so that Newton's method has a derivative
where an answer goes over from one end of an arc, or from one side of a pod, to the other.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.gauges import Gauges
from finlab.arrays import Array


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
        x, y = fan.first, fan.second
        steep_x = slope * x
        return cls(
            size * x,
            size * y,
            steep_x * x + size * fan.xx,
            steep_x * y + size * fan.xy,
            slope * y * y + size * fan.yy,
        )


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
