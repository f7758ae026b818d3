"""Targets that the first search does not reach: hard ones are found, and those out of reach cost little."""

import numpy as np
import pytest

from finlab.layout import Fin, Layout, Limits
from finlab.physics import Plant
from finlab.physics.objective import Name
from tests.any_robot import AnyRobot
from tests.exhaustive import crossed


def with_arcs(seed: int) -> tuple[Layout, np.ndarray]:
    """A robot whose fins have arcs of any width, 12 wrenches within its reach and 12 mostly out of it."""
    rng = np.random.default_rng(seed)
    fins = []
    for i in range(int(rng.integers(2, 9))):
        first, width = rng.uniform(-3, 2.5), rng.uniform(0.2, 6)
        position = rng.uniform(-1, 1, 3) * [0.3, 0.3, 0.1]
        x, y, z = (float(value) for value in position)
        angle = float(rng.uniform(-3, 3))
        amplitude, frequency = float(rng.choice([0.05, 0.3])), float(rng.choice([0.1, 1.5]))
        limits = Limits((amplitude, 0.6), (frequency, 2.1), (float(first), float(min(first + width, 3.14))))
        fins.append(Fin(f"f{i}", (x, y, z), angle, limits))
    layout = Layout("arcs", tuple(fins))
    plant = Plant(layout)
    wrench = plant.wrench(plant.sample(rng, (24,)))
    return layout, np.concatenate([wrench[:12], 2.5 * wrench[12:]])


@pytest.mark.parametrize(
    ("seed", "objective"),
    crossed(range(5060, 5100, 3), ["power", "effort"], every=9),
)
def test_what_is_within_reach_is_found(objective: Name, seed: int) -> None:
    method = AnyRobot(objective=objective)
    layout, targets = with_arcs(seed)
    assert method.allocate_batch(layout, targets[:12]).err_norm.max() < 1e-5


@pytest.mark.parametrize(("seed", "target", "least"), [(5065, 14, 2.367)])
def test_enough_fresh_starts_find_what_fins_with_arcs_can_do(
    search: AnyRobot, seed: int, target: int, least: float
) -> None:
    layout, targets = with_arcs(seed)
    assert search.allocate_batch(layout, targets).err_norm[target] < 1.001 * least
