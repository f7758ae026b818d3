"""Layouts as padded arrays, and the geometry of their forces. numpy only."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array, library_of
from finlab.errors import LayoutError
from finlab.layout.fin import Limits
from finlab.layout.layout import Layout


class LayoutArrays(NamedTuple):
    """A batch of B layouts padded to n fins, float64. Padding is a fin at the origin with nominal limits."""

    position: Array
    """Where each fin's force acts, body frame [m], (B, n, 3)."""
    mounting_angle: Array
    """Azimuth of each shaft [rad], (B, n)."""
    lower: Array
    """Least (amplitude [rad], frequency [Hz], zero direction [rad]), (B, n, 3)."""
    upper: Array
    """Greatest (amplitude [rad], frequency [Hz], zero direction [rad]), (B, n, 3)."""
    mask: NDArray[np.bool_]
    """True where there is a fin, False where there is padding, (B, n)."""


def empty_arrays(n_layouts: int, n_fins: int) -> LayoutArrays:
    """Returns a batch of nothing but padding, to be filled in."""
    nominal = Limits()
    return LayoutArrays(
        position=np.zeros((n_layouts, n_fins, 3)),
        mounting_angle=np.zeros((n_layouts, n_fins)),
        lower=np.tile(np.array(nominal.lower), (n_layouts, n_fins, 1)),
        upper=np.tile(np.array(nominal.upper), (n_layouts, n_fins, 1)),
        mask=np.zeros((n_layouts, n_fins), dtype=bool),
    )


def stack_layouts(layouts: Sequence[Layout]) -> LayoutArrays:
    """Returns layouts as one batch padded to the most fins; a `LayoutError` where there are none."""
    if len(layouts) == 0:
        raise LayoutError("expected at least one layout to stack, got none")
    width = max(layout.n_fins for layout in layouts)
    arrays = empty_arrays(len(layouts), width)
    for b, layout in enumerate(layouts):
        n = layout.n_fins
        arrays.position[b, :n], arrays.mounting_angle[b, :n] = layout.position, layout.mounting_angle
        arrays.lower[b, :n], arrays.upper[b, :n] = layout.lower, layout.upper
        arrays.mask[b, :n] = True
    return arrays


def force_effectiveness(position: Any, mounting_angle: Any) -> Any:
    """Returns what one newton along each fin's three axes does to the robot.

    Args:
        position: (..., n, 3), body frame [m]; an array or a tensor.
        mounting_angle: (..., n) [rad].

    Returns:
        (..., n, 3, 6): wrench [Fx, Fy, Fz, Tx, Ty, Tz] about the origin of 1 N along shaft, e_h and e_z.
    """
    xp = library_of(position)
    x, y, z = position[..., 0], position[..., 1], position[..., 2]
    c, s = xp.cos(mounting_angle), xp.sin(mounting_angle)
    zero, one = xp.zeros_like(x), xp.ones_like(x)
    shaft = [c, s, zero, -z * s, z * c, x * s - y * c]
    horizontal = [-s, c, zero, -z * c, -z * s, x * c + y * s]
    vertical = [zero, zero, one, y, -x, zero]
    return xp.stack([xp.stack(axis, axis=-1) for axis in (shaft, horizontal, vertical)], axis=-2)


def own_effectiveness(layout: Layout) -> Array:
    """What one newton along each actuator's own three axes does to the robot.

    Returns:
        (n, 3, 6): wrench [Fx, Fy, Fz, Tx, Ty, Tz] about the origin of 1 N along each row of `layout.frames`,
        with the reaction torque of propellers about the direction of their force.
    """
    reaction = np.array([getattr(part, "torque_per_newton", 0.0) for part in layout.actuators])
    torque = np.cross(layout.position[:, None], layout.frames) + reaction[:, None, None] * layout.frames
    return np.concatenate([layout.frames, torque], axis=-1)


def layout_effectiveness(layout: Layout) -> Array:
    """What one newton along each fin's two thrust axes does to the robot.

    Returns:
        (6, 2 n): wrench [Fx, Fy, Fz, Tx, Ty, Tz] of 1 N along zero and along shaft x zero, which are e_h and
        e_z of a horizontal shaft, fins side by side.

    Raises:
        LayoutError: an actuator is no fin.
    """
    layout.only_fins("what asks for two thrust axes of each actuator")
    return own_effectiveness(layout)[:, 1:].reshape(-1, 6).T
