"""Commands of robots with foils by enumeration: what a dense grid of some deflections, and
Newton's method for all else, find of least power. It shares nothing with the core."""

from itertools import product

import numpy as np

from finlab.arrays import Array
from finlab.physics.plant import Plant

NEWTON_STEPS = 12
"""Of Newton's method for what is not enumerated."""
ZOOMS = 3
"""Times that the grid is laid anew around the cheapest command."""
ZOOM = 0.15
"""Width of such a grid over that of the one before."""
MISS = 1e-7
"""Scaled wrench by which commands may miss the target."""
STARTS_OF_EACH = 2
"""Starts of each command that Newton's method finds."""


def least_power(
    plant: Plant, scale: Array, wrench: Array, enumerated: list[int], points: int
) -> float:
    """Returns the least power [W] of commands that give a wrench; infinity where there is none.

    Args:
        plant: of thrusters and foils, in its flow; the number of those that are not enumerated is
            that of the axes that count.
        scale: wrench scale (6,).
        wrench: desired (6,) [N, N m].
        enumerated: foils whose deflections are on the grid.
        points: of each of these.
    """
    low = plant.lower[enumerated, 0]
    high = plant.upper[enumerated, 0]
    solved = [i for i in range(plant.n) if i not in enumerated]
    least = np.inf
    middle = 0.5 * (low + high)
    width = high - low
    for zoom in range(ZOOMS + 1):
        edges = zip(middle - width / 2, middle + width / 2, low, high, strict=True)
        axes = [np.linspace(max(a, c), min(b, d), points) for a, b, c, d in edges]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(enumerated))
        command = commands_on_grid(plant, scale, wrench, enumerated, solved, grid)
        if len(command) == 0:
            break
        power = plant.power(command).sum(axis=-1)
        best = int(power.argmin())
        least = min(least, float(power[best]))
        middle = command[best, enumerated, 0]
        width = width * ZOOM
        if zoom == 0:
            points = max(9, points // 3)
    return least


def commands_on_grid(
    plant: Plant, scale: Array, wrench: Array, enumerated: list[int], solved: list[int], grid: Array
) -> Array:
    """Returns commands (K, n, 3) that give a wrench, with the deflections of a grid (N, k)."""
    counts = plant.counts
    shares = np.linspace(0.1, 0.9, STARTS_OF_EACH)
    starts = np.array(list(product(shares, repeat=len(solved) - 1)))
    command = np.broadcast_to(plant.lower, (len(grid), len(starts), plant.n, 3)).copy()
    command[:, :, enumerated, 0] = grid[:, None]
    foils = solved[1:]
    command[:, :, foils, 0] = plant.lower[foils, 0] + starts * plant.width[foils, 0]
    command[:, :, solved[0], 0] = 0.0  # the thruster
    command = command.reshape(-1, plant.n, 3)
    for _ in range(NEWTON_STEPS):
        given, jacobian = plant.linearize(command)
        miss = ((wrench - given) / scale)[:, counts]
        by_number = jacobian.reshape(len(command), 6, plant.n, 3)[:, counts][:, :, solved, 0]
        by_number = by_number / scale[counts][:, None]
        normal = np.swapaxes(by_number, 1, 2) @ by_number
        trace = np.trace(normal, axis1=1, axis2=2)
        normal += (1e-12 * trace + 1e-300)[:, None, None] * np.eye(len(solved))
        step = np.linalg.solve(normal, np.swapaxes(by_number, 1, 2) @ miss[..., None])[..., 0]
        limit = 0.3 * plant.width[solved, 0]
        numbers = command[:, solved, 0] + np.clip(step, -limit, limit)
        command[:, solved, 0] = np.clip(numbers, plant.lower[solved, 0], plant.upper[solved, 0])
    missed = np.linalg.norm(((plant.wrench(command) - wrench) / scale)[:, counts], axis=-1)
    return np.asarray(command[missed <= MISS])
