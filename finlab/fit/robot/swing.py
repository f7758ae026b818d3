"""Forces of fins that swing within the beat and while they turn: no thrust, but they shake the robot.

They follow from where each fin is within its beat, which is known where all began to flap with the log and
servos are nominal. As those of a rigid plate (`finlab.actuators.fin.blade`) they are

- of the water that it carries: minus the change of m L^2 / 2 theta' along the plate's normal;
- of its drag, rho Cd W L^3 / 6 theta' |theta'| against the normal;
- both of a tip that lags by a quarter of a beat;
- the pulses of its thrust, two in each beat: m L^2 / 2 (theta'^2 - its mean) along the zero direction, the
  same of the tip that lags, and of both together.

A soft tip gives way to a slow turn otherwise than to the beat, so what a fin that turns meets sideways stands
by itself, square to its zero direction: drag in proportion to the beat's speed and to the turn's, thrust that
turns late, and drag of the turn alone.

A fit finds how much there is of each, and how that changes with the frequency and the amplitude. None has a
mean over a whole beat of a fin that does not turn.
"""

import math

import numpy as np

from finlab.arrays import Array
from finlab.fit.robot.swim import STEP_S
from finlab.layout import Layout
from finlab.layout.angles import wrapped
from finlab.physics import plant_of
from finlab.vehicle.fin_motion import FinMotion

MOMENTS = 10
"""Moments of each step at which the fins are looked at."""
KINDS = 10
"""Forces that are distinguished; the last three are of fins that turn."""
TERMS = 3 * KINDS
"""Forces whose shares are looked for: each kind, and what it changes by with frequency and amplitude."""
USUAL_HZ, USUAL_RAD = 1.0, 0.4
"""Frequency and amplitude [rad] from which changes with them count."""
LATE_S = 0.2
"""How late thrust may turn [s] that turns with its fin; a share of one stands for it."""


def swing_forces(layout: Layout, command: Array) -> Array:
    """Mean forces of each step along (e_h, e_z) [N], (N, n, 2, TERMS), under commands (N, n, 3)."""
    plant, fins = plant_of(layout), FinMotion(layout)
    steps, n = command.shape[:2]
    motion, beat = np.empty((steps * MOMENTS, n, 3)), np.empty((steps * MOMENTS, n, 3))
    for k in range(steps * MOMENTS):
        fins.step(command[k // MOMENTS], STEP_S / MOMENTS)
        motion[k], beat[k] = (
            fins.command,
            np.stack([fins.phase, fins.angle, fins.speed], axis=-1),
        )
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
    turn = wrapped(np.diff(motion[..., 2], axis=0, prepend=motion[:1, :, 2])) * (MOMENTS / STEP_S)
    pace = 2.0 * math.pi * motion[..., 0] * motion[..., 1]
    turning = resistance * pace, LATE_S * inertia * pace * pace, resistance * np.abs(turn)
    terms += [(turn * met)[..., None] * across for met in turning]
    changes = motion[..., 1] / USUAL_HZ - 1.0, motion[..., 0] / USUAL_RAD - 1.0
    terms += [change[..., None] * term for change in changes for term in terms]
    return np.asarray(np.stack(terms, axis=-1).reshape(steps, MOMENTS, n, 2, TERMS).mean(axis=1))
