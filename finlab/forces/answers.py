"""How a fin answers a pull: the force within its set that goes furthest along it, made unique and smooth.

Both answers work in the fin's own view of its thrust plane: x along the middle of its arc, and across it,
mirrored to the left where only one stop matters.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from finlab.forces.fin_sets import FinSets

Array = NDArray[np.float64]

Answer = Callable[[FinSets, Array, Array], tuple[Array, Array, Array]]
"""Sets, pulls (R, n, 2) and softness (R, n) to a smoothed support function h of each fin (R, n), its
gradient, which is a force within the set (R, n, 2), and its Hessian (R, n, 2, 2)."""


def strong(sets: FinSets, pull: Array, softness: Array) -> tuple[Array, Array, Array]:
    """Answers with nearly the largest thrust: h = T sqrt(|q|^2 + softness^2), q the pull seen through the
    stops.

    h exceeds the true support function by at most T times the softness, twice for a hull.
    """
    if (sets.half >= np.pi).all():
        return _strong_circles(sets.radius, pull, softness)
    x, side, sign, turn = _view(sets, pull)
    wide = (sets.half > np.pi / 2) & (sets.half < np.pi)
    # The hull of a wide sector has a corner opposite its middle, between the stops; it is rounded.
    y = np.sqrt(side**2 + np.where(wide, softness, 0.0) ** 2)
    safe = np.where(y > 0.0, y, 1.0)
    lean, round_ = np.where(wide, side / safe, 1.0), np.where(wide, softness**2 / safe**3, 0.0)
    qx, qy, xx, xy, yy = _through_stops(sets.half, x, y)
    size = np.sqrt(qx**2 + qy**2 + softness**2)
    # Half the squared length of q has the gradient q and the Hessian (xx, xy, yy).
    push = sets.radius / size
    gx, gy = push * qx, push * qy
    hxx = push * (xx - qx * qx / size**2)
    hxy = push * (xy - qx * qy / size**2)
    hyy = push * (yy - qy * qy / size**2)
    return (
        sets.radius * size,
        *_back(turn, sign, gx, gy * lean, hxx, hxy * lean, hyy * lean**2 + gy * round_),
    )


def _strong_circles(radius: Array, pull: Array, softness: Array) -> tuple[Array, Array, Array]:
    """`strong` for fins without stops, several times quicker: no stop has to be looked at from its side."""
    x, y = pull[..., 0], pull[..., 1]
    square = x * x + y * y + softness**2
    size = np.sqrt(square)
    push = radius / size
    slope = np.empty((*pull.shape, 2))
    bend = push / square
    slope[..., 0, 0] = push - bend * x * x
    slope[..., 1, 1] = push - bend * y * y
    slope[..., 0, 1] = slope[..., 1, 0] = -bend * x * y
    return radius * size, push[..., None] * pull, slope


def cheap(sets: FinSets, pull: Array, softness: Array) -> tuple[Array, Array, Array]:
    """Answers with the force y that maximizes pull . y - softness |y|^2 / 2 within the set: exact."""
    x, side, sign, turn = _view(sets, pull / softness[..., None])
    narrow = sets.half <= np.pi / 2
    # A wide sector's hull has no such rays; a full circle looks past them.
    half = np.where(narrow, sets.half, np.pi)
    x, y, xx, xy, yy = _through_stops(half, x, side)
    size = np.sqrt(x * x + y * y)
    far = size > sets.radius
    safe = np.where(size > 0.0, size, 1.0)
    share = np.where(far, sets.radius / safe, 1.0)
    ux, uy = np.where(far, x / safe, 0.0), np.where(far, y / safe, 0.0)
    # A cone's projection leaves its result where it is, so the two slopes commute.
    bx, by = ux * xx + uy * xy, ux * xy + uy * yy
    xx, xy, yy = share * (xx - ux * bx), share * (xy - ux * by), share * (yy - uy * by)
    x, y = share * x, share * y
    # What is left of a wide sector's hull lies before the chord between its stops.
    chord, top = sets.radius * np.cos(sets.half), sets.radius * np.sin(sets.half)
    cut = ~narrow & (sets.half < np.pi) & (x < chord)
    x, y = np.where(cut, chord, x), np.where(cut, np.minimum(side, top), y)
    xx, xy, yy = np.where(cut, 0.0, xx), np.where(cut, 0.0, xy), np.where(cut, side < top, yy)
    force, slope = _back(turn, sign, x, y, xx, xy, yy)
    value = (pull * force).sum(-1) - 0.5 * softness * (force**2).sum(-1)
    return value, force, slope / softness[..., None, None]


def _view(sets: FinSets, pull: Array) -> tuple[Array, Array, Array, Array]:
    """Pulls as the fins see them: along the middle, across it without and as a sign, and the turn (R, n, 2,
    2)."""
    cos, sin = np.cos(sets.middle), np.sin(sets.middle)
    x = cos * pull[..., 0] + sin * pull[..., 1]
    side = cos * pull[..., 1] - sin * pull[..., 0]
    turn = np.stack([np.stack([cos, -sin], -1), np.stack([sin, cos], -1)], axis=-2)
    return x, np.abs(side), np.where(side < 0.0, -1.0, 1.0), turn


def _through_stops(half: Array, x: Array, y: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Points (x, y >= 0) onto the rays within `half` of the x axis, with the slope (xx, xy, yy) of that."""
    edge_x, edge_y = np.cos(half), np.sin(half)
    along = np.maximum(x * edge_x + y * edge_y, 0.0)
    outside = (half < np.pi) & (np.arctan2(y, x) > half)
    on_edge = np.where(along > 0.0, 1.0, 0.0)
    return (
        np.where(outside, along * edge_x, x),
        np.where(outside, along * edge_y, y),
        np.where(outside, on_edge * edge_x * edge_x, 1.0),
        np.where(outside, on_edge * edge_x * edge_y, 0.0),
        np.where(outside, on_edge * edge_y * edge_y, 1.0),
    )


def _back(
    turn: Array, sign: Array, x: Array, y: Array, xx: Array, xy: Array, yy: Array
) -> tuple[Array, Array]:
    """Forces (R, n, 2) and symmetric slopes (R, n, 2, 2) from the fins' views back to their planes."""
    force = (turn @ np.stack([x, sign * y], axis=-1)[..., None])[..., 0]
    slope = np.stack([np.stack([xx, sign * xy], -1), np.stack([sign * xy, yy], -1)], axis=-2)
    return force, turn @ slope @ np.swapaxes(turn, -1, -2)
