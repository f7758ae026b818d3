"""Many small strictly convex box-constrained quadratic programs at once, solved exactly.

Projected Newton steps (Bertsekas, 1982): variables held at a limit by their gradient rest, the others take a
Newton step, and a search along the projected path keeps the objective falling. Ends at the exact solution
after a finite number of steps; tests compare it with SciPy's active-set solver `lsq_linear(method="bvls")`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MAX_STEPS = 60
TOLERANCE = 1e-10
"""Largest projected gradient, relative to the size of the gradient at zero, of a solved problem."""
SEARCH_HALVINGS = 40
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
    """The first point on the projected path `clip(at + t step)`, t = 1, 1/2, ..., that falls enough.

    Where none does, because a variable that is only just free blocks the way, a projected gradient step,
    which always falls.
    """
    lipschitz = np.abs(h).sum(axis=2).max(axis=1, keepdims=True)
    best = np.clip(at - slope / lipschitz, low, high)
    pending = np.arange(len(at))
    length = 1.0
    for _ in range(SEARCH_HALVINGS):
        trial = np.clip(at[pending] + length * step[pending], low[pending], high[pending])
        move = trial - at[pending]
        linear = np.einsum("bi,bi->b", slope[pending], move)
        change = linear + 0.5 * np.einsum("bi,bij,bj->b", move, h[pending], move)
        good = (change <= SUFFICIENT_DECREASE * linear) & (linear < 0)
        best[pending[good]] = trial[good]
        pending = pending[~good]
        if not len(pending):
            break
        length /= 2
    return best
