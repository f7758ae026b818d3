"""What to measure next: where a fit knows least, and the few measurements that would help it most."""

import numpy as np

from finlab.arrays import Array
from finlab.fit.fin_fit import FinFit
from finlab.layout.angles import wrapped

THIN = 2.0
"""A region is thin where the force is this many times as uncertain as it is on average ..."""
WORTH_SAYING = 0.02
"""... and by more than this share of the largest force."""
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


def thin_regions(fit: FinFit) -> tuple[str, ...]:
    """Returns where measurements are thin, a clause each, the worst first: a corner of amplitudes and
    frequencies in which the force is much less certain than elsewhere."""
    grid = fit.grid((8, 8, 12))
    uncertain = fit.uncertainty(grid).mean(axis=2)
    usual = float(np.sqrt(np.mean(uncertain**2)))
    amplitude, frequency = grid[:, 0, 0, 0], grid[0, :, 0, 1]
    found = []
    for low_a, low_f in ((False, False), (False, True), (True, False), (True, True)):
        corner = uncertain[:3, :] if low_a else uncertain[-3:, :]
        corner = corner[:, :3] if low_f else corner[:, -3:]
        worst = float(corner.mean())
        if worst > max(THIN * usual, WORTH_SAYING):
            a = f"below {amplitude[2]:.2f}" if low_a else f"above {amplitude[-3]:.2f}"
            f = f"below {frequency[2]:.2f}" if low_f else f"above {frequency[-3]:.2f}"
            found.append((worst, f"amplitudes {a} rad with frequencies {f} Hz (uncertain by {worst:.0%})"))
    return tuple(clause for _, clause in sorted(found, reverse=True))
