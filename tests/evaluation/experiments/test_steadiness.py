"""Paths of wrenches, and what is told of a rollout along them."""

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.assets import shipped_layouts
from finlab.cli import main
from finlab.evaluation.experiments.steadiness import forced_turn, rollout, smooth_path, steadiness_rows
from finlab.layout import Layout, load_layout

SIGMA = np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.35])


def shipped(name: str) -> Layout:
    return load_layout(shipped_layouts()[name])


@pytest.mark.parametrize("name", ["A", "D", "pair", "octo"])
def test_paths_are_smooth_and_within_reach(name: str) -> None:
    path = smooth_path(shipped(name), SIGMA, 5000)
    assert path.shape == (600, 6)
    step = np.abs(np.diff(path, axis=0)) / np.abs(path).max()
    assert step.max() < 0.1
    np.testing.assert_array_equal(path, smooth_path(shipped(name), SIGMA, 5000))
    assert np.abs(path - smooth_path(shipped(name), SIGMA, 5001)).max() > 0.1
    error = load_allocator("analytic").allocate(shipped(name), path[17]).err_norm
    assert error < 1e-3


def test_turns_are_forced_where_forces_are_unique() -> None:
    pair = shipped("pair")
    path = smooth_path(pair, SIGMA, 5000, 100)
    forced = forced_turn(pair, path)
    assert forced is not None
    # The pseudo-inverse answers with the only forces there are.
    assert rollout(load_allocator("analytic"), pair, path, steady=True).step[..., 2].max() == pytest.approx(
        forced, abs=1e-3
    )
    assert forced_turn(shipped("A"), path) is None


def test_a_method_without_memory_turns_as_far_either_way() -> None:
    (row,) = steadiness_rows(load_allocator("analytic"), [shipped("A")], n_paths=2, ticks=30, seed=5000)
    assert row["turn_ratio"] == row["power_ratio"] == row["effort_ratio"] == 1.0
    assert row["late_free"] == row["late_steady"] > 0.01
    assert row["paths"] == 2 and row["steady"] == 0 and row["err_norm_max"] < 1e-3


def test_the_verb_prints_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["eval", "steadiness", "--layouts", "pair", "--paths", "1", "--ticks", "5"]) == 0
    assert "worst ratio" in capsys.readouterr().out
    assert main(["eval", "steadiness", "--layouts", " , "]) == 2
    assert "layouts: expected names" in capsys.readouterr().err


def test_with_the_previous_command_rates_are_kept_and_fins_are_no_later() -> None:
    (row,) = steadiness_rows(load_allocator(), [shipped("penta")], n_paths=1, ticks=200, seed=5000)
    assert row["turn_free"] > 0.5 >= row["turn_steady"] - 1e-9
    assert row["frequency_steady"] <= 0.3 + 1e-9 and row["amplitude_steady"] <= 0.1 + 1e-9
    assert row["late_steady"] < 1.02 * row["late_free"]
    assert row["missed"] < 0.05 and row["power_ratio"] < 1.01
