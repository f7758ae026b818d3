"""What fins truly do, by which fitted robots are measured, and one fit."""

import numpy as np
import pytest

from finlab.evaluation.experiment import load_experiment
from finlab.evaluation.experiments.robots import FASTEST
from finlab.evaluation.true_wrench import true_wrench
from finlab.layout import Layout, load_layout
from finlab.physics import plant_of
from finlab.sim.plants import make_plant


@pytest.fixture(scope="module")
def robot() -> Layout:
    return load_layout("A")


def drawn(robot: Layout, count: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    return plant_of(robot).sample(rng, (count,)), rng.uniform(-FASTEST, FASTEST, (count, 6))


def test_the_mean_plant_is_the_layouts_own(robot: Layout) -> None:
    command, velocity = drawn(robot, 5)
    np.testing.assert_allclose(
        true_wrench("mean", robot, command, velocity), plant_of(robot).wrench(command), atol=1e-12
    )


def test_speed_counts_where_the_truth_says_so(robot: Layout) -> None:
    command, velocity = drawn(robot, 5)
    fast, still = (true_wrench("inflow", robot, command, v) for v in (velocity, 0.0 * velocity))
    assert np.abs(fast - still).max() > 0.05
    np.testing.assert_allclose(still, plant_of(robot).wrench(command), atol=1e-12)


def test_soft_fins_are_averaged_over_whole_beats(robot: Layout) -> None:
    command = np.tile([[0.5, 0.77, 0.4], [0.3, 1.31, 2.0], [0.6, 0.5, -1.0], [0.2, 2.1, 0.0]], (1, 1, 1))
    force = make_plant("flexible", robot)
    wrench = true_wrench("flexible", robot, command, np.zeros((1, 6)))[0]
    # Whatever swings within the beat is gone: what is left points along the zero directions.
    along = np.stack([np.zeros(4), np.cos(command[0, :, 2]), np.sin(command[0, :, 2])], axis=-1)
    units = np.einsum("nk,nkw->nw", along, force.effectiveness)
    thrust, left, *_ = np.linalg.lstsq(units.T, wrench, rcond=None)
    assert (thrust > 0.0).all() and np.linalg.norm(units.T @ thrust - wrench) < 0.1


@pytest.mark.exhaustive
def test_a_fit_makes_errors_smaller() -> None:
    (row,) = load_experiment("robots").rows(plants=("offset",), targets=5)
    assert row["trusted"] == "yes" and row["times_smaller"] > 3.0
