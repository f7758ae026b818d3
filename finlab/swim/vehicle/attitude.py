"""Attitudes as quaternions (w, x, y, z), as angles about z, then y, then x, and as rotations.

A rotation is nine numbers, floats or arrays: the axes x, y and z of the body one after the other,
as the world (z up) sees them.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from finlab.arrays import Array


def quaternion_of(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """Returns the attitude (w, x, y, z) after turns about z, then y, then x.

    Args:
        roll: about x [rad].
        pitch: about y [rad], positive nose down.
        yaw: about z [rad].
    """
    cr = math.cos(0.5 * roll)
    sr = math.sin(0.5 * roll)
    cp = math.cos(0.5 * pitch)
    sp = math.sin(0.5 * pitch)
    cy = math.cos(0.5 * yaw)
    sy = math.sin(0.5 * yaw)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def euler(quaternion: ArrayLike) -> Array:
    """Roll, pitch, yaw (..., 3) [rad], turned about z, then y, then x; pitch is positive nose
    down."""
    w, x, y, z = np.moveaxis(np.asarray(quaternion, dtype=np.float64), -1, 0)
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return np.stack([roll, pitch, yaw], axis=-1)


def rotation_of_quaternion(w: Any, x: Any, y: Any, z: Any) -> tuple[Any, ...]:
    """The rotation of a quaternion of unit length."""
    return (
        1 - 2 * (y * y + z * z),
        2 * (x * y + w * z),
        2 * (x * z - w * y),
        2 * (x * y - w * z),
        1 - 2 * (x * x + z * z),
        2 * (y * z + w * x),
        2 * (x * z + w * y),
        2 * (y * z - w * x),
        1 - 2 * (x * x + y * y),
    )


def rotation_of_angles(angles: Array) -> tuple[Array, ...]:
    """The rotations of roll, pitch and yaw (3, ...) [rad]."""
    cr, cp, cy = np.cos(angles)
    sr, sp, sy = np.sin(angles)
    x_axis = (cy * cp, sy * cp, -sp)
    y_axis = (cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr)
    z_axis = (cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr)
    return (*x_axis, *y_axis, *z_axis)


def tilt_of_quaternion(w: float, x: float, y: float, z: float) -> tuple[float, float]:
    """Roll and pitch [rad] of a quaternion of unit length."""
    r31 = 2 * (x * z - w * y)
    r32 = 2 * (y * z + w * x)
    r33 = 1 - 2 * (x * x + y * y)
    return math.atan2(r32, r33), math.asin(min(max(-r31, -1.0), 1.0))


def to_body(rotation: tuple[Any, ...], x: Any, y: Any, z: Any) -> tuple[Any, Any, Any]:
    """Returns a vector (x, y, z) of the world in the body frame."""
    r11, r21, r31, r12, r22, r32, r13, r23, r33 = rotation
    return (r11 * x + r21 * y + r31 * z, r12 * x + r22 * y + r32 * z, r13 * x + r23 * y + r33 * z)


def to_world(rotation: tuple[Any, ...], u: Any, v: Any, w: Any) -> tuple[Any, Any, Any]:
    """Returns a vector (u, v, w) of the body frame in the world."""
    r11, r21, r31, r12, r22, r32, r13, r23, r33 = rotation
    return (r11 * u + r12 * v + r13 * w, r21 * u + r22 * v + r23 * w, r31 * u + r32 * v + r33 * w)
