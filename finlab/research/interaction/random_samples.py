"""Samples of random robots whose jets meet, with the wrenches that an oracle says they cause.

What `finlab train interaction` learns from, and what the experiment `interaction` is scored on.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.fit.interaction.samples import Samples
from finlab.interaction.jets import Jets
from finlab.layout.layout import Layout
from finlab.physics.plant import Plant
from finlab.research.random_layouts import random_jet_robot

JETS = Jets()
"""The constants of the formula of jets that are shipped."""

WrenchOracle = Callable[[Layout, Array], Array]
"""Gives the wrenches (K, 6) [N, N m] of commands (K, n, 3) of a robot, such as a CFD code does."""


def with_jets(layout: Layout, command: Array, jets: Jets = JETS) -> Array:
    """Returns wrenches (K, 6) [N, N m] by the formula of jets; a `WrenchOracle`.

    Args:
        layout: the robot.
        command: (K, n, 3).
        jets: the formula's constants.
    """
    return Plant(replace(layout, interaction=jets)).wrench(command)


def random_samples(
    oracle: WrenchOracle,
    layouts: int,
    commands: int,
    seed: int,
    noise: float,
    count: tuple[int, int],
) -> list[Samples]:
    """Returns samples of random robots; they depend on the seed and their number alone.

    Args:
        oracle: gives the wrenches.
        layouts: number of robots.
        commands: number of uniform commands of each.
        seed: of all draws.
        noise: normal noise of the wrenches, as a share of each axis' root mean square.
        count: least and most actuators of a robot.

    Raises:
        DataError: the oracle gives wrenches of another shape.
    """
    result = []
    for k in range(layouts):
        rng = np.random.default_rng([31_000, seed, k])
        layout = random_jet_robot(rng, f"robot_{k + 1}", count)
        command = Plant(layout).sample(rng, (commands,))
        wrench = np.asarray(oracle(layout, command), np.float64)
        if wrench.shape != (commands, 6):
            raise DataError(
                f"the plant gave an array of shape {wrench.shape}, expected ({commands}, 6)"
            )
        size = np.sqrt((wrench**2).mean(axis=0))
        noisy = wrench + noise * size * rng.normal(size=wrench.shape)
        result.append(Samples(layout, command, noisy))
    return result
