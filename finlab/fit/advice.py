"""What to measure next: the few measurements that would help a fit most."""

import numpy as np

from finlab.arrays import Array
from finlab.fit.fin_fit import FinFit
from finlab.layout.angles import wrapped

CANDIDATES = (6, 6, 8)
"""Amplitudes, frequencies and zero directions among which the next measurements are chosen."""
APART = (0.1, 0.1, 0.3)
"""Proposals differ by this much in amplitude or frequency, over the largest measured, or in direction [rad]:
the same command measured once more tells of the noise, not of the fin."""


def next_measurements(fit: FinFit, count: int = 5) -> Array:
    """Returns commands (count, 3), best first: each lessens the variance of the forces, summed over all
    commands, more than any other would after those before it. No two are nearer to each other than `APART`;
    where that leaves fewer than `count`, fewer are returned."""
    commands = fit.grid(CANDIDATES)[1:, 1:].reshape(-1, 3)  # at rest there is nothing to measure
    if not fit.measurements.turned:
        commands[:, 2] = fit.measurements.command[0, 2]
    inputs = fit.measurements.scaled(commands)
    covariances = [component.covariance(inputs) for component in fit.components[:2]]
    noises = [float(np.mean(component.variance)) for component in fit.components[:2]]
    chosen: list[int] = []
    open_to_choice = np.ones(len(commands), dtype=bool)
    while len(chosen) < count and open_to_choice.any():
        gain = sum(
            (c**2).sum(axis=0) / (np.diag(c) + noise) for c, noise in zip(covariances, noises, strict=True)
        )
        best = int(np.argmax(np.where(open_to_choice, gain, -1.0)))
        chosen.append(best)
        away = inputs - inputs[best]
        away[:, 2] = wrapped(away[:, 2])
        open_to_choice &= (np.abs(away) >= APART).any(axis=1)
        covariances = [
            c - np.outer(c[best], c[best]) / (c[best, best] + noise)
            for c, noise in zip(covariances, noises, strict=True)
        ]
    return np.asarray(commands[chosen])
