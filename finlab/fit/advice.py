"""What to measure next: where the forces of a fit are least certain."""

import numpy as np

from finlab.arrays import Array
from finlab.fit.fin_fit import FinFit
from finlab.layout.angles import wrapped

CANDIDATES = (6, 6, 8)
"""Amplitudes, frequencies and zero directions among which the next measurements are chosen."""
APART = (0.25, 0.25, 0.9)
"""Proposals differ by this much in amplitude or frequency, over the largest measured, or in direction [rad]:
one tells of its neighbours, too."""


def next_measurements(fit: FinFit, count: int = 5) -> Array:
    """Returns commands (count, 3), the least certain first. No two are nearer to each other than `APART`;
    where that leaves fewer than `count`, fewer are returned."""
    commands = fit.grid(CANDIDATES)[1:, 1:].reshape(-1, 3)  # at rest there is nothing to measure
    if not fit.measurements.turned:
        commands[:, 2] = fit.measurements.command[0, 2]
    inputs, doubt = fit.measurements.scaled(commands), fit.uncertainty(commands)
    chosen: list[int] = []
    while len(chosen) < count and (doubt > 0.0).any():
        chosen.append(int(np.argmax(doubt)))
        away = inputs - inputs[chosen[-1]]
        away[:, 2] = wrapped(away[:, 2])
        doubt[(np.abs(away) < APART).all(axis=1)] = 0.0
    return np.asarray(commands[chosen])
