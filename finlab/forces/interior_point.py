"""A primal-dual interior-point method for planar forces within discs and sectors.

    min 1/2 sum_j v_j^2 / c_j   s.t.   v = w - sum_i B_i y_i,   |y_i| <= 1,   y_i within its sector,

for many rows at once. Newton's systems are reduced to the six multipliers l = v / c, so that an axis with a
tiny c, which must be met, costs no accuracy, and more fins hardly cost time.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

ITERATIONS = 40
"""Most Newton steps; usually about 10 are taken."""
GAP = 1e-11
"""Mean product of a limit's multiplier and slack that ends the search, relative to the objective plus one."""
UNMET = 1e-8
"""Largest violation of any condition at the end."""
CENTRING = (0.05, 0.3)
"""By how much a step aims to lessen that product: after a long step, and after a short one."""
LEAST_GAP, SHORT = 1e-13, 1e-6
"""Such a product, or such a short step, ends it too: rounding allows no more."""
LONG = 0.9
"""Share of Newton's step from which it counts as long."""
STIFF = 1e-10
"""Least stiffness of a fin: steps of those that nothing holds stay bounded."""
RIDGE = 1e-15
"""Relative regularization of the 6 x 6 systems."""
KEPT = 0.99
"""Share of the way to the nearest limit that a step goes at most."""
SLACK, WEIGHT = 3.0, 10.0
"""Slack and multiplier of each limit at the outset."""
NARROWEST = 1e-6
"""Half of a sector's angle [rad] at least, so that it has an inside."""


class Discs(NamedTuple):
    """What R rows of n fins can do."""

    columns: Array
    """B (n, 2, 6): normalized wrench of each fin's largest force along its two axes."""
    middle: Array
    """Middle of each fin's sector (R, n) [rad]."""
    half: Array
    """Half of its angle (R, n) [rad], at most a quarter turn; pi for a full circle."""


def minimize(discs: Discs, wanted: Array, c: Array) -> tuple[Array, Array]:
    """Forces (R, n, 2) as shares of the largest, and the multiplier (R, 6).

    Args:
        discs: what the fins can do.
        wanted: normalized wrenches w (R, 6).
        c: what each axis' squared error is divided by (6,), positive.
    """
    rows, n = discs.middle.shape
    flat = discs.columns.reshape(2 * n, 6)
    normals, sectors = _normals(discs)
    point, multiplier = np.zeros((rows, n, 2)), np.zeros((rows, 6))
    # Of the limits: the disc, and the sector's two sides.
    slack, weight = np.full((rows, n, 3), SLACK), np.full((rows, n, 3), WEIGHT)
    held, length = np.diag(c), np.ones(rows)
    for _ in range(ITERATIONS):
        missing = wanted - point.reshape(rows, 2 * n) @ flat
        astray = _limits(point, normals, sectors) + slack
        size = 1.0 + 0.5 * (missing * missing / c).sum(-1)
        gap = (weight * slack).mean((1, 2))
        unmet = np.abs(missing - c * multiplier).max(-1) + np.abs(astray).max((1, 2))
        done = ((gap <= GAP * size) & (unmet <= UNMET)) | (gap <= LEAST_GAP) | (length < SHORT)
        if done.all():
            break
        slope = np.concatenate([point[..., None, :], normals], axis=-2)  # of the limits (R, n, 3, 2)
        ratio = weight / slack
        aim = (np.where(length > LONG, *CENTRING) * gap)[:, None, None] / slack + ratio * astray
        soft = _softness(slope, ratio, weight[..., 0] + STIFF)
        pull = (multiplier @ flat.T).reshape(rows, n, 2) - (aim[..., None, :] @ slope)[..., 0, :]
        spread = soft @ discs.columns  # (R, n, 2, 6)
        gram = held + flat.T @ spread.reshape(rows, 2 * n, 6)
        gram.reshape(rows, 36)[:, ::7] += RIDGE * np.trace(gram, axis1=1, axis2=2)[:, None]
        right = missing - c * multiplier - (pull[..., None, :] @ spread)[..., 0, :].sum(1)
        turn = np.linalg.solve(gram, right[..., None])[..., 0]
        step = (soft @ (pull + (turn @ flat.T).reshape(rows, n, 2))[..., None])[..., 0]
        along = (slope @ step[..., None])[..., 0]
        growth = aim - weight + ratio * along
        length = np.minimum(_way_to_zero(slack, -astray - along), _way_to_zero(weight, growth))
        length = np.where(done, 0.0, np.minimum(KEPT * length, 1.0))
        point = point + length[:, None, None] * step
        slack = slack - length[:, None, None] * (astray + along)
        weight = weight + length[:, None, None] * growth
        multiplier = multiplier + length[:, None] * turn
    # Should a row not be done, its forces are at least such that the fins can give.
    point = np.nan_to_num(point)
    return point / np.maximum(np.linalg.norm(point, axis=-1, keepdims=True), 1.0), multiplier


def _unit(angle: Array) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _normals(discs: Discs) -> tuple[Array, NDArray[np.bool_]]:
    """Normals (R, n, 2, 2) that point out of each sector, zero for full circles; which have one (R, n)."""
    sectors = discs.half < np.pi - 1e-6
    side = np.pi / 2 - np.maximum(discs.half, NARROWEST)
    ends = np.stack([discs.middle + side, discs.middle - side], axis=-1)
    return np.where(sectors[..., None, None], -_unit(ends), 0.0), sectors


def _limits(point: Array, normals: Array, sectors: NDArray[np.bool_]) -> Array:
    """Each limit (R, n, 3), negative inside: the disc's and the sector's sides; -1 where there are none."""
    sides = np.where(sectors[..., None], (normals @ point[..., None])[..., 0], -1.0)
    return np.concatenate([0.5 * ((point * point).sum(-1, keepdims=True) - 1.0), sides], axis=-1)


def _way_to_zero(weight: Array, growth: Array) -> Array:
    """The longest step (R,) that keeps the limits' multipliers positive."""
    ways = np.where(growth < 0.0, weight / np.maximum(-growth, 1e-100), np.inf)
    shortest: Array = ways.min((1, 2))
    return shortest


def _softness(slope: Array, ratio: Array, stiff: Array) -> Array:
    """Inverses (R, n, 2, 2) of stiff I + sum_k ratio_k slope_k slope_k^T, for three slopes (R, n, 3, 2)."""
    pushed = slope * np.sqrt(ratio)[..., None]
    x, y = pushed[..., 0], pushed[..., 1]
    a, b, d = stiff + (x * x).sum(-1), (x * y).sum(-1), stiff + (y * y).sum(-1)
    # The determinant as a sum of squares, which rounding cannot bring to zero where two sides are close.
    cross = x * np.roll(y, 1, axis=-1) - y * np.roll(x, 1, axis=-1)
    scale = 1.0 / (stiff * (a + d - stiff) + (cross * cross).sum(-1))
    softness = np.empty((*a.shape, 2, 2))
    softness[..., 0, 0], softness[..., 1, 1] = d * scale, a * scale
    softness[..., 0, 1] = softness[..., 1, 0] = -b * scale
    return softness
