"""Commands in coordinates where every limit range is [-1, 1]; for numpy's arrays and torch's tensors."""

from __future__ import annotations

import math
from typing import Any

from finlab.array_library import library_of

Values = Any
"""An array or a tensor."""


def to_normalized(command: Values, lower: Values, upper: Values) -> Values:
    """Commands (..., 3) between limits (..., 3) to [-1, 1]; a range of no width maps to 0."""
    half = 0.5 * (upper - lower)
    return (command - lower - half) / half.clip(1e-9)


def to_command(x: Values, lower: Values, upper: Values) -> Values:
    """Inverse of `to_normalized`; not clamped."""
    half = 0.5 * (upper - lower)
    return lower + half + x * half


def clamp_to_limits(command: Values, lower: Values, upper: Values) -> Values:
    """Commands (..., n, 3) inside their limits (n, 3 or broadcastable).

    Zero directions are angles: one outside an arc is first brought to the turn nearest the middle of
    the arc, then to its nearer end.
    """
    xp = library_of(command)
    middle = 0.5 * (lower[..., 2] + upper[..., 2])
    direction = middle + xp.remainder(command[..., 2] - middle + math.pi, 2 * math.pi) - math.pi
    unwrapped = xp.stack([command[..., 0], command[..., 1], direction], axis=-1)
    return xp.minimum(xp.maximum(unwrapped, lower), upper)
