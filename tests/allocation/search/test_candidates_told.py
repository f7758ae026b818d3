"""What is told of candidates: each number is the plant's own, whatever was kept least."""

from typing import Any

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.allocation.search.refined_candidates import _turned_at_rest
from finlab.allocation.search.search_allocator import SearchAllocator
from finlab.assets import shipped_layouts
from finlab.layout import load_layout
from finlab.physics import Plant
from finlab.physics.energy import command_energy

TARGET = np.array([1.0, 0.5, 2.0, 0.0, 0.1, 0.1])
OBJECTIVES: list[dict[str, Any]] = [
    {"objective": "power"},
    {"objective": "effort"},
    {"objective": "effort", "energy_tradeoff": 1e-2},
]


@pytest.mark.parametrize("options", OBJECTIVES)
def test_candidates_tell_what_the_plant_says_of_them(options: dict[str, Any]) -> None:
    method, layout = load_allocator(**options), load_layout("penta")
    told, plant = method.allocate(layout, TARGET).candidates, Plant(layout)
    assert told is not None
    np.testing.assert_allclose(told.wrench, plant.wrench(told.command), atol=1e-9)
    error = np.linalg.norm((told.wrench - TARGET) / method.normalization.std, axis=-1)
    np.testing.assert_allclose(told.err_norm, error, atol=1e-9)
    np.testing.assert_allclose(told.energy, command_energy(told.command, plant.upper), rtol=1e-9)
    np.testing.assert_allclose(told.power, plant.power(told.command).sum(-1), rtol=1e-9)


def test_what_is_traded_comes_by_the_weighted_sum() -> None:
    """The first is the one of least error squared plus weighted effort, with or without a past."""
    weight, layout = 0.1, load_layout("penta")
    method = load_allocator(objective="effort", energy_tradeoff=weight, n_refined=8)
    several, previous = 0, np.full((5, 3), np.nan)
    for share, before in ((1.0, None), (0.8, None), (1.2, None), (1.0, previous)):
        answer = method.allocate(layout, share * TARGET, previous=before)
        told = answer.candidates
        assert told is not None
        total = told.err_norm**2 + weight * told.energy
        assert (np.diff(total) >= -1e-12).all()
        several += int(np.ptp(total) > 1e-3)
        np.testing.assert_array_equal(answer.command, told.command[0])
    assert several > 0


def test_only_fins_at_rest_are_turned_at_random(search: SearchAllocator) -> None:
    prepared = search.pipeline.prepare(load_layout(shipped_layouts()["penta"]))
    plant = prepared.plant
    command = np.tile(plant.upper, (2, 1, 1))
    command[..., 2] = 0.4
    command[0, [1, 3], :2] = command[1, 2, :2] = plant.lower[1, :2]
    force = np.linalg.norm(plant.force(command)[..., 1:], axis=-1)
    rests = force <= 1e-2 * prepared.planar.fins.maximum
    assert rests.sum() == 3
    starts = _turned_at_rest(prepared, command, 6)
    assert starts.shape == (2, 6, 5, 3)
    np.testing.assert_array_equal(starts[..., :2], np.repeat(command[:, None, :, :2], 6, axis=1))
    turned = starts[..., 2] != 0.4
    np.testing.assert_array_equal(turned, np.repeat(rests[:, None], 6, axis=1))
    drawn = plant.sample(np.random.default_rng(0), (6,))[..., 2]
    np.testing.assert_array_equal(starts[0][:, [1, 3], 2], drawn[:, [1, 3]])
