"""The largest ball about the origin in a zonotope, by all of its facets."""

from itertools import combinations

import numpy as np

from finlab.arrays import Array


def largest_ball(columns: Array, unevenness: float = 0.0) -> Array:
    """Returns the radius of the largest ball about 0 within sum_i [rho - 1, rho + 1] b_i.

    The normal of each facet is orthogonal to m - 1 columns: a row of the inverse of m columns that
    contain those. A set of columns without an inverse makes the radius too large by nothing, as
    its normals are those of other facets or of a degenerate one; it is left out.

    Args:
        columns: b (R, n, m), in general position.
        unevenness: rho, 0 to 1.
    """
    n, m = columns.shape[1:]
    radius = np.full(len(columns), np.inf)
    is_seen = set[tuple[int, ...]]()
    for chosen in combinations(range(n), m):
        facets = [tuple(np.delete(chosen, k)) for k in range(m)]
        if set(facets) <= is_seen:
            continue
        is_seen |= set(facets)
        # Columns of the inverse of rows b: the k-th is orthogonal to all but the k-th of them.
        inverse = np.linalg.inv(columns[:, list(chosen)])
        normals = inverse / np.linalg.norm(inverse, axis=1, keepdims=True)
        pull = columns @ normals
        support = np.abs(pull).sum(axis=1) - unevenness * np.abs(pull.sum(axis=1))
        radius = np.minimum(radius, support.min(axis=1))
    return radius
