"""Measurement model of an accelerometer, for the state that the fault monitor estimates.

Without a velocity log, forces are seen by it at once: velocities need no drag to be known, and a
thruster without a lever about any axis shows as well as one that turns the robot.
"""

import math

import numpy as np

from finlab.arrays import Array
from finlab.swim.control.motion_model import BIAS, RATES, TILT, VELOCITY, ModelStep
from finlab.swim.vehicle.fossen import GRAVITY


def specific_force(state: Array, step: ModelStep, place: Array) -> tuple[Array, Array]:
    """Returns the specific force (3,) that is expected [m/s^2], and its derivatives (3, d).

    At a place r of the body, with v' of the body frame:

        f = v' + omega x v + omega' x r + omega x (omega x r) + g up + bias

    Args:
        state: z (d,) at the end of the period.
        step: the period, with the rates of change at its beginning.
        place: r, of the accelerometer from the centre of gravity (3,), body frame [m].
    """
    velocity = state[VELOCITY]
    omega = state[RATES]
    across_omega = _cross_matrix(omega)
    across_place = _cross_matrix(place)
    of_place = across_omega @ place
    roll, pitch = state[TILT].tolist()
    sin_roll = math.sin(roll)
    cos_roll = math.cos(roll)
    sin_pitch = math.sin(pitch)
    cos_pitch = math.cos(pitch)
    up = np.array([-sin_pitch, cos_pitch * sin_roll, cos_pitch * cos_roll])
    up_by_roll = np.array([0.0, up[2], -up[1]])
    up_by_pitch = np.array([-cos_pitch, -sin_pitch * sin_roll, -sin_pitch * cos_roll])
    rates = step.acceleration
    force = rates[VELOCITY] - across_place @ rates[RATES]  # omega' x r = -r x omega'
    force = force + across_omega @ (velocity + of_place) + GRAVITY * up + state[BIAS]
    slope = step.acceleration_slope
    rows = slope[VELOCITY] - across_place @ slope[RATES]
    rows[:, VELOCITY] += across_omega
    # Of omega x u with u = v + omega x r: -u x by omega, and omega x (-r x) by that in u.
    rows[:, RATES] -= _cross_matrix(velocity + of_place) + across_omega @ across_place
    rows[:, TILT] += GRAVITY * np.column_stack([up_by_roll, up_by_pitch])
    rows[:, BIAS] += np.eye(3)
    return np.asarray(force), np.asarray(rows)


def _cross_matrix(a: Array) -> Array:
    """The matrix (3, 3) of a x b, linear in b."""
    x, y, z = a.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
