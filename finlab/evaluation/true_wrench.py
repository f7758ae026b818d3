"""What the fins of a simulated plant truly give: the reference of fits of robots."""

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.sim.fin_force import FinForce, FlexibleForce
from finlab.sim.plants import make_plant
from finlab.vehicle.fin_motion import FinMotion

SETTLE_S, MEAN_S = 2.0, 10.0
"""Time after which, and over which, forces are averaged that swing within the beat."""


def true_wrench(plant: str, layout: Layout, command: Array, velocity: Array) -> Array:
    """Mean wrenches (T, 6) [N, N m] that commands (T, n, 3) truly give a robot that moves through the water
    with (T, 6) [m/s, rad/s]."""
    found = []
    for one, water in zip(command, velocity, strict=True):
        force = make_plant(plant, layout)
        found.append(np.einsum("nk,nkw->w", _mean_force(force, layout, one, water), force.effectiveness))
    return np.array(found)


def _mean_force(force: FinForce, layout: Layout, command: Array, water: Array) -> Array:
    """Mean forces (n, 3) of fins that follow a command (n, 3) for long."""
    motion = FinMotion(layout)
    motion.amplitude[:], motion.frequency[:], motion.direction[:] = command.T
    if not isinstance(force, FlexibleForce):
        return force.step(motion, force.step_s, water)
    dt, forces = force.step_s, []
    for k in range(round((SETTLE_S + MEAN_S) / dt)):
        motion.step(command, dt)
        step = force.step(motion, dt, water)
        if k * dt >= SETTLE_S:
            forces.append(step)
    # Each fin over whole beats of its own, or what swings within the beat would be left.
    beats = np.maximum(np.floor(MEAN_S * command[:, 1]), 1.0) / np.maximum(command[:, 1], 1.0 / MEAN_S)
    whole = np.minimum(np.rint(beats / dt).astype(int), len(forces))
    return np.array([np.mean(forces[-count:], axis=0)[i] for i, count in enumerate(whole)])
