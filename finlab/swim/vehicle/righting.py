"""Righting moment of a robot, and the speed from which the water overturns it.

Surge, heave and pitch are linearized about straight motion ahead (T. I. Fossen, Handbook of Marine
Craft Hydrodynamics and Motion Control, chapter 7): the moment of the added mass (Munk's) grows with
the squared speed, the righting moment, lift times height of its centre, does not.
"""

import numpy as np

from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.swim.vehicle.fossen import complete_body, dynamics_of, jacobian

MAX_SPEED = 3.0
"""Fastest speed that is tried [m/s]."""
SPEED_STEP = 0.05
"""Distance of the speeds that are tried [m/s]."""
UNSTABLE_GROWTH = 0.05
"""Growth [1/s] from which on a motion counts as unstable."""
DIFFERENCE = 1e-3
"""Motion [m/s, rad/s] over which what rudders do is compared."""
HEAVE_PITCH = (2, 4)
"""Places of heave and pitch among the six axes."""


def overturning_speed(layout: Layout) -> float | None:
    """The least speed ahead [m/s] at which a robot that nothing steers leaves the level in pitch.

    Heave speed w, pitch rate q and pitch theta follow x' = A x about straight motion ahead, with
    the Jacobian of the accelerations by w and q, and -k_theta = -W_b z_b / I_y for theta:

        (w', q') = J (w, q) - (0, k_theta theta),    theta' = q

    It leaves the level where an eigenvalue of A grows.

    Args:
        layout: the robot; what its layout leaves out of the body is U-CAT's.

    Returns:
        The speed; None where it stays level up to `MAX_SPEED`.
    """
    body = dynamics_of(complete_body(layout))
    inertia = np.array(body.inertia)[[*HEAVE_PITCH]]
    plant = plant_of(layout)
    neutral = np.clip(np.zeros((layout.n, 3)), layout.lower, layout.upper)
    k_theta = body.buoyancy * body.center_of_buoyancy[2] / body.inertia[4]
    for speed in np.arange(0.0, MAX_SPEED, SPEED_STEP).tolist():
        flow = np.array([speed, 0.0, 0.0, 0.0, 0.0, 0.0])
        J = np.array(jacobian(body, flow.tolist()))[np.ix_(HEAVE_PITCH, HEAVE_PITCH)]
        if plant.feels_flow and speed > 0.0:
            for column, axis in enumerate(HEAVE_PITCH):
                step = DIFFERENCE * np.eye(6)[axis]
                ahead = plant.wrench(neutral, flow=flow + step)
                behind = plant.wrench(neutral, flow=flow - step)
                J[:, column] += (ahead - behind)[[*HEAVE_PITCH]] / (2.0 * DIFFERENCE) / inertia
        A = np.zeros((3, 3))
        A[:2, :2] = J
        A[1, 2] = -k_theta
        A[2, 1] = 1.0
        if np.linalg.eigvals(A).real.max() > UNSTABLE_GROWTH:
            return float(speed)
    return None


def righting_words(layout: Layout) -> str | None:
    """What there is to say of a robot that nothing rights, or None of one that a moment rights."""
    body = dynamics_of(complete_body(layout))
    if body.buoyancy * body.center_of_buoyancy[2] > 0.0:
        return None
    speed = overturning_speed(layout)
    if speed is None:
        return "no righting moment: nothing turns it back in roll and pitch"
    start = f"from {speed:.2g} m/s on" if speed else "at rest"
    return f"no righting moment: overturns in pitch {start}"
