"""Settings belong to an allocator; another one with other settings leaves it as it was."""

from dataclasses import fields
from typing import Any, get_type_hints

import numpy as np
import pytest

from finlab.allocation import METHODS, load_allocator
from finlab.allocation.learned.paper import PaperSettings
from finlab.allocation.learned.settings import MdnOptions, MdnSettings, PaperOptions
from finlab.allocation.search.settings import SearchOptions, Settings
from finlab.assets import shipped_checkpoints, shipped_layouts
from finlab.errors import AllocationError
from finlab.layout import load_layout
from finlab.physics.energy import EnergyWeights
from finlab.physics.objective import Name

SURGE = [1.0, 0.0, 0.5, 0.0, 0.0, 0.1]
OTHER: dict[str, dict[str, Any]] = {
    "search": {"objective": "effort", "n_refined": 2, "refine_steps": 3},
    "mdn": {"objective": "effort", "n_refined": 2},
    "paper": {"n_candidates": 4, "n_steps": 3},
    "ipopt": {"n_starts": 1},
    "qp": {"regularization": 10.0},
    "sqp": {"objective": "effort", "n_steps": 1},
    "analytic": {"rcond": 0.5},
}
SAME_ANSWER = ("analytic", "ipopt")
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
    network = load_allocator("mdn")
    assert vars(network.with_settings(n_refined=1))["weights"] is vars(network)["weights"]
    layout, allocator = load_layout("A"), load_allocator()
    fewer = allocator.with_settings(n_refined=1)
    assert fewer.pipeline.prepare(layout) is allocator.pipeline.prepare(layout)
    weights = EnergyWeights(1.0, 0.5, 0.0, 0.0, 0.25)
    other = allocator.with_settings(objective="effort", energy_weights=weights)
    expected = load_allocator(objective="effort", energy_weights=weights).allocate(layout, SURGE)
    assert other.allocate(layout, SURGE) == expected
    assert not np.array_equal(
        expected.command, allocator.with_settings(objective="effort").allocate(layout, SURGE).command
    )


@pytest.mark.parametrize("method", METHODS)
def test_unknown_settings_are_refused(method: str) -> None:
    with pytest.raises(AllocationError, match="knows the options .*, got 'shoe_size'"):
        load_allocator(method).with_settings(shoe_size=43)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"n_refined": 0}, "n_refined=0"),
        ({"search_steps": 0}, "search_steps=0"),
        ({"refine_steps": -1}, "refine_steps=-1"),
        ({"objective": "speed"}, "objective: expected 'power' or 'effort', got 'speed'"),
        ({"copper_loss": -1.0}, "copper_loss: expected watts"),
        ({"copper_loss": float("nan")}, "copper_loss: expected watts"),
    ],
)
def test_impossible_settings_are_refused(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(AllocationError, match=message):
        load_allocator(**wrong)
    with pytest.raises(AllocationError, match=message):
        load_allocator().with_settings(**wrong)


def test_editors_complete_the_settings_that_there_are() -> None:
    aim = {"objective": Name, "energy_weights": EnergyWeights, "copper_loss": float}
    for options, settings, others in (
        (SearchOptions, Settings, aim),
        (MdnOptions, MdnSettings, aim),
        (PaperOptions, PaperSettings, {}),
    ):
        kinds = get_type_hints(settings)
        assert get_type_hints(options) == others | {f.name: kinds[f.name] for f in fields(settings)}
    assert list(get_type_hints(SearchOptions)) == load_allocator().option_names()


@pytest.mark.parametrize(
    "wrong", [{"n_refined": "5"}, {"copper_loss": None}, {"energy_weights": 3}, {"search_steps": "many"}]
)
@pytest.mark.parametrize("method", ["search", "mdn"])
def test_settings_of_the_wrong_type_are_refused_in_a_sentence(method: str, wrong: dict[str, Any]) -> None:
    with pytest.raises(AllocationError, match=f"'{method}': a setting has the wrong type"):
        load_allocator(method, **wrong)
    with pytest.raises(AllocationError, match=f"'{method}': a setting has the wrong type"):
        load_allocator(method).with_settings(**wrong)
