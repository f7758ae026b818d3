"""Commands of robots with foils by enumeration: what a dense grid of some deflections, and
Newton's method for all else, find of least power; beyond reach, what a grid of all commands and
SciPy's steps from its best points come to. It shares nothing with the core."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.optimize import minimize

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
POLISHED = 12
"""Points of a grid of all commands from which steps go on."""
LOOKED_AT = 400
"""Best points of a grid among which these are."""
APART = 0.15
"""Share of the limits by which these are apart in a command at least."""


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


@dataclass(frozen=True)
class Reach:
    """What thrusters and foils, one number each, give in some axes, beside a grid of them all."""

    plant: Plant
    """In its flow."""
    scale: Array
    """Wrench scale (6,)."""
    axes: Array
    """Which axes (6,) of a wrench count."""
    points: int
    """Of each command on the grid."""

    @cached_property
    def grid(self) -> Array:
        """Commands (N, n) as shares of their limits."""
        shares = np.linspace(0.0, 1.0, self.points)
        columns = np.meshgrid(*[shares] * self.plant.n, indexing="ij")
        return np.stack(columns, axis=-1).reshape(-1, self.plant.n)

    @cached_property
    def given(self) -> Array:
        """Wrenches (N, k) of the grid, over the scale."""
        return self.wrench_of(self.grid)

    def command_of(self, share: Array) -> Array:
        """Commands (..., n, 3) of shares (..., n) of their limits."""
        command = np.zeros((*share.shape, 3))
        command[..., 0] = self.plant.lower[:, 0] + share * self.plant.width[:, 0]
        return command

    def wrench_of(self, share: Array) -> Array:
        """Wrenches (..., k) of shares (..., n), over the scale."""
        return np.asarray((self.plant.wrench(self.command_of(share)) / self.scale)[..., self.axes])

    def slope_of(self, share: Array) -> Array:
        """The derivative (k, n) of the wrench by the shares (n,)."""
        _, jacobian = self.plant.linearize(self.command_of(share))
        by_number = jacobian.reshape(6, self.plant.n, 3)[self.axes, :, 0]
        return np.asarray(by_number * self.plant.width[:, 0] / self.scale[self.axes, None])

    def starts(self, badness: Array) -> list[Array]:
        """Shares (n,) of the best points of the grid that are apart from each other."""
        picked: list[Array] = []
        for k in np.argsort(badness)[:LOOKED_AT]:
            share = self.grid[k]
            if all(np.abs(share - other).max() > APART for other in picked):
                picked.append(share)
            if len(picked) == POLISHED:
                break
        return picked

    def least_distance(self, target: Array) -> float:
        """Returns the least distance from a target (k,), over the scale."""

        def squared(share: Array) -> tuple[float, Array]:
            residual = self.wrench_of(share) - target
            return 0.5 * float(residual @ residual), self.slope_of(share).T @ residual

        distance = np.linalg.norm(self.given - target, axis=1)
        least = float(distance.min())
        for start in self.starts(distance):
            end = minimize(
                squared,
                start,
                jac=True,
                method="L-BFGS-B",
                bounds=[(0.0, 1.0)] * self.plant.n,
                options={"maxiter": 200, "ftol": 1e-15, "gtol": 1e-12},
            )
            least = min(least, float(np.sqrt(2.0 * end.fun)))
        return least

    def largest_share(self, target: Array) -> float:
        """Returns the largest share of a target (k,) that is found along its ray."""
        size = float(np.linalg.norm(target))
        unit = target / size

        def beside(numbers: Array) -> Array:
            return np.asarray((self.wrench_of(numbers[:-1]) - numbers[-1] * target) / size)

        def beside_slope(numbers: Array) -> Array:
            slope = self.slope_of(numbers[:-1])
            return np.column_stack([slope, -target]) / size

        along = self.given @ unit
        across = np.linalg.norm(self.given - along[:, None] * unit, axis=1)
        largest = 0.0
        for start in self.starts(across - along):
            end = minimize(
                lambda numbers: -numbers[-1],
                np.append(start, np.clip(self.wrench_of(start) @ unit / size, 0.0, 1.0)),
                jac=lambda numbers: -np.eye(len(numbers))[-1],
                method="SLSQP",
                bounds=[(0.0, 1.0)] * (self.plant.n + 1),
                constraints={"type": "eq", "fun": beside, "jac": beside_slope},
                options={"maxiter": 100, "ftol": 1e-10},
            )
            if np.linalg.norm(beside(end.x)) <= MISS:
                largest = max(largest, float(end.x[-1]))
        return largest
