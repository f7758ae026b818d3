"""What is told of candidates: each number is the plant's own, whatever was kept least."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.allocation.search.receding_horizon import HORIZON, _changes, _columns, _detours, _drifts
from finlab.allocation.search.refined_candidates import _turned_at_rest
from finlab.allocation.search.search_allocator import SearchAllocator
from finlab.allocation.search.turn_limits import limit_turn, unwrap_to_arc
from finlab.assets import shipped_layouts
from finlab.layout import load_layout
from finlab.physics import Plant
from finlab.physics.energy import command_energy
from tests.random_fins import random_robot

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


def test_directions_are_unwrapped_around_the_middle_of_their_arcs(search: SearchAllocator) -> None:
    """Around 3.0 the arc goes over the seam; around -2.5 too, on the other side."""
    prepared = search.pipeline.prepare(load_layout(shipped_layouts()["penta"]))
    previous = np.column_stack([np.full(5, 0.3), np.full(5, 1.0), [3.0, -2.5, 0.4, 2.0, -3.1]])
    near = limit_turn(prepared, previous, np.zeros(5), 0.5)
    command = np.tile(previous, (2, 1, 1))
    command[:, :, 2] = [[-3.0, 3.1, 0.1, 2.2, 3.1], [-0.2, 0.8, -2.6, -1.1, 0.1]]
    turned, turn = unwrap_to_arc(near, command), 2.0 * math.pi
    np.testing.assert_array_equal(turned[..., :2], command[..., :2])
    expected = [
        [turn - 3.0, 3.1 - turn, 0.1, 2.2, 3.1 - turn],
        [turn - 0.2, 0.8 - turn, -2.6, -1.1, 0.1 - turn],
    ]
    np.testing.assert_allclose(turned[..., 2], expected, atol=1e-12)
    assert (np.abs(turned[..., 2] - previous[:, 2]) <= math.pi).all()


# Trajectories of the receding horizon.


def test_changes_wait_as_long_as_a_half_turn_takes_and_share_their_lengths() -> None:
    """Nine ticks of rest are half a circle; each length after a wait is tried without one, too."""
    half_turn = math.ceil(math.pi / HORIZON.free_turn)
    waits, lengths = ({pair[k] for pair in HORIZON.changes} for k in (0, 1))
    assert waits == {0, half_turn // 2, half_turn}
    at_once = {ramp for wait, ramp in HORIZON.changes if wait == 0}
    soon = {ramp for wait, ramp in HORIZON.changes if wait == half_turn // 2}
    assert soon == at_once - {1} and lengths == at_once | {4}
    assert max(lengths) == HORIZON.ticks - half_turn


def test_changes_are_ramps_between_trajectories() -> None:
    start, goal = np.zeros((6, 2, 2)), np.stack([np.full((6, 2, 2), 1.0), np.full((6, 2, 2), -3.0)])
    found = _changes(start, goal, ((0, 1), (2, 4)))
    assert found.shape == (4, 6, 2, 2)
    for k, size in enumerate((1.0, -3.0)):
        np.testing.assert_allclose(found[k, :, 1, 0], size)
        np.testing.assert_allclose(found[2 + k, :, 0, 1], size * np.array([0, 0, 0.25, 0.5, 0.75, 1.0]))


def test_drifts_change_the_wrench_as_asked_by_the_fins_that_work(search: SearchAllocator) -> None:
    planar = search.pipeline.prepare(load_layout("octo")).planar
    rng = np.random.default_rng(0)
    force, change = rng.normal(size=(8, 2)), 0.1 * rng.normal(size=6)
    force[[1, 4]] = 0.0
    drifts = _drifts(planar, force, change)
    for drift in drifts:
        np.testing.assert_allclose(drift.ravel() @ _columns(planar), change, atol=1e-5)
    assert np.linalg.norm(drifts[0, [1, 4]], axis=-1).min() > 1e-4
    assert np.linalg.norm(drifts[1, [1, 4]], axis=-1).max() < 1e-5
    columns, top = _columns(planar), np.repeat(planar.fins.maximum, 2)
    root = np.sqrt(top)[:, None]
    least = (root * np.linalg.pinv((root * columns).T)) @ change
    np.testing.assert_allclose(drifts[0].ravel(), least, atol=1e-5)


def test_detours_keep_the_wrench_and_move_one_fin_across_its_drift(search: SearchAllocator) -> None:
    planar = search.pipeline.prepare(load_layout("octo")).planar
    rng = np.random.default_rng(1)
    force, drift = rng.normal(size=(8, 2)), rng.normal(size=(8, 2)) * np.arange(1, 9)[:, None]
    found = _detours(planar, force, drift, HORIZON)
    sizes = HORIZON.detour_sizes
    assert found.shape == (8 * len(sizes) + 12, 8, 2)
    step = (found - force) / planar.fins.maximum.mean()
    np.testing.assert_allclose(step.reshape(len(step), -1) @ _columns(planar), 0.0, atol=1e-9)
    across = np.stack([-drift[:, 1], drift[:, 0]], axis=-1) / np.linalg.norm(drift, axis=-1)[:, None]
    for k, size in enumerate(sizes):
        for fin in range(8):
            np.testing.assert_allclose(step[8 * k + fin, fin], size * across[fin], atol=0.02 * abs(size))
    drawn = np.linalg.norm(step[8 * len(sizes) :].reshape(12, -1), axis=1)
    np.testing.assert_allclose(drawn, np.tile([0.05, 0.12, 0.3], 4), rtol=1e-9)


def test_six_equations_leave_three_fins_no_detour(search: SearchAllocator) -> None:
    planar = search.pipeline.prepare(load_layout("pair")).planar
    n = len(planar.fins.maximum)
    null = 2 * n - np.linalg.matrix_rank(_columns(planar), tol=1e-6)
    found = _detours(planar, np.ones((n, 2)), np.ones((n, 2)), HORIZON)
    assert (len(found) == 0) == (null == 0)


# What is narrowed or turned before a search.


def test_free_fins_are_narrowed_over_the_seam_and_turn_ahead_within_their_arcs(
    search: SearchAllocator,
) -> None:
    """The fin of which nothing is known stays free; the others' arcs are a radian around where they point."""
    prepared = search.pipeline.prepare(load_layout(shipped_layouts()["penta"]))
    direction = np.array([3.0, -2.5, 0.4, np.nan, -3.1])
    previous = np.column_stack([np.full(5, 0.3), np.full(5, 1.0), direction])
    near = limit_turn(prepared, previous, np.array([-3.0, 0.0, 0.6, 1.0, 3.1]), 0.5)
    known, turn = np.array([0, 1, 2, 4]), 2.0 * math.pi
    np.testing.assert_allclose(near.commands.lower[known, 2], direction[known] - 0.5)
    np.testing.assert_allclose(near.commands.upper[known, 2], direction[known] + 0.5)
    assert near.commands.full_turn.tolist() == [False, False, False, True, False]
    np.testing.assert_allclose(near.planar.fins.half, [0.5, 0.5, 0.5, math.pi, 0.5])
    ahead = [turn - 3.0, -2.0, 0.6, 1.0, 3.1 - turn]
    np.testing.assert_allclose(near.planar.idle_direction, ahead)
    middle = 0.5 * (near.commands.lower[:, 2] + near.commands.upper[:, 2])
    lean = prepared.planar.fins.lean(middle)
    apart = near.planar.fins.middle - middle - lean
    np.testing.assert_allclose(np.exp(1j * apart), 1.0, atol=1e-9)
    assert near.arcs is None and prepared.commands.full_turn.all()


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


def test_arcs_of_forces_lean_as_measured_fins_do(search: SearchAllocator, tmp_path: Path) -> None:
    """A measured fin's force points a little beside its zero direction."""
    layout = random_robot(np.random.default_rng(4), ("table",), tmp_path, n_fins=(3, 5), limits="nominal")
    prepared = search.pipeline.prepare(layout)
    direction = np.linspace(-1.0, 1.0, layout.n_fins)
    previous = np.column_stack([np.full((layout.n_fins, 2), 0.4), direction])
    near = limit_turn(prepared, previous, direction, 0.3)
    lean = prepared.planar.fins.lean(direction)
    assert np.abs(lean).max() > 1e-3
    np.testing.assert_allclose(near.planar.fins.middle, direction + lean, atol=1e-9)
