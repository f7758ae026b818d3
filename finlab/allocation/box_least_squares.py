"""Many small strictly convex box-constrained quadratic programs at once, solved exactly.

Projected Newton steps (Bertsekas, 1982): variables held at a limit by their gradient rest, the others take a
Newton step, and a search along the projected path keeps the objective falling. Ends at the exact solution
after a finite number of steps; tests compare it with SciPy's active-set solver `lsq_linear(method="bvls")`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MAX_STEPS = 40
TOLERANCE = 1e-10
"""Largest projected gradient, relative to the size of the gradient at zero, of a solved problem."""
SEARCH_HALVINGS = 12
SUFFICIENT_DECREASE = 1e-4


def solve_box_quadratics(hessian: Array, gradient: Array, lower: Array, upper: Array) -> Array:
    """Minimize `0.5 x' H x + g' x` subject to `lower <= x <= upper`, for B problems of m variables.

    Args:
        hessian: symmetric positive definite H (B, m, m).
        gradient: g (B, m).
        lower: (B, m), not above `upper`.
        upper: (B, m).

    Returns:
        x (B, m), within the limits exactly.
    """
    x = np.clip(np.zeros_like(gradient), lower, upper)
    scale = np.maximum(np.abs(gradient).max(axis=1), 1e-300)
    busy = np.arange(len(x))
    identity = np.eye(gradient.shape[1])
    for _ in range(MAX_STEPS):
        h, low, high, at = hessian[busy], lower[busy], upper[busy], x[busy]
        slope = np.einsum("bij,bj->bi", h, at) + gradient[busy]
        projected = at - np.clip(at - slope, low, high)
        unsolved = np.abs(projected).max(axis=1) > TOLERANCE * np.minimum(scale[busy], 1.0)
        if not unsolved.any():
            break
        busy, h, low, high = busy[unsolved], h[unsolved], low[unsolved], high[unsolved]
        at, slope = at[unsolved], slope[unsolved]
        held = ((at <= low) & (slope > 0)) | ((at >= high) & (slope < 0))
        pair_free = ~(held[:, :, None] | held[:, None, :])
        free_slope = np.where(held, 0.0, slope)
        reduced = np.where(pair_free, h, identity)
        step = -np.linalg.solve(reduced, free_slope[..., None])[..., 0]
        x[busy] = _search(h, slope, at, step, low, high)
    return x


def _search(h: Array, slope: Array, at: Array, step: Array, low: Array, high: Array) -> Array:
    """The first point on the projected path `clip(at + t step)`, t = 1, 1/2, ..., that falls enough."""
    best = at.copy()
    open_ = np.arange(len(at))
    length = 1.0
    for _ in range(SEARCH_HALVINGS):
        trial = np.clip(at[open_] + length * step[open_], low[open_], high[open_])
        move = trial - at[open_]
        linear = np.einsum("bi,bi->b", slope[open_], move)
        change = linear + 0.5 * np.einsum("bi,bij,bj->b", move, h[open_], move)
        good = change <= SUFFICIENT_DECREASE * linear
        best[open_[good]] = trial[good]
        open_ = open_[~good]
        if not len(open_):
            break
        length /= 2
    return best
