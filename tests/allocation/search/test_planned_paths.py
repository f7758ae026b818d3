"""The paths among which the receding horizon chooses: each gives the predicted wrenches."""

import numpy as np
import pytest

from finlab.allocation.search import receding_horizon
from finlab.allocation.search.prepared import Prepared
from finlab.allocation.search.receding_horizon import (
    HORIZON,
    HorizonSettings,
    Trajectories,
    _changes,
    _columns,
    _detours,
    _drifts,
    plan_ahead,
)
from finlab.allocation.search.search_allocator import SearchAllocator
from finlab.layout import Fin, Layout
from tests.allocation.conftest import Flip


@pytest.fixture
def pair(effort: SearchAllocator) -> Prepared:
    """Two fins at one place with one shaft: all that counts is the sum of their forces."""
    place = (0.2, 0.1, 0.0)
    return effort.pipeline.prepare(Layout("pair", (Fin("a", place, 0.4), Fin("b", place, 0.4))))


def test_every_path_gives_the_predicted_wrenches(flip: Flip, monkeypatch: pytest.MonkeyPatch) -> None:
    prepared, before, target, near, far = flip
    tried: list[np.ndarray] = []

    def evaluate(
        prepared: Prepared, previous: np.ndarray, force: np.ndarray, settings: HorizonSettings
    ) -> Trajectories:
        tried.append(force)
        found = receding_horizon_evaluate(prepared, previous, force, settings)
        return found._replace(too_fast=np.ones(len(force)))  # so that detours are tried as well

    receding_horizon_evaluate = receding_horizon.evaluate
    monkeypatch.setattr(receding_horizon, "evaluate", evaluate)
    plan_ahead(prepared, before, target, near, far)
    straight_and_changes, detours = tried
    n = len(before)
    assert len(straight_and_changes) == 4 + len(HORIZON.changes)
    assert len(detours) % len(HORIZON.detours) == 0 and len(detours) > 0
    columns = _columns(prepared.planar)
    change = target - prepared.commands.wrench(before[None])[0]
    expected = target + np.arange(HORIZON.ticks)[:, None] * change
    for forces in tried:
        wrench = forces.reshape(len(forces), HORIZON.ticks, 2 * n) @ columns
        np.testing.assert_allclose(wrench, np.broadcast_to(expected, wrench.shape), atol=5e-3)


def test_drifts_weigh_fins_by_strength_or_by_how_hard_they_work(pair: Prepared) -> None:
    """Least squares over the weights: with one shaft, fins share a change as their weights."""
    top = pair.planar.fins.maximum
    force = np.array([[0.04, 0.0], [0.0, 0.01]]) * top[0]
    change = 0.1 * pair.planar.columns[0]
    slow, working = _drifts(pair.planar, force, change)
    for drift in (slow, working):
        np.testing.assert_allclose(drift.reshape(4) @ _columns(pair.planar), change, atol=1e-6)
    np.testing.assert_allclose(slow[0], slow[1])
    np.testing.assert_allclose(working[0, 0] / working[1, 0], 4**1.5, rtol=1e-6)
    resting = np.array([[0.01, 0.0], [0.0, 0.0]]) * top[0]
    _, working = _drifts(pair.planar, resting, change)
    np.testing.assert_allclose(working[0, 0] / working[1, 0], 100**1.5, rtol=1e-6)


def test_changes_wait_and_then_go_over() -> None:
    start, goal = np.zeros((5, 1, 2)), np.full((2, 5, 1, 2), 6.0)
    goal[1] = 12.0
    mixed = _changes(start, goal, ((0, 1), (1, 3)))
    assert mixed.shape == (4, 5, 1, 2)
    np.testing.assert_allclose(mixed[:, :, 0, 0], [[6] * 5, [12] * 5, [0, 2, 4, 6, 6], [0, 4, 8, 12, 12]])


def test_detours_of_fins_that_can_replace_each_other(pair: Prepared) -> None:
    """Steps of every fin in every size and the random ones, none of which changes the wrench."""
    force, top = np.array([[1.0, 0.0], [0.5, 0.5]]), pair.planar.fins.maximum.mean()
    drift = np.array([[0.0, 0.2], [0.3, 0.0]])
    found = _detours(pair.planar, force, drift, HORIZON)
    assert found.shape == (len(HORIZON.detour_sizes) * 2 + HORIZON.random_detours, 2, 2)
    np.testing.assert_allclose(found.sum(1), np.broadcast_to(force.sum(0), (len(found), 2)), atol=1e-9)
    moved = found - force
    for k, size in enumerate(HORIZON.detour_sizes):
        # Each fin moves across its drift, a quarter turn to the left; the ridge takes 0.2 percent off.
        np.testing.assert_allclose(moved[2 * k, 0] / (size * top), [-1.0, 0.0], atol=3e-3)
        np.testing.assert_allclose(moved[2 * k + 1, 1] / (size * top), [0.0, 1.0], atol=3e-3)
    drawn = moved[2 * len(HORIZON.detour_sizes) :]
    sizes = np.resize([0.05, 0.12, 0.3], HORIZON.random_detours)
    np.testing.assert_allclose(np.linalg.norm(drawn.reshape(-1, 4), axis=1), sizes * top, rtol=1e-9)


def test_without_a_null_space_there_are_no_detours(effort: SearchAllocator) -> None:
    one = effort.pipeline.prepare(Layout("one", (Fin("a", (0.2, 0.1, 0.0), 0.4),)))
    assert _detours(one.planar, np.ones((1, 2)), np.ones((1, 2)), HORIZON).shape == (0, 1, 2)
