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
from finlab.research.interaction.random_plants import random_plant
from finlab.research.random_layouts import log_uniform, random_jet_robot

JETS = Jets()
"""The constants of the formula of jets that are shipped."""

APART = (0.5, 2.0)
"""Factors of the distances of actuators and of the hull of these robots, log-uniform."""
SPEED = 1.2
"""Largest speed through the water of robots that a prior is learned from [m/s]."""
NOISE = 0.02
"""Noise of their wrenches, as a share of each axis' root mean square."""

WrenchOracle = Callable[..., Array]
"""Gives the wrenches (K, 6) [N, N m] of commands (K, n, 3) of a robot, such as a CFD code does; of
one that moves with a third argument, velocities (K, 6) [m/s, rad/s] of the body through the
water."""


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
    speed: float = 0.0,
    apart: float = 1.0,
) -> list[Samples]:
    """Returns samples of random robots; they depend on the seed and their number alone.

    Args:
        oracle: gives the wrenches.
        layouts: number of robots.
        commands: number of uniform commands of each.
        seed: of all draws.
        noise: normal noise of the wrenches, as a share of each axis' root mean square.
        count: least and most actuators of a robot.
        speed: most of the robots through the water [m/s], in any direction and at any speed up to
            it; at rest by default. The oracle is given the flow as well where it is above 0.
        apart: distances of actuators and size of the hull, over those of `random_jet_robot`.

    Raises:
        DataError: the oracle gives wrenches of another shape.
    """
    result = []
    for k in range(layouts):
        rng = np.random.default_rng([31_000, seed, k])
        layout = spread_apart(random_jet_robot(rng, f"robot_{k + 1}", count), apart)
        command = Plant(layout).sample(rng, (commands,))
        flow = None if speed == 0.0 else random_flows(rng, commands, speed)
        given = oracle(layout, command) if flow is None else oracle(layout, command, flow)
        wrench = np.asarray(given, np.float64)
        if wrench.shape != (commands, 6):
            raise DataError(
                f"the plant gave an array of shape {wrench.shape}, expected ({commands}, 6)"
            )
        size = np.sqrt((wrench**2).mean(axis=0))
        noisy = wrench + noise * size * rng.normal(size=wrench.shape)
        result.append(Samples(layout, command, noisy, flow))
    return result


def spread_apart(layout: Layout, factor: float) -> Layout:
    """Returns a robot with so many times the distances and the size of the hull, of the same
    actuators."""
    if factor == 1.0:
        return layout
    assert layout.body is not None and layout.body.hull is not None
    hull = layout.body.hull
    size = tuple(factor * side for side in hull.size_m or ())
    actuators = [
        replace(part, position=tuple(factor * coordinate for coordinate in part.position))
        for part in layout.actuators
    ]
    body = replace(layout.body, hull=replace(hull, size_m=size))
    return replace(layout, actuators=tuple(actuators), body=body)


def random_flows(rng: np.random.Generator, count: int, speed: float) -> Array:
    """Returns velocities (count, 6) [m/s, rad/s] of a body that does not turn: in any direction, at
    speeds that are uniform up to the largest one [m/s]."""
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    linear = speed * rng.uniform(size=(count, 1)) * direction
    return np.concatenate([linear, np.zeros((count, 3))], axis=1)


def samples_of_families(layouts: int, commands: int, seed: int) -> list[Samples]:
    """Returns samples of random robots of 3 to 8 actuators, each with a random plant of its own,
    from half to twice as far apart, a half of the robots at speeds of up to `SPEED`, with noise of
    `NOISE`."""
    result = []
    for k in range(layouts):
        rng = np.random.default_rng([33_000, seed, k])
        plant = random_plant(rng)
        apart = log_uniform(rng, *APART)
        speed = SPEED if k % 2 else 0.0
        number = seed * layouts + k
        result += random_samples(plant, 1, commands, number, NOISE, (3, 8), speed, apart)
    return result
