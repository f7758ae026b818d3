"""Samples of random robots whose jets meet, with the wrenches that a plant says they cause."""

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

Judge = Callable[[Layout, Array], Array]
"""Gives the wrenches (K, 6) [N, N m] of commands (K, n, 3) of a robot, such as a CFD code does."""


def with_jets(layout: Layout, command: Array, jets: Jets = JETS) -> Array:
    """Returns wrenches (K, 6) [N, N m] of commands (K, n, 3) by the formula of jets; a `Judge`."""
    return Plant(replace(layout, interaction=jets)).wrench(command)


def drawn(
    judge: Judge, layouts: int, commands: int, seed: int, noise: float, count: tuple[int, int]
) -> list[Samples]:
    """Returns samples of random robots of `count` actuators, least to most: uniform commands, and
    wrenches with normal noise, a share of each axis' root mean square. They depend on the seed and
    the number alone. Raises DataError: the judge gives wrenches of another shape."""
    result = []
    for k in range(layouts):
        rng = np.random.default_rng([31_000, seed, k])
        layout = random_jet_robot(rng, f"robot_{k + 1}", count)
        command = Plant(layout).sample(rng, (commands,))
        wrench = np.asarray(judge(layout, command), np.float64)
        if wrench.shape != (commands, 6):
            raise DataError(
                f"the plant gave an array of shape {wrench.shape}, expected ({commands}, 6)"
            )
        size = np.sqrt((wrench**2).mean(axis=0))
        result.append(
            Samples(layout, command, wrench + noise * size * rng.normal(size=wrench.shape))
        )
    return result
