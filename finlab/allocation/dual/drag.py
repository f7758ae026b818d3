"""Search in commands, for robots with drag above all: what the dual leaves to their own laws.

The dual takes a foil for all between its curve of lift and drag and the chord of it. From the forces that are
cheapest there, Levenberg-Marquardt steps mostly lead to commands that give the wrench; where they do not,
other starts are tried.
"""

from typing import NamedTuple

import numpy as np

from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.arrays import Array
from finlab.precision import CLOSE, NEARLY, NOTHING, ROUNDS

EXACT = 1e-8
"""Error, on the robot's yardstick, up to which commands need no further step."""


class Priced(NamedTuple):
    """A command that gives a wrench."""

    command: Array
    """The command (n, 3)."""
    cost: float
    """Its cost [W]."""
    place: int
    """From which of some starts it comes."""


class Search(NamedTuple):
    """Commands of a robot that give a wrench at least cost: power, and what the doubt about forces costs."""

    problem: CommandProblem
    """The robot, by its own laws."""
    weight: Array
    """What a squared force (n,) costs [W/N^2]."""

    def cost(self, command: Array) -> Array:
        """Returns the costs (R,) [W] of commands (R, n, 3)."""
        plant = self.problem.forces
        cost: Array = plant.power(command).sum(axis=-1)
        return cost + (plant.force(command) ** 2).sum(axis=-1) @ self.weight if self.weight.any() else cost

    def slope(self, command: Array) -> Array:
        """Returns their derivatives (R, n, 3)."""
        plant = self.problem.forces
        slope: Array = plant.power_gradient(command)
        if self.weight.any():
            force, jacobian = plant.force_and_jacobian(command)
            slope = slope + 2.0 * self.weight[:, None] * (jacobian @ force[..., None])[..., 0]
        return slope

    def exact(self, wrench: Array, starts: Array) -> Priced | None:
        """Returns what gives a normalized wrench (6,), from starts (R, n, 3): the first that is hardly dearer
        than the cheapest; None where there is none."""
        ends = refine(self.problem, wrench[None], starts, 2 * ROUNDS, EXACT)
        met = np.flatnonzero(ends.error <= NEARLY)
        if not len(met):
            return None
        costs = self.cost(ends.command[met])
        cheap = int(np.argmax(costs <= (1.0 + CLOSE) * costs.min()))
        return Priced(ends.command[met[cheap]], float(costs[cheap]), int(met[cheap]))

    def prices(self, command: Array, directions: Array) -> Array:
        """Returns the prices (r,) of normalized `directions` (6, r) at which a command (n, 3) is the
        cheapest, nearly: what a change of it adds to the wrench is worth the power that it adds."""
        problem = self.problem
        jacobian = problem.slope(command[None])[1][0]
        low, high = problem.edges
        free = (command > low) & (command < high)
        width = problem.width[free]
        rows, cost = (
            width[:, None] * (jacobian[free] @ directions),
            width * self.slope(command[None])[0][free],
        )
        return np.asarray(np.linalg.lstsq(rows, cost, rcond=NOTHING)[0])

    def cheapest(self, wrench: Array, starts: Array) -> Priced | None:
        """Returns what gives a normalized wrench (6,) at least cost near to the cheapest of some commands
        (R, n, 3); None where steps from none of these give it.

        Each step follows the power's slope along what gives the same wrench (sequential quadratic
        programming, with the size of the curvature). The first start, near to it, takes such a step at once.
        """
        step, gain = self._cheaper_step(starts[0])
        best = self.exact(wrench, np.concatenate([starts[:1] + step, starts[1:]]))
        if best is not None and best.place == 0 and gain <= 10.0 * CLOSE * best.cost:
            return best
        best, size = best or self.exact(wrench, starts[:1]), 1.0
        for _ in range(ROUNDS if best is not None else 0):
            assert best is not None
            trial = self.exact(wrench, (best.command + size * self._cheaper_step(best.command)[0])[None])
            gain = -np.inf if trial is None else best.cost - trial.cost
            if trial is not None and gain > 0.0:
                best = trial
            else:
                size *= 0.25
            if abs(gain) <= 10.0 * CLOSE * best.cost:
                break
        return best

    def _cheaper_step(self, command: Array) -> tuple[Array, float]:
        """A step (n, 3) of a command along which the wrench stays, and how much the power would fall [W]."""
        problem = self.problem
        width = np.maximum(problem.width, NOTHING)
        tried = command + np.concatenate([np.zeros((1, 1, 3)), NEARLY * np.eye(3)[:, None]]) * width
        jacobian = width[:, :, None] * problem.slope(tried)[1]
        slope = width * self.slope(tried)
        low, high = problem.edges
        free = (command > low) & (command < high)
        price = np.linalg.lstsq(jacobian[0][free], slope[0][free], rcond=NOTHING)[0]
        left = slope - jacobian @ price
        free |= np.where(command <= low, left[0] < 0.0, left[0] > 0.0) & (problem.width > 0.0)
        bend = np.abs(np.stack([left[k + 1, :, k] - left[0, :, k] for k in range(3)], axis=-1)) / NEARLY
        bend = np.maximum(bend, CLOSE * bend.max() + 1e-300)[free]
        rows, left = jacobian[0][free], left[0][free]
        held = np.linalg.lstsq(rows.T @ (rows / bend[:, None]), rows.T @ (left / bend), rcond=NOTHING)[0]
        step = np.zeros(command.shape)
        step[free] = own = np.clip(-(left - rows @ held) / bend, -0.25, 0.25)
        return step * width, float(-(left + 0.5 * bend * own) @ own)
