"""The axes of a wrench, and which of them a robot commands."""

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

Axis = Literal["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"]
AXES: tuple[Axis, ...] = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
"""The axes of a wrench, in order: forces [N] and torques [N m] along x forward, y left, z up."""
CommandedAxes = Annotated[
    tuple[Axis, ...],
    Meta(min_length=1, max_length=6, description="axes of the wrench that the robot commands"),
]


def mask_of(axes: Sequence[str]) -> NDArray[np.bool_]:
    """Returns a mask (6,) of some axes."""
    return np.array([axis in axes for axis in AXES])


def axes_in(mask: NDArray[np.bool_]) -> tuple[Axis, ...]:
    """Returns the axes of a mask (6,)."""
    return tuple(axis for axis, one in zip(AXES, mask, strict=True) if one)
