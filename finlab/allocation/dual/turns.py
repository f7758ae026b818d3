"""Answers where actuators act on each other, in turns: the dual of the model made linear at the last answer.

With y the forces and o(y) what the actuators do to each other, a turn takes o(y) for its value and slope at
the last forces. Its answer is exact and cheapest on that linear model, so that where the turns settle, the
gradient of the power lies in the range of the slope of the whole model: the conditions of Karush, Kuhn and
Tucker hold there (sequential convex programming).
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.physics.plant import Plant

TURNS, HALVINGS, ASIDE, WORTH_TRYING = 12, 4, 0.38, 1.005
"""Most turns of an answer."""
SETTLED = 1e-3
"""Gain of a turn, as a share of the power, below which an answer has settled."""


class Linear(NamedTuple):
    """A model made linear at some forces."""

    beside: Array
    """Wrench (6,) [N, N m] that comes on top of what the forces give."""
    effectiveness: Array
    """Wrench (n, 3, 6) per newton along own axes."""


def linear_at(plant: Plant, force: Array) -> Linear:
    """Returns the model of a plant near forces (n, 3) [N] in own axes."""
    offset, effectiveness = plant.effect(force)
    change = effectiveness - plant.effectiveness
    return Linear(offset - np.einsum("na,naw->w", force, change), effectiveness)


class Turn(NamedTuple):
    """An answer on a linear model."""

    force: Array
    """Forces (k, 1) [N] of the dual."""
    price: Array
    """Price (6,) of the wrench [W/N, W/(N m)]."""
    worth: float
    """What an error as large as the yardstick is worth at its prices [W]."""
    answer: Any
    command: Any = None
    """The command (1, n, 3) at which turns settled."""


def in_turns(
    begin: Array,
    price: Array,
    exact: Callable[[Array], Array],
    directions: Callable[[Array], Array],
    answer: Callable[[Linear, Array], Turn],
    plant: Plant,
    error: Callable[[Array], float],
) -> Turn:
    """Returns the answer at which turns settle.

    Args:
        begin: forces (k, 1) [N] of the dual to begin at.
        price: that of the wrench (6,) there.
        exact: gives commands (1, n, 3) near to such forces that give the wrench, nearly.
        directions: gives such forces of forces (n, 3) in own axes.
        answer: answers a linear model, from a price on.
        plant: of the robot.
        error: gives the error of a command (1, n, 3) on the yardstick.
    """
    worth, best, merit = 0.0, None, np.inf
    command = exact(begin)
    for turn in range(TURNS):
        force = plant.force(command)
        result = answer(linear_at(plant, force[0]), price)
        worth, price = max(worth, 2.0 * result.worth), result.price
        if best is None:
            best, merit = result, power(plant, command) + worth * error(command)
        here, size = directions(force[0]), 1.0
        step = result.force - here
        for _ in range(HALVINGS):
            tried = exact(here + size * step)
            new = power(plant, tried) + worth * error(tried)
            if new < merit:
                break
            size *= 0.3
        else:
            break
        gain, merit, command, best = merit - new, new, tried, result
        if gain <= SETTLED * merit:
            break
    return best._replace(command=command)


def turned_aside(force: Array, lines: int, planes: int) -> list[Array]:
    """Returns other forces (k, 1) to begin at: those of planes turned one way, the other way, and by turns. A
    jet that meets a neighbor in a symmetric robot has no slope that would turn it aside."""
    first, second = force[lines : lines + planes], force[lines + planes : lines + 2 * planes]
    signs = (1.0, -1.0, (-1.0) ** np.arange(planes)[:, None])
    turned = []
    for sign in signs[: 3 if planes > 1 else 2]:
        c, s = np.cos(ASIDE), sign * np.sin(ASIDE)
        other = force.copy()
        other[lines : lines + planes], other[lines + planes : lines + 2 * planes] = (
            c * first - s * second,
            s * first + c * second,
        )
        turned.append(other)
    return turned


def power(plant: Plant, command: Array) -> float:
    return float(plant.power(command).sum())
