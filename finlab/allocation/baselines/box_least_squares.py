"""Many small strictly convex box-constrained quadratic programs at once, solved exactly.

Projected Newton steps (Bertsekas, 1982): variables held at a limit by their gradient rest, and those that the
others would push out of theirs; the others take a Newton step, and a search along the projected path, or the
straight way to the first limit, keeps the objective falling. Ends at the exact solution
after a finite number of steps; tests compare it with SciPy's active-set solver `lsq_linear(method="bvls")`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from finlab.arrays import Array
from finlab.forces.small_systems import Held, solve_symmetric, step_within


@dataclass(frozen=True)
class BoxSettings:
    """How exactly the programs are solved."""

    max_steps: int = 60
    """Most projected Newton steps; a dozen are usual."""
    passes: int = 4
    """Times a Newton step is solved, each time with those variables at rest that it would push out of their
    limits."""
    tolerance: float = 1e-10
    """Largest projected gradient, relative to the size of the gradient at zero, of a solved problem."""
    halvings: int = 4
    """Most halvings of a step along the path that bends at the limits."""
    sufficient_decrease: float = 1e-4
    """Share of the first-order decrease that a step must reach (Armijo's rule)."""


EXACTLY = BoxSettings()
"""To rounding."""


def solve_box_quadratics(
    hessian: Array,
    gradient: Array,
    lower: Array,
    upper: Array,
    settings: BoxSettings = EXACTLY,
    is_over: Callable[[], bool] = lambda: False,
) -> Array:
    """Minimize `0.5 x' H x + g' x` subject to `lower <= x <= upper`, for B problems of m variables.

    Args:
        hessian: symmetric H (B, m, m), positive definite but for rounding.
        gradient: g (B, m).
        lower: (B, m), not above `upper`.
        upper: (B, m).
        settings: how exactly.
        is_over: says when to stop with what there is.

    Returns:
        x (B, m), within the limits exactly.
    """
    x = np.clip(np.zeros_like(gradient), lower, upper)
    scale = np.maximum(np.abs(gradient).max(axis=1), 1e-300)
    busy = np.arange(len(x))
    identity = np.eye(gradient.shape[1])
    for _ in range(settings.max_steps):
        h, low, high, at = hessian[busy], lower[busy], upper[busy], x[busy]
        slope = np.einsum("bij,bj->bi", h, at) + gradient[busy]
        projected = at - np.clip(at - slope, low, high)
        unsolved = np.abs(projected).max(axis=1) > settings.tolerance * np.minimum(scale[busy], 1.0)
        if not unsolved.any() or is_over():
            break
        busy, h, low, high = busy[unsolved], h[unsolved], low[unsolved], high[unsolved]
        at, slope = at[unsolved], slope[unsolved]
        held = ((at <= low) & (slope > 0)) | ((at >= high) & (slope < 0))
        # A variable at a limit that the others' steps push outwards would block the whole path.
        newton = partial(_newton_step, h, slope, identity)
        least, most = np.where(at <= low, 0.0, -np.inf), np.where(at >= high, 0.0, np.inf)
        step = step_within(newton, least, most, settings.passes, held)
        x[busy] = _search(h, slope, at, step, low, high, settings)
    return x


def _newton_step(h: Array, slope: Array, identity: Array, _: Array, held: Held) -> Array:
    """The Newton step (B, m) of the variables that are not held."""
    reduced = np.where(held[:, :, None] | held[:, None, :], identity, h)
    return np.asarray(-solve_symmetric(reduced, np.where(held, 0.0, slope)[..., None])[..., 0])


def _search(
    h: Array, slope: Array, at: Array, step: Array, low: Array, high: Array, settings: BoxSettings
) -> Array:
    """The first point on the projected path `clip(at + t step)`, t = 1, 1/2, ..., that falls enough.

    Where none does, because a variable that is only just free bends the path, the straight way to the first
    limit, along which the objective falls; where that has no length, a projected gradient step, which always
    falls.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        room = np.where(step > 0, (high - at) / step, np.where(step < 0, (low - at) / step, np.inf))
    ahead = np.minimum(room.min(axis=1, keepdims=True), 1.0)
    lipschitz = np.abs(h).sum(axis=2).max(axis=1, keepdims=True)
    best: Array = np.clip(np.where(ahead > 0, at + ahead * step, at - slope / lipschitz), low, high)
    # At the limit exactly: short of it by rounding, it would block the next step.
    met = (ahead > 0) & (room <= ahead)
    best[met] = np.where(step > 0, high, low)[met]
    pending = np.arange(len(at))
    length = 1.0
    for _ in range(settings.halvings):
        trial = np.clip(at[pending] + length * step[pending], low[pending], high[pending])
        move = trial - at[pending]
        linear = np.einsum("bi,bi->b", slope[pending], move)
        change = linear + 0.5 * np.einsum("bi,bij,bj->b", move, h[pending], move)
        good = (change <= settings.sufficient_decrease * linear) & (linear < 0)
        best[pending[good]] = trial[good]
        pending = pending[~good]
        if not len(pending):
            break
        length /= 2
    return best
