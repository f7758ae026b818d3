"""Righting moment of a robot, and the speed from which the water overturns it.

Surge, heave and pitch are linearized about straight motion ahead (T. I. Fossen, Handbook of Marine
Craft Hydrodynamics and Motion Control, chapter 7): the moment of the added mass (Munk's) grows with
the squared speed, the righting moment, lift times height of its centre, does not.
"""

import numpy as np

from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.swim.vehicle.fossen import complete_body, dynamics_of, jacobian

FASTEST, STEP = 3.0, 0.05
"""Speeds that are tried [m/s]."""
GROWTH = 0.05
"""Growth [1/s] from which on a motion counts as unstable."""
SMALL = 1e-3
"""Motion [m/s, rad/s] over which what rudders do is compared."""


def overturning_speed(layout: Layout) -> float | None:
    """The least speed ahead [m/s] at which a robot that nothing steers leaves the level in pitch;
    None where it stays up to `FASTEST`. What its layout leaves out of the body is U-CAT's."""
    body = dynamics_of(complete_body(layout))
    plant = plant_of(layout)
    rest = np.clip(np.zeros((layout.n, 3)), layout.lower, layout.upper)
    righting = body.lift * body.center[2] / body.inertia[4]
    for speed in np.arange(0.0, FASTEST, STEP).tolist():
        flow = np.array([speed, 0.0, 0.0, 0.0, 0.0, 0.0])
        slopes = np.array(jacobian(body, flow.tolist()))[np.ix_([2, 4], [2, 4])]
        if plant.feels_flow and speed > 0.0:
            for column, axis in enumerate((2, 4)):
                step = SMALL * np.eye(6)[axis]
                gained = plant.wrench(rest, flow=flow + step) - plant.wrench(rest, flow=flow - step)
                slopes[:, column] += gained[[2, 4]] / (2.0 * SMALL) / np.array(body.inertia)[[2, 4]]
        motion = np.zeros((3, 3))  # heave, pitch rate and pitch
        motion[:2, :2] = slopes
        motion[1, 2] = -righting
        motion[2, 1] = 1.0
        if np.linalg.eigvals(motion).real.max() > GROWTH:
            return float(speed)
    return None


def righting_words(layout: Layout) -> str | None:
    """What there is to say of a robot that nothing rights, or None of one that a moment rights."""
    body = dynamics_of(complete_body(layout))
    if body.lift * body.center[2] > 0.0:
        return None
    speed = overturning_speed(layout)
    if speed is None:
        return "no righting moment: nothing turns it back in roll and pitch"
    return (
        "no righting moment: overturns in pitch "
        f"{f'from {speed:.2g} m/s on' if speed else 'at rest'}"
    )
