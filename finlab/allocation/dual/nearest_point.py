"""The point of a convex set nearest to another, and the farthest along a ray, by support functions alone.

Wolfe's algorithm ("Finding the nearest point in a polytope", 1976): the nearest point is kept as a mixture of
few points that answered prices. Each step asks for the point that is worth most along the miss, and takes the
nearest point of the affine hull of all, points whose share would fall below 0 left out. What the last answer
adds proves how far the point is from the nearest one. Sets with curved sides converge the same way.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.precision import NOTHING, ROUNDING

CLOSE_BY = NOTHING
"""Distance, on the robot's yardstick, up to which a point is the nearest one."""
MOST_POINTS = 400
"""Points that are asked for at most."""

Farthest = Callable[[Array], Array]
"""Forces (k,) that are worth most at prices (k,)."""


class Mixture(NamedTuple):
    """A mixture of m points of a set, near to a target."""

    forces: Array
    """The forces (k, m) [N] of its points."""
    shares: Array
    """Their shares (m,), which add up to 1."""
    miss: Array
    """From the target to the mixture (d,)."""

    @property
    def force(self) -> Array:
        """The mixed forces (k,) [N]."""
        return np.asarray(self.forces @ self.shares)


def nearest_point(
    farthest: Farthest,
    rows: Array,
    target: Array,
    begin: Mixture | None = None,
    close: float = CLOSE_BY,
    apart: float = 0.0,
) -> Mixture:
    """Returns the point of a set nearest to a target (d,), from the support `farthest` of its forces and its
    coordinates `rows` (k, d) per newton; it begins at a mixture, where there is one. Up to the distance
    `close` a point is the nearest one; of targets outside, `apart` is the share of the miss to be proved."""
    if begin is None:
        forces, shares = farthest(rows @ target)[:, None], np.ones(1)
    else:
        forces, shares = begin.forces, begin.shares
    points, last = rows.T @ forces, np.inf
    for _ in range(MOST_POINTS):
        point = points @ shares
        miss = point - target
        size = float(np.linalg.norm(miss))
        if size <= close or size >= last * (1.0 - ROUNDING):  # the second is rounding
            break
        last = size
        force = farthest(-(rows @ miss))
        new = rows.T @ force
        if miss @ (point - new) <= max(close, apart * size) * size:
            break
        points, forces = np.column_stack([points, new]), np.column_stack([forces, force])
        shares, kept = _mixed(points, np.append(shares, 0.0), target)
        points, forces = points[:, kept], forces[:, kept]
    return Mixture(forces, shares, miss)


def _mixed(points: Array, shares: Array, target: Array) -> tuple[Array, NDArray[np.intp]]:
    """Shares of the points (d, m) whose mixture is nearest to a target (d,), and which points these are."""
    kept = np.arange(len(shares))
    while len(kept) > 1:
        first = points[:, kept[0]]
        others = np.linalg.lstsq(points[:, kept[1:]] - first[:, None], target - first, rcond=ROUNDING)[0]
        wanted = np.concatenate([[1.0 - others.sum()], others])
        if (wanted > ROUNDING).all():
            return wanted, kept
        falling = wanted <= ROUNDING
        steps = shares[falling] / np.maximum(shares[falling] - wanted[falling], 1e-300)
        shares = shares + min(float(steps.min()), 1.0) * (wanted - shares)
        stays = shares > ROUNDING
        stays[shares.argmin()] = False
        kept, shares = kept[stays], shares[stays] / shares[stays].sum()
    return np.ones(1), kept


def farthest_along(farthest: Farthest, rows: Array, ray: Array) -> Mixture:
    """Returns the point of a set, given as in `nearest_point`, that is the largest share, from 0 to 1, of a
    ray (d,).

    A plane across the miss of a share bounds it from above; the next try is that bound (Dinkelbach). Where no
    share of the ray is in the set, the point is the nearest one to rest.
    """
    share, normal = 1.0, ray
    result, last = None, np.inf
    while True:
        along, price = float(normal @ ray), rows @ normal
        bound = float(farthest(price) @ price) / along if along > 0.0 else 0.0
        share = min(max(bound, 0.0), share)
        result = nearest_point(farthest, rows, share * ray, result, apart=0.5)
        normal = -result.miss
        if share == 0.0 or float(np.linalg.norm(normal)) <= 2.0 * CLOSE_BY or share >= last:
            return result
        last = share
