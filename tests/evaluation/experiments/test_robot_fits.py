"""The judge of fitted robots: what fins truly do, and layouts that know it."""

from pathlib import Path

import numpy as np
import pytest

from finlab.cli import main
from finlab.evaluation.experiments.robot_fits import FASTEST, _loop_row
from finlab.evaluation.experiments.true_robots import TRUE_LAYOUTS, true_layout, true_wrench
from finlab.evaluation.report.sections.robot_fits import robot_fit_blocks
from finlab.evaluation.report.text import to_text
from finlab.layout import Layout, load_layout
from finlab.physics import plant_of
from finlab.sim.plants import PLANTS, make_plant


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


def test_the_true_layout_of_an_offset_robot_answers_as_it_does(robot: Layout, tmp_path: Path) -> None:
    command, velocity = drawn(robot, 5)
    layout = true_layout("offset", robot, tmp_path)
    np.testing.assert_allclose(
        plant_of(layout).wrench(command), true_wrench("offset", robot, command, velocity), atol=1e-12
    )


@pytest.mark.parametrize(("plant", "times"), [("wake", 20.0), ("inflow", 20.0)])
def test_layouts_know_nearly_all_of_jets_and_of_inflow(
    plant: str, times: float, robot: Layout, tmp_path: Path
) -> None:
    command, velocity = drawn(robot, 40)
    truth = true_wrench(plant, robot, command, velocity)
    layout = true_layout(plant, robot, tmp_path)
    said = np.array([plant_of(layout.moving(v)).wrench(c) for c, v in zip(command, velocity, strict=True)])
    naive = plant_of(robot).wrench(command)
    assert np.linalg.norm(said - truth) * times < np.linalg.norm(naive - truth)


def test_every_plant_has_its_true_layout() -> None:
    assert TRUE_LAYOUTS.keys() == PLANTS.keys()


def test_ratios_are_of_the_same_runs() -> None:
    true = {name: np.array([1.0, 2.0, 4.0]) for name in ("ate", "depth_rmse", "depth_under_way", "torque_w")}
    row = _loop_row({name: 1.5 * values for name, values in true.items()}, true)
    assert row["depth_rmse_over_true"] == pytest.approx(1.5)
    np.testing.assert_allclose(row["torque_w_over_true_interval"], 1.5)
    assert "torque_w_over_true_interval" not in _loop_row(true, true)


def test_soft_fins_are_averaged_over_whole_beats(robot: Layout) -> None:
    command = np.tile([[0.5, 0.77, 0.4], [0.3, 1.31, 2.0], [0.6, 0.5, -1.0], [0.2, 2.1, 0.0]], (1, 1, 1))
    force = make_plant("flexible", robot)
    wrench = true_wrench("flexible", robot, command, np.zeros((1, 6)))[0]
    # Whatever swings within the beat is gone: what is left points along the zero directions.
    along = np.stack([np.zeros(4), np.cos(command[0, :, 2]), np.sin(command[0, :, 2])], axis=-1)
    units = np.einsum("nk,nkw->nw", along, force.columns)
    thrust, left, *_ = np.linalg.lstsq(units.T, wrench, rcond=None)
    assert (thrust > 0.0).all() and np.linalg.norm(units.T @ thrust - wrench) < 0.1


def test_the_tables_say_what_is_believed() -> None:
    loops = {"drawn": {"ate": 0.05, "depth_rmse": 0.01, "torque_w": 3.0}}
    row = {"plant": "wake", "used": "jets", "trusted": "yes", "fit_s": 20.0, "loops": loops}
    row |= {f"{which}_mean": 0.1 for which in ("drawn", "fitted", "true")}
    text = to_text(*robot_fit_blocks([row | {"times_smaller": 4.0}], "A", 100, 2))
    assert "wake" in text and "jets" in text and "drawn" in text


def test_unknown_plants_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["eval", "robots", "--plants", "offset,mars"]) == 2
    assert "got 'mars'" in capsys.readouterr().err
