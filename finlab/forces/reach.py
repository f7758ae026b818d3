"""The largest wrench in a given direction with nothing beside it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.forces.answers import strong
from finlab.forces.dual import Dual, minimize_dual
from finlab.forces.fin_sets import FinSets, convex_parts, joined

Array = NDArray[np.float64]

FINE = (1.0, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5, 1e-6)
"""Softness of the fins' answers, in falling order, for results to be shown."""
COARSE = (1.0, 0.1, 0.03, 0.01)
"""The same for searches that ask thousands of times."""
BESIDE = 1e-6
"""Scaled wrench [N, as a share of the size plus 1 N] that may be left beside the one asked for."""


class Largest(NamedTuple):
    """Largest scaled wrenches of R questions."""

    size: Array
    """How much the fins can give (R,) [N]; proven to be no less than the truth."""
    gap: Array
    """The truth is at most this much smaller (R,) [N]."""
    wrench: Array
    """The scaled wrench (R, 6) itself."""
    normal: Array
    """Direction (R, 6) of the plane that touches the set of wrenches there, not normalized."""


def largest(sets: FinSets, origin: Array, basis: Array, softness: tuple[float, ...] = FINE) -> Largest:
    """Returns the largest wrenches along `origin` (R, 6) that have no part along `basis` (R, 6, k).

    Each is bracketed: the plane that the dual ends with lies outside of the set of all wrenches, and the
    forces that answer it lie inside.
    """
    rows, n = sets.radius.shape
    pull = np.sqrt((sets.pull(origin) ** 2).sum(-1)).max(-1)
    unit = np.maximum(pull, 1e-6)[:, None] * np.ones(n)
    nothing = np.zeros((rows, 6))
    x = np.zeros((rows, basis.shape[-1]))
    for factor in softness:
        # Only the last, hardest answer is what counts.
        tolerance = 1e-9 if factor == softness[-1] else 1e-3
        dual = Dual(strong, sets, factor * unit, origin, basis, nothing)
        x = minimize_dual(dual, x, tolerance)
    normal = dual.normal(x)
    wrench = sets.wrench(strong(sets, sets.pull(normal), dual.softness)[1])
    size = sets.farthest(normal)[0]
    beside = np.abs((wrench[:, None] @ basis)[:, 0]).max(-1)
    # A wrench that is not where it was asked for proves nothing.
    proven = np.where(beside <= BESIDE * (1.0 + size), (wrench * origin).sum(-1), 0.0)
    return Largest(size, np.maximum(size - proven, 0.0), wrench, normal)


def max_wrench_along(sets: FinSets, direction: Array, softness: tuple[float, ...] = FINE) -> Largest:
    """Returns the largest wrenches that point exactly along unit `direction` (R, 6), all else zero."""
    return largest(sets, direction, orthogonal_complement(direction), softness)


def max_wrench_along_exactly(sets: FinSets, directions: Array) -> tuple[Array, float]:
    """Returns the largest wrenches (P, D) of robots (P) along unit `directions` (D, 6), and the largest gap.

    Sectors wider than half a turn are taken in pieces, so that the result is theirs and not their hull's;
    with too many of them the hull's, larger, result is returned.
    """
    robots, n = len(sets.radius), len(directions)
    parts = convex_parts(sets)
    rows = np.repeat(np.arange(len(parts) * robots), n)
    found = max_wrench_along(joined(parts).take(rows), np.tile(directions, (len(parts) * robots, 1)))
    size, proven = (
        v.reshape(len(parts), robots, n).max(axis=0) for v in (found.size, found.size - found.gap)
    )
    return size, float((size - proven).max())


def orthogonal_complement(direction: Array) -> Array:
    """Returns an orthonormal basis (R, 6, 5) of all that is at right angles to unit `direction` (R, 6)."""
    # Householder's reflection takes an axis to the direction, and the other five axes along.
    rows, k = direction.shape
    axis = np.argmax(np.abs(direction), axis=-1)
    sign = np.sign(direction[np.arange(rows), axis])
    mirror = direction.copy()
    mirror[np.arange(rows), axis] += sign
    mirror /= np.linalg.norm(mirror, axis=-1, keepdims=True)
    reflection = np.eye(k) - 2.0 * mirror[..., :, None] * mirror[..., None, :]
    keep = np.arange(k) != axis[:, None]
    return np.swapaxes(np.swapaxes(reflection, -1, -2)[keep].reshape(rows, k - 1, k), -1, -2)
