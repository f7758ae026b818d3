"""The plant of any kinds of actuator against one that was written apart from it."""

import numpy as np
import pytest

from finlab.physics import Plant
from tests.mixed_robots import KINDS, bluerov2_heavy, load, random_plant, with_dead_bands
from tests.own_plant import OwnPlant


@pytest.mark.parametrize("number", range(3))
@pytest.mark.parametrize("kind", KINDS)
def test_wrench_and_watts_of_random_robots(kind: str, number: int) -> None:
    own, rng = random_plant(kind, number, 5), np.random.default_rng(number)
    plant = Plant(load(own.layout))
    commands = np.stack([own.draw(rng, share) for share in (0.0, 0.1, 0.5, 1.0)])
    wrench = own.wrench(commands)
    np.testing.assert_allclose(plant.wrench(commands, flow=own.flow), wrench, atol=1e-9 * own.scales.max())
    watts = plant.power(commands, flow=own.flow).sum(axis=-1)
    np.testing.assert_allclose(watts, [own.power(each) for each in commands], rtol=1e-9, atol=1e-12)


def test_rudders_at_large_angles_and_astern() -> None:
    own = random_plant("rudders", 0, 5)
    for flow in np.random.default_rng(0).normal(size=(20, 6)):
        turned = OwnPlant(own.layout, flow)
        commands = turned.draw(np.random.default_rng(1))
        expected = turned.wrench(commands)
        given = Plant(load(own.layout)).wrench(commands, flow=flow)
        np.testing.assert_allclose(given, expected, atol=1e-9 * np.abs(expected).max())


def test_dead_bands() -> None:
    rng = np.random.default_rng(0)
    own = OwnPlant(with_dead_bands(bluerov2_heavy(), rng))
    commands = np.zeros((100, 8, 3))
    commands[:, :, 0] = rng.uniform(-1.5, 1.5, (100, 8))
    np.testing.assert_allclose(Plant(load(own.layout)).wrench(commands), own.wrench(commands), atol=1e-9)
