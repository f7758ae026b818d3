"""Settings belong to an allocator; another one with other settings leaves it as it was."""

from dataclasses import fields
from typing import Any, get_type_hints

import numpy as np
import pytest

from finlab.allocation import METHODS, load_allocator
from finlab.allocation.learned.paper import PaperSettings
from finlab.allocation.learned.settings import LearnedOptions, PaperOptions, Settings
from finlab.assets import shipped_checkpoints, shipped_layouts
from finlab.errors import AllocationError
from finlab.layout import load_layout
from finlab.physics.energy import POWER_WEIGHTS, EnergyWeights

SURGE = [1.0, 0.0, 0.5, 0.0, 0.0, 0.1]
OTHER: dict[str, dict[str, Any]] = {
    "learned": {"n_candidates": 8, "refine_steps": 3, "energy_tradeoff": 0.1},
    "fast": {"energy_tradeoff": 0.1},
    "paper": {"n_candidates": 4, "n_steps": 3},
    "multistart": {"n_candidates": 2, "n_steps": 2, "energy_tradeoff": 0.1},
    "trf": {"n_starts": 1},
    "slsqp": {"n_starts": 1},
    "ipopt": {"n_starts": 1},
    "qp": {"regularization": 10.0},
    "sqp": {"n_steps": 1},
    "analytic": {"rcond": 0.5},
}
SAME_ANSWER = ("analytic", "trf", "slsqp", "ipopt")
"""Methods that may find the same answer with those settings."""

pytestmark = pytest.mark.skipif(
    not {"default", "paper"} <= set(shipped_checkpoints()), reason="no trained checkpoints in the tree"
)


def test_every_method_is_here() -> None:
    assert set(OTHER) == set(METHODS)


@pytest.mark.parametrize("method", METHODS)
def test_other_settings_answer_as_if_loaded_with_them(method: str) -> None:
    layout = load_layout(shipped_layouts()["A"])
    allocator = load_allocator(method)
    before = allocator.allocate(layout, SURGE).command
    other = allocator.with_settings(**OTHER[method])
    command = other.allocate(layout, SURGE).command
    loaded = load_allocator(method, **OTHER[method])
    assert type(other) is type(allocator) and other.options == loaded.options
    np.testing.assert_array_equal(command, loaded.allocate(layout, SURGE).command)
    assert method in SAME_ANSWER or not np.array_equal(command, before)
    np.testing.assert_array_equal(allocator.allocate(layout, SURGE).command, before)


def test_networks_and_layouts_are_shared() -> None:
    allocator = load_allocator()
    assert vars(allocator.with_settings(gamma=1.0))["weights"] is vars(allocator)["weights"]
    spared = allocator.with_settings(energy_weights=POWER_WEIGHTS)
    layout = load_layout(shipped_layouts()["A"])
    expected = load_allocator(energy_weights=POWER_WEIGHTS).allocate(layout, SURGE).command
    np.testing.assert_array_equal(spared.allocate(layout, SURGE).command, expected)


@pytest.mark.parametrize("method", METHODS)
def test_unknown_settings_are_refused(method: str) -> None:
    with pytest.raises(AllocationError, match="knows the options .*, got 'shoe_size'"):
        load_allocator(method).with_settings(shoe_size=43)


def test_impossible_settings_are_refused() -> None:
    allocator = load_allocator()
    with pytest.raises(AllocationError, match="n_candidates=0"):
        allocator.with_settings(n_candidates=0)
    with pytest.raises(AllocationError, match="energy of squares"):
        allocator.with_settings(energy_weights=POWER_WEIGHTS).with_settings(energy_tradeoff=0.1)


def test_editors_complete_the_settings_that_there_are() -> None:
    for options, settings, others in (
        (LearnedOptions, Settings, {"energy_weights": EnergyWeights}),
        (PaperOptions, PaperSettings, {}),
    ):
        kinds = get_type_hints(settings)
        assert get_type_hints(options) == others | {f.name: kinds[f.name] for f in fields(settings)}
    assert list(get_type_hints(LearnedOptions)) == load_allocator("fast").option_names()


@pytest.mark.parametrize("wrong", [{"n_candidates": "5"}, {"temperature": None}, {"energy_weights": 3}])
def test_settings_of_the_wrong_type_are_refused_in_a_sentence(wrong: dict[str, Any]) -> None:
    with pytest.raises(AllocationError, match="'learned': a setting has the wrong type"):
        load_allocator("learned", **wrong)
    with pytest.raises(AllocationError, match="'learned': a setting has the wrong type"):
        load_allocator().with_settings(**wrong)
