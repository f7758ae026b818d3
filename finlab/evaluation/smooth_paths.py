"""Smooth paths of wrenches that a robot can follow: sums of slow sines in every axis."""

import numpy as np

from finlab.arrays import Array
from finlab.forces.envelopes import largest_forces
from finlab.layout import Layout
from finlab.layout.arrays import layout_effectiveness

RATE = 10.0
"""Wrenches per second [Hz]."""
TICKS = 600
"""Length of a path: one minute."""
PERIODS = (10.0, 40.0)
"""Shortest and longest period of a path's sines [s]."""
N_SINES = 3
"""Sines in each axis."""
LOAD = 0.5
"""Largest share of a fin's thrust that an even spread of the path over the fins asks for."""
DOMAIN = 0x57EAD
"""Leads the seed of every path."""


def smooth_path(layout: Layout, sigma: Array, seed: int, ticks: int = TICKS) -> Array:
    """A path of wrenches (T, 6) [N, N m] that the layout can follow.

    Args:
        layout: the robot.
        sigma: per-axis standard deviation (6,), which sets how the axes compare.
        seed: same seed, same sines.
        ticks: how many; a shorter path is the beginning of a longer one up to its scale.
    """
    rng = np.random.default_rng((DOMAIN, seed))
    time = np.arange(ticks)[:, None] / RATE
    path = np.zeros((ticks, 6))
    for _ in range(N_SINES):
        frequency = rng.uniform(1.0 / PERIODS[1], 1.0 / PERIODS[0], 6)
        phase, size = rng.uniform(0.0, 2.0 * np.pi, 6), rng.uniform(0.3, 1.0, 6)
        path += size * np.sin(2.0 * np.pi * frequency * time + phase)
    effectiveness = layout_effectiveness(layout)
    # The least planar forces (T, 2n) whose wrench comes closest to sigma times the path.
    spread = path @ np.linalg.pinv(effectiveness / sigma[:, None], rcond=1e-6).T
    share = np.linalg.norm(spread.reshape(ticks, -1, 2), axis=-1) / largest_forces(layout)
    return np.asarray(spread @ effectiveness.T * (LOAD / share.max()))
