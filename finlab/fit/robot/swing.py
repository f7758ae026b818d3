"""Forces of fins that swing within the beat: no thrust, but they shake the robot.

They follow from where each fin is within its beat, which is known where all began to flap with the log and
servos are nominal. As those of a rigid plate (`finlab.actuators.fin.blade`) they are

- of the water that it carries: minus the change of m L^2 / 2 theta' along the plate's normal;
- of its drag, rho Cd W L^3 / 6 theta' |theta'| against the normal;
- both of a tip that lags by a quarter of a beat;
- the pulses of its thrust, two in each beat: m L^2 / 2 (theta'^2 - its mean) along the zero direction, the
  same of the tip that lags, and of both together.

A fit finds how much there is of each. None has a mean over a whole beat.
"""

import math

import numpy as np

from finlab.arrays import Array
from finlab.fit.robot.swim import STEP_S
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.vehicle.fin_motion import FinMotion

MOMENTS = 10
"""Moments of each step at which the fins are looked at."""
TERMS = 7
"""Forces whose shares are looked for."""


def swing_forces(layout: Layout, command: Array) -> Array:
    """Mean forces of each step along (e_h, e_z) [N], (N, n, 2, TERMS), under commands (N, n, 3)."""
    plant, fins = plant_of(layout), FinMotion(layout)
    steps, n = command.shape[:2]
    motion, beat = np.empty((steps * MOMENTS, n, 3)), np.empty((steps * MOMENTS, n, 3))
    for k in range(steps * MOMENTS):
        fins.step(command[k // MOMENTS], STEP_S / MOMENTS)
        motion[k] = fins.command
        beat[k] = np.stack([fins.phase, fins.angle, fins.speed], axis=-1)
    phase, angle, speed = beat[..., 0], beat[..., 1] + math.pi, beat[..., 2]  # it points away from its thrust
    normal = np.stack([-np.sin(angle), np.cos(angle)], axis=-1)
    along = np.stack([np.cos(motion[..., 2]), np.sin(motion[..., 2])], axis=-1)
    late = 2.0 * math.pi * motion[..., 0] * motion[..., 1] * np.sin(phase)
    blade = plant.blade
    inertia = 0.5 * blade.virtual_mass * blade.length**2
    resistance = blade.force_drag
    terms = []
    for own in (speed, late):
        carried = (inertia * own)[..., None] * normal
        terms.append(-np.diff(carried, axis=0, prepend=np.zeros((1, n, 2))) * (MOMENTS / STEP_S))
    # Along the plate as it stands, the drag of a tip that lags would have a mean, which is thrust.
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    for own, axis in ((speed, normal), (late, across)):
        terms.append(-(resistance * own * np.abs(own))[..., None] * axis)
    mean = 0.5 * (2.0 * math.pi * motion[..., 0] * motion[..., 1]) ** 2
    pulses = speed * speed - mean, late * late - mean, speed * late
    terms += [(inertia * pulse)[..., None] * along for pulse in pulses]
    return np.asarray(np.stack(terms, axis=-1).reshape(steps, MOMENTS, n, 2, TERMS).mean(axis=1))
