"""Better prices for a bound, where those of an answer stand for other forces than the laws give.

The dual of commands drawn around the answer, its maxima smoothed, is climbed by Newton's method
while the smoothing fades. Any prices prove a bound, so that the draw decides how high it is and not
whether it holds.
"""

import numpy as np

from finlab.arrays import CLOSE, NOTHING, ROUNDS, Array
from finlab.physics.plant import Plant

DRAWN = 800
"""Commands of each actuator."""
HEATS = np.geomspace(0.3, 0.003, 14)
"""Smoothing, as a share of the mean power of an actuator."""


def raised_price(plant: Plant, scale: Array, wrench: Array, price: Array, command: Array) -> Array:
    """Returns prices (6,) [W/N, W/(N m)] for a wrench (6,) that a command (n, 3) gives, from others
    on, by a plant; errors count on the yardstick `scale` (6,)."""
    low = plant.layout.lower
    high = plant.layout.upper
    draw = np.random.default_rng(0).uniform(-1.0, 1.0, (DRAWN, *command.shape)) * (high - low)
    drawn = (command + np.geomspace(10.0 * CLOSE, 1.0, DRAWN)[:, None, None] * draw).clip(low, high)
    drawn[0] = command
    given = np.einsum("kna,naw->nkw", plant.force(drawn), plant.effectiveness) / scale
    power = plant.power(drawn).T
    target = wrench / scale
    inner = price * scale

    def smoothed(inner: Array, heat: float) -> tuple[float, Array]:
        """The dual's negative [W], and the shares (n, DRAWN) of the commands."""
        worth = (given @ inner - power) / heat
        most = worth.max(axis=1, keepdims=True)
        share = np.exp(worth - most)
        total = share.sum(axis=1, keepdims=True)
        return float(heat * (most + np.log(total)).sum() - target @ inner), share / total

    ridge = 10.0 * CLOSE
    for heat in HEATS * power[:, 0].mean():
        value, share = smoothed(inner, heat)
        mean = np.einsum("nk,nkw->nw", share, given)
        hessian = ((given * share[..., None]).swapaxes(1, 2) @ given).sum(axis=0) - mean.T @ mean
        for _ in range(ROUNDS):
            damped = hessian + (ridge * np.trace(hessian) + NOTHING) * np.eye(6)
            step = heat * np.linalg.solve(damped, target - mean.sum(axis=0))
            if smoothed(inner + step, heat)[0] <= value:
                inner = inner + step
                ridge = 0.1 * ridge
                break
            ridge *= 10.0
    return inner / scale
