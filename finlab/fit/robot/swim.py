"""One swim as a fit sees it: what the actuators did and what the sensors said, on an even grid of time."""

from dataclasses import dataclass

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.vehicle.actuator_motion import ActuatorMotion
from finlab.vehicle.fin_motion import FinMotion
from finlab.vehicle.vehicle import body_rates, body_velocity

STEP_S = 0.1
"""Spacing of the grid [s]."""
SUBSTEPS = 2
"""Moments within a step at which the actuators' forces are taken."""
CHANNELS = ("x", "y", "z", "roll", "pitch", "yaw", "u", "v", "w", "p", "q", "r")
"""What sensors may say: position in the world [m], attitude [rad], velocity [m/s] and angular rates [rad/s]
in the body frame."""
ANGLES = slice(3, 6)
SMOOTHED = (11, 2)
"""Samples and order of the filter by Savitzky and Golay."""


@dataclass(frozen=True)
class Swim:
    """N steps of one robot with n actuators."""

    name: str
    motion: Array
    """What the actuators did, (N, SUBSTEPS, n, 3), as their commands, of fins amplitude [rad], frequency
    [Hz], direction [rad]; NaN for one that gave nothing."""
    measured: Array
    """What the sensors said at the beginning of each step (N, 12), in the order of `CHANNELS`; NaN where
    there is nothing new."""

    def __len__(self) -> int:
        return len(self.motion)


def replay(layout: Layout, command: Array) -> Array:
    """What actuators that follow as they should do (N, SUBSTEPS, n, 3) under commands (N, n, 3), one per
    step, NaN for a lost one."""
    moving = motion_of(layout)
    return np.array([followed(moving, row) for row in command])


def motion_of(layout: Layout) -> ActuatorMotion:
    """Actuators at rest, fins no faster than their servos."""
    return ActuatorMotion(layout, FinMotion(layout))


def followed(moving: ActuatorMotion, command: Array) -> Array:
    """Moves actuators on by one step under a command (n, 3), and returns what they do (SUBSTEPS, n, 3)."""
    motion = np.empty((SUBSTEPS, *command.shape))
    for s in range(SUBSTEPS):
        moving.step(command, STEP_S / SUBSTEPS / 2)
        motion[s] = np.where(moving.pushes[:, None], moving.command, np.nan)
        moving.step(command, STEP_S / SUBSTEPS / 2)
    return motion


def only_new(measured: Array) -> Array:
    """Samples (N, 12) of which those that a slow sensor only held are NaN."""
    held = np.zeros(measured.shape, bool)
    held[1:] = measured[1:] == measured[:-1]
    return np.where(held, np.nan, measured)


def smoothed(measured: Array) -> Array:
    """Samples (N, 12) without holes and with less noise: a first guess of what the robot did. Channels that
    say nothing are made of the others, or zero."""
    from scipy.signal import savgol_filter

    grid = np.arange(len(measured))
    full = np.zeros(measured.shape)
    known = np.asarray(np.isfinite(measured))
    said = np.asarray(known.any(axis=0))
    for k in np.flatnonzero(said):
        fresh = known[:, k]
        values = measured[fresh, k]
        values = np.unwrap(values) if ANGLES.start <= k < ANGLES.stop else values
        full[:, k] = np.interp(grid, grid[fresh], values)
    full[:, said] = savgol_filter(full[:, said], *SMOOTHED, axis=0)
    pace = np.gradient(full, STEP_S, axis=0)
    rates = body_rates(full[:, ANGLES], pace[:, ANGLES])
    velocity = body_velocity(full[:, ANGLES], pace[:, :3])
    made = np.concatenate([velocity, rates], axis=1)
    full[:, 6:] = np.where(said[6:], full[:, 6:], made)
    return full
