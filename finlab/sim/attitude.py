"""Attitude as a unit quaternion (w, x, y, z) that turns body vectors into the world."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def quaternion_of_yaw(yaw: float) -> tuple[float, float, float, float]:
    """The attitude of a level robot that heads `yaw` [rad] from the world's x, counter-clockwise."""
    return (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))


def rotation(quaternion: ArrayLike) -> Array:
    """Matrices (..., 3, 3) that take body vectors to the world, of quaternions (..., 4)."""
    w, x, y, z = np.moveaxis(np.asarray(quaternion, dtype=np.float64), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def euler(quaternion: ArrayLike) -> Array:
    """Roll, pitch, yaw (..., 3) [rad], turned about z, then y, then x; pitch is positive nose down."""
    w, x, y, z = np.moveaxis(np.asarray(quaternion, dtype=np.float64), -1, 0)
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return np.stack([roll, pitch, yaw], axis=-1)
