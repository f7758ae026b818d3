"""Raised multipliers prove nearly as much as drawn commands allow: beside a linear program over
their mixtures."""

import numpy as np
import pytest
from scipy.optimize import linprog

from finlab.allocation import Allocator
from finlab.allocation.dual.multiplier_ascent import raised_multipliers
from finlab.arrays import Array
from finlab.layout import load_layout
from finlab.physics import Plant

N_COMMANDS = 400
"""How many random commands bound from above what multipliers can prove."""


def commands_around(plant: Plant, command: Array, rng: np.random.Generator) -> Array:
    """Commands (DRAWN, n, 3) near a command and anywhere within the limits."""
    low = plant.layout.lower
    high = plant.layout.upper
    spread = np.geomspace(1e-3, 1.0, N_COMMANDS)[:, None, None] * rng.uniform(
        -1.0, 1.0, (N_COMMANDS, *command.shape)
    )
    commands = np.clip(command + spread * (high - low), low, high)
    commands[0] = command
    return np.asarray(commands)


def proved(price: Array, wrench: Array, given: Array, power: Array) -> float:
    """What prices (6,) prove of forces' wrenches (n, K, 6) and power (n, K): the dual value [W]."""
    return float(price @ wrench - (given @ price - power).max(axis=1).sum())


def least_of_mixtures(wrench: Array, given: Array, power: Array, scale: Array) -> float:
    """Least power of mixtures of each actuator's commands that give a wrench."""
    n, count = power.shape
    ones = np.kron(np.eye(n), np.ones(count))
    wrenches = given.reshape(n * count, 6).T / scale[:, None]
    rows = np.concatenate([wrenches, ones])
    right = np.concatenate([wrench / scale, np.ones(n)])
    optimum = linprog(power.ravel(), A_eq=rows, b_eq=right, bounds=(0.0, None))
    assert optimum.success
    return float(optimum.fun)


@pytest.mark.parametrize("name", ["A", "bluerov2_heavy"])
@pytest.mark.parametrize("off", [0.8, 1.0, 1.3])
def test_prices_are_raised_to_what_mixtures_of_commands_take(name: str, off: float) -> None:
    layout = load_layout(name)
    plant = Plant(layout)
    rng = np.random.default_rng(1)
    target = 0.5 * plant.wrench(plant.sample(rng, (1,))[0])
    answer = Allocator(layout).allocate(target)
    assert answer.reachable and answer.multipliers is not None
    begun = off * answer.multipliers
    raised = raised_multipliers(plant, answer.scale, answer.wrench, begun, answer.command)

    commands = commands_around(plant, answer.command, rng)
    wrenches_of_commands = np.einsum("kna,naw->nkw", plant.force(commands), plant.effectiveness)
    power = plant.power(commands).T
    value = proved(raised, answer.wrench, wrenches_of_commands, power)
    most = least_of_mixtures(answer.wrench, wrenches_of_commands, power, answer.scale)
    # What one draw proves of another: its commands are elsewhere.
    assert value >= proved(begun, answer.wrench, wrenches_of_commands, power) - 0.02 * answer.power
    assert most - 0.03 * answer.power <= value <= most + 1e-6 * answer.power
