"""The default method: exact by the plant on any fin, inside limits, never NaN."""

import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.allocation.allocation import CHUNK
from finlab.assets import shipped_layouts
from finlab.layout import Fin, FinModelSpec, Layout, load_layout
from finlab.physics import Plant, make_law, write_table
from finlab.research.random_layouts import random_layout
from tests.allocation.test_levenberg_marquardt import HOSTILE_LAYOUTS as SIMPLE_LAYOUTS
from tests.allocator_cache import AllocatorCache, normalized_error

GOOD = 1e-5
"""Normalized error below which an answer counts as exact, here."""
SHIPS = ("drillship", "supply")
"""Layouts that push a million times as much as those of whose wrenches the normalization is; their
errors are judged by their own size alone."""


def reachable(layout: Layout, n: int, seed: int = 0) -> np.ndarray:
    """Wrenches (n, 6) of random commands, by the plant."""
    lower = layout.lower
    upper = layout.upper
    share = np.random.default_rng(seed).uniform(size=(n, layout.n, 3))
    return Plant(layout).wrench(lower + share * (upper - lower))


def is_within_limits(layout: Layout, command: np.ndarray) -> bool:
    """Whether commands (..., n, 3) are finite and within the limits of a robot."""
    within = (command >= layout.lower).all() and (command <= layout.upper).all()
    return bool(np.isfinite(command).all() and within)


def errors(method: Allocator, layout: Layout, targets: np.ndarray) -> np.ndarray:
    """Normalized errors by the plant, of the axes that the robot commands; commands must keep their
    limits to the last bit."""
    command = method.allocate_batch(layout, targets).command
    assert is_within_limits(layout, command)
    wrench = np.where(layout.commanded, Plant(layout).wrench(command), targets)
    return normalized_error(method.normalization, wrench, targets)


@pytest.mark.parametrize("name", list(shipped_layouts()))
def test_exact_on_shipped_layouts(name: str, search: AllocatorCache) -> None:
    layout = load_layout(shipped_layouts()[name])
    targets = reachable(layout, 25)
    assert search.allocate_batch(layout, targets).err_norm.max() < GOOD
    if name not in SHIPS:
        assert errors(search, layout, targets).max() < GOOD


@pytest.mark.parametrize("limits", ["nominal", "varied"])
def test_exact_on_random_layouts(limits: str, search: AllocatorCache) -> None:
    for seed in range(5000, 5015):
        layout = random_layout(np.random.default_rng(seed), limits=limits)  # type: ignore[arg-type]
        assert errors(search, layout, reachable(layout, 20, seed)).max() < GOOD, seed


def test_exact_outside_the_training_box_and_with_more_fins(search: AllocatorCache) -> None:
    for seed in range(5000, 5005):
        rng = np.random.default_rng(seed)
        wide = random_layout(rng, box=(0.45, 0.45, 0.2), outside=(0.3, 0.3, 0.1))
        many = random_layout(rng, n_fins=(6, 8))
        for layout in (wide, many):
            assert errors(search, layout, reachable(layout, 10, seed)).max() < GOOD, seed


@pytest.mark.parametrize("name", ["A", "B", "C", "D"])
def test_exact_after_the_loss_of_any_fin(name: str, search: AllocatorCache) -> None:
    layout = load_layout(shipped_layouts()[name])
    for fin in layout.names:
        for target in reachable(layout.without([fin]), 2):
            result = search.allocate(layout, target, lost=[fin])
            assert result.err_norm < GOOD
            assert np.isnan(result.command[layout.index(fin)]).all()


HOSTILE_LAYOUTS = {
    **SIMPLE_LAYOUTS,
    "far out": Layout("far", (Fin("a", (10.0, 10.0, 10.0), 0.0), Fin("b", (-10.0, 0.0, 0.0), 1.0))),
    "sixteen": Layout(
        "many", tuple(Fin(f"f{i}", (0.1, 0.02 * i, 0.0), 0.4 * i) for i in range(16))
    ),
}
"""Robots on which solvers stumble: singular, far out, with ranges of no width."""


@pytest.mark.parametrize(
    "name", ["one fin", "two at one place", "all parallel", "may rest", "sixteen"]
)
def test_hostile_layouts_still_get_what_they_can_do(name: str, search: AllocatorCache) -> None:
    layout = HOSTILE_LAYOUTS[name]
    error = errors(search, layout, reachable(layout, 10))
    assert error.max() < GOOD


def test_what_cannot_be_done_is_done_as_far_as_possible(search: AllocatorCache) -> None:
    result = search.allocate(HOSTILE_LAYOUTS["one fin"], [0.0, 50.0, 0.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(result.command[0], [0.6, 2.1, 0.0], atol=1e-2)
    assert result.unallocated[1] > 40.0


def test_many_targets_are_answered_as_well_as_one(search: AllocatorCache) -> None:
    layout = load_layout(shipped_layouts()["A"])
    targets = reachable(layout, CHUNK + 3)
    batch = search.allocate_batch(layout, targets)
    error = normalized_error(search.normalization, Plant(layout).wrench(batch.command), targets)
    assert error.max() < GOOD
    for row in (0, 1, CHUNK - 1, CHUNK, CHUNK + 2):  # around the seam of two chunks
        assert search.allocate(layout, targets[row]).err_norm < GOOD
    assert batch.wrench_expected is None


def test_a_force_table_that_was_measured_again_is_read_again(
    search: AllocatorCache, tmp_path: Path
) -> None:
    grid = np.linspace(0.0, 0.6, 9), np.linspace(0.0, 2.1, 10), np.linspace(-np.pi, np.pi, 13)
    table = FinModelSpec("table", (("path", str(tmp_path / "fin.csv")),))
    layout = load_layout("A")
    layout = replace(layout, actuators=tuple(replace(fin, model=table) for fin in layout.fins))
    for hour, area in enumerate((0.02, 0.03)):
        write_table(tmp_path / "fin.csv", make_law(FinModelSpec("drag", (("area", area),))), *grid)
        os.utime(tmp_path / "fin.csv", (3600 * hour, 3600 * hour))
        assert search.allocate(layout, [1.0, 0.0, 0.5, 0.0, 0.0, 0.1]).err_norm < GOOD


def test_turning_the_robot_does_not_make_it_worse(search: AllocatorCache) -> None:
    layout = load_layout(shipped_layouts()["C"])
    yaw = 0.8
    c = math.cos(yaw)
    s = math.sin(yaw)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    fins = [
        Fin(
            fin.name,
            tuple((rotation @ fin.position).tolist()),
            fin.mounting_angle + yaw,
            fin.limits,
        )
        for fin in layout.fins
    ]
    rotated_layout = Layout("turned", tuple(fins))
    targets = reachable(layout, 10)
    rotated = np.concatenate([targets[:, :3] @ rotation.T, targets[:, 3:] @ rotation.T], axis=1)
    straight = search.allocate_batch(layout, targets).command
    command_of_rotated = search.allocate_batch(rotated_layout, rotated).command
    assert (
        normalized_error(
            search.normalization, Plant(rotated_layout).wrench(command_of_rotated), rotated
        ).max()
        < GOOD
    )
    # Forces in the fins' own frames know nothing of where forward is: the old answer serves the new
    # robot.
    np.testing.assert_allclose(Plant(rotated_layout).wrench(straight), rotated, atol=1e-5)


def test_targets_of_single_precision_are_delivered_by_few_fins() -> None:
    """Two fins span four directions; rounded to single precision a target lies a little beside
    them."""
    for seed in range(5):
        layout = random_layout(np.random.default_rng(seed), n_fins=2)
        allocator = Allocator(layout)
        rounded = reachable(layout, 5, seed).astype(np.float32).astype(float)
        assert allocator.allocate_batch(rounded).err_norm.max() < 1e-6
        answer_out_of_reach = allocator.allocate(1000.0 * rounded[0], policy="direction")
        assert 0.001 - 1e-6 < answer_out_of_reach.share < 1.0
