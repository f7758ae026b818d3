"""Settings belong to an allocator; another one with other settings leaves it as it was."""

from typing import Any

import numpy as np
import pytest

from finlab.allocation import METHODS, Allocator
from finlab.assets import shipped_checkpoints
from finlab.errors import AllocationError
from finlab.layout import load_layout
from tests.allocator_cache import AllocatorCache

WRENCH = [1.0, 0.0, 0.5, 0.0, 0.0, 0.1]
"""A wrench within reach of robot A: surge, heave and yaw [N, N m]."""
CHANGED_SETTINGS: dict[str, dict[str, Any]] = {
    "dual": {"robust": 2.0},
    "mdn": {"n_candidates": 8, "n_refined": 2},
    "paper": {"n_candidates": 4, "n_steps": 3},
    "ipopt": {"n_starts": 1},
    "qp": {},
    "sqp": {"objective": "effort", "n_steps": 1},
    "paper_sqp": {"n_starts": 1, "n_steps": 1},
    "analytic": {},
    "fixed_frequency": {"frequency": 1.1},
    "px4": {"desaturation": "none"},
    "ardusub": {},
}
"""Method -> settings with which it answers otherwise than by its defaults."""
ROBOT = {"px4": "bluerov2_heavy", "ardusub": "bluerov2_heavy"}
"""Those that do not take layout A."""
SAME_ANSWER = ("dual", "analytic", "qp", "ipopt", "px4", "ardusub")
"""Methods that may find the same answer with those settings."""

pytestmark = pytest.mark.skipif(
    not {"default", "paper"} <= set(shipped_checkpoints()),
    reason="no trained checkpoints in the tree",
)


def test_every_method_is_here() -> None:
    assert set(CHANGED_SETTINGS) == set(METHODS)


@pytest.mark.parametrize("method", METHODS)
def test_other_settings_answer_otherwise(method: str) -> None:
    layout = load_layout(ROBOT.get(method, "A"))
    allocator = Allocator(layout, method)
    before = allocator.allocate(WRENCH).command
    other = Allocator(layout, method, **CHANGED_SETTINGS[method])
    command = other.allocate(WRENCH).command
    assert other.method == allocator.method
    assert (other.settings != allocator.settings) == bool(CHANGED_SETTINGS[method])
    assert method in SAME_ANSWER or not np.array_equal(command, before)
    np.testing.assert_array_equal(allocator.allocate(WRENCH).command, before)


def test_networks_are_shared() -> None:
    network = Allocator(load_layout("A"), "mdn")
    assert (
        network.on(load_layout("B")).networks is network.networks
        and network.checkpoint == "default"
    )
    again = Allocator(load_layout("ucat"), "mdn", checkpoint=network.networks)
    assert again.networks is network.networks


@pytest.mark.parametrize("method", METHODS)
def test_unknown_settings_are_refused(method: str) -> None:
    with pytest.raises(AllocationError, match="knows the settings .*, got 'shoe_size'"):
        AllocatorCache(method).with_settings(shoe_size=43)


@pytest.mark.parametrize(
    ("method", "wrong", "message"),
    [
        ("mdn", {"n_refined": 0}, "n_refined: expected a whole number from 1 to 256, got 0"),
        ("mdn", {"n_refined": "5"}, "n_refined: expected a whole number .*, got '5'"),
        ("mdn", {"n_refined": True}, "n_refined: expected a whole number .*, got True"),
        ("dual", {"period_s": 0.0}, "period_s: expected a number above 0 up to 1000 s, got 0.0"),
        ("sqp", {"objective": "speed"}, "objective: expected one of power, effort, got 'speed'"),
        ("dual", {"robust": float("nan")}, "robust: expected a number .* W, got nan"),
        ("dual", {"robust": 10**400}, "robust: expected a number .*, got 1000"),
        ("paper", {"refinement": "magic"}, "refinement: expected one of none, adam,"),
        (
            "sqp",
            {"time_limit_s": 0.0},
            "time_limit_s: expected a number above 0 up to 3600 s, got 0.0",
        ),
        ("sqp", {"n_starts": 0}, "n_starts: expected a whole number from 1"),
    ],
)
def test_impossible_settings_are_refused(method: str, wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(AllocationError, match=message):
        AllocatorCache(method, **wrong)
    with pytest.raises(AllocationError, match=message):
        AllocatorCache(method).with_settings(**wrong)


def test_other_settings_for_the_same_robot() -> None:
    allocator = Allocator(load_layout("catamaran"), robust=0.5, calm=0.0)
    quicker = allocator.with_settings(period_s=0.02)
    assert quicker.layout is allocator.layout
    assert vars(quicker.settings) == {**vars(allocator.settings), "period_s": 0.02}
    before = allocator.allocate(np.zeros(6))
    turned = quicker.allocate([0, 30, 0, 0, 0, 0], previous=before).command - before.command
    step = 0.02 * allocator.layout.rates[:2, 0]
    assert np.abs(turned[:2, 0]).max() <= step.max() * (1 + 1e-9)
    with pytest.raises(AllocationError, match="period_s"):
        allocator.with_settings(period_s=0.0)
    with pytest.raises(AllocationError, match="knows the settings"):
        allocator.with_settings(speed=1.0)
    network = Allocator(load_layout("A"), "mdn")
    assert network.with_settings(period_s=0.2).networks is network.networks
