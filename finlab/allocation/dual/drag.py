"""Commands of robots with drag: what the dual leaves to their own laws.

The dual takes a foil for all between its curve of lift and drag and the chord of it. From the forces that are
cheapest there, Levenberg-Marquardt steps mostly lead to commands that give the wrench; where they do not,
other starts are tried.
"""

from typing import NamedTuple

import numpy as np

from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.arrays import Array
from finlab.physics.plant import Plant
from finlab.precision import CLOSE, NEARLY, NOTHING, ROUNDS


class Cost(NamedTuple):
    """What is kept least: power, and what the doubt about forces costs."""

    plant: Plant
    weight: Array
    """What a squared force (n,) costs [W/N^2]."""

    def of(self, command: Array) -> Array:
        """Returns the costs (R,) [W] of commands (R, n, 3)."""
        cost: Array = self.plant.power(command).sum(axis=-1)
        if self.weight.any():
            cost = cost + (self.plant.force(command) ** 2).sum(axis=-1) @ self.weight
        return cost

    def slope(self, command: Array) -> Array:
        """Returns their derivatives (R, n, 3)."""
        slope = self.plant.power_gradient(command)
        if self.weight.any():
            force, jacobian = self.plant.force_and_jacobian(command)
            slope = slope + 2.0 * self.weight[:, None] * (jacobian @ force[..., None])[..., 0]
        return slope


class Priced(NamedTuple):
    """A command that gives a wrench."""

    command: Array
    """The command (n, 3)."""
    cost: float
    """Its cost [W]."""
    place: int
    """From which of some starts it comes."""


def exact_command(
    problem: CommandProblem, cost: Cost, wrench: Array, starts: Array, enough: float
) -> Priced | None:
    """Returns what gives a normalized wrench (6,), from starts (R, n, 3) to an error of `enough`: the first
    that is hardly dearer than the cheapest; None where there is none."""
    found = refine(problem, wrench[None], starts, 2 * ROUNDS, enough)
    met = np.flatnonzero(found.error <= NEARLY)
    if not len(met):
        return None
    costs = cost.of(found.command[met])
    cheap = int(np.argmax(costs <= (1.0 + CLOSE) * costs.min()))
    return Priced(found.command[met[cheap]], float(costs[cheap]), int(met[cheap]))


def prices_at(problem: CommandProblem, cost: Cost, command: Array, directions: Array) -> Array:
    """Returns the prices (r, 1) of normalized `directions` (6, r) at which a command (n, 3) would be the
    cheapest for what it gives: what a change of it adds to the wrench is worth the power that it adds,
    nearly."""
    jacobian = problem.forces.force_and_jacobian(command[None])[1][0] @ problem.effectiveness
    low, high = problem.edges
    free = (command > low) & (command < high)
    width = problem.width[free]
    rows = width[:, None] * (jacobian[free] @ directions)
    prices: Array = np.linalg.lstsq(rows, width * cost.slope(command[None])[0][free], rcond=NOTHING)[0]
    return prices[:, None]


def cheapened(
    problem: CommandProblem, cost: Cost, wrench: Array, starts: Array, enough: float
) -> Priced | None:
    """Returns what gives a normalized wrench (6,) at least cost near to the cheapest of some commands (R, n,
    3); None where steps from none of these give it.

    Each step follows the power's slope along what gives the same wrench (sequential quadratic programming,
    with the size of the curvature). The first start, near to giving the wrench, takes such a step at once.
    """
    step, gain = _cheaper_step(problem, cost, starts[0])
    best = exact_command(problem, cost, wrench, np.concatenate([starts[:1] + step, starts[1:]]), enough)
    if best is not None and best.place == 0 and gain <= 10.0 * CLOSE * best.cost:
        return best
    best, size = best or exact_command(problem, cost, wrench, starts[:1], enough), 1.0
    for _ in range(ROUNDS if best is not None else 0):
        assert best is not None
        step = size * _cheaper_step(problem, cost, best.command)[0]
        found = exact_command(problem, cost, wrench, (best.command + step)[None], enough)
        gain = -np.inf if found is None else best.cost - found.cost
        if found is not None and gain > 0.0:
            best = found
        else:
            size *= 0.25
        if abs(gain) <= 10.0 * CLOSE * best.cost:
            break
    return best


def _cheaper_step(problem: CommandProblem, cost: Cost, command: Array) -> tuple[Array, float]:
    """A step (n, 3) of a command along which the wrench stays, and by how much the power would fall [W]."""
    width = np.maximum(problem.width, NOTHING)
    tried = command + np.concatenate([np.zeros((1, 1, 3)), NEARLY * np.eye(3)[:, None]]) * width
    jacobian = width[:, :, None] * (problem.forces.force_and_jacobian(tried)[1] @ problem.effectiveness)
    slope = width * cost.slope(tried)
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
