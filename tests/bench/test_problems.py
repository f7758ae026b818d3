"""The shipped problems: what they say of themselves holds, and a changed file is refused."""

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from finlab.bench.problems import FILE, KINDS, Problems, open_problems
from finlab.errors import DataError
from finlab.physics import plant_of
from tests.ipopt_reach import IpoptReach
from tools import bench_problems as module
from tools.bench_problems import SEED, make_problems, save_problems

BEYOND = KINDS.index("beyond-1.2")


def test_index_fits_its_schema_and_every_layout_opens(shipped: Problems) -> None:
    schema = json.loads(FILE.with_name("problems.schema.json").read_text())
    with np.load(FILE) as file:
        jsonschema.validate(json.loads(file["index"].tobytes()), schema)
    for index in range(len(shipped.robots)):
        layout = shipped.layout(index)
        assert np.isfinite(plant_of(layout).wrench(layout.upper)).all()


def test_card_counts_what_is_there(shipped: Problems) -> None:
    card = FILE.with_name("problems.md").read_text()
    robots, targets, paths = len(shipped.robots), len(shipped.targets.robot), len(shipped.sequences.robot)
    assert f"{robots} robots, {targets} single wrenches, {paths} paths of 60 wrenches" in card
    assert all(f"`{robot.set}`" in card for robot in shipped.robots)
    assert FILE.stat().st_size < 200_000 and shipped.about["seed"] == SEED == 8821


def test_best_errors_are_what_ipopt_finds(shipped: Problems) -> None:
    asked = shipped.targets
    assert (asked.best_error[asked.kind == 0] == 0.0).all()
    assert np.isfinite(asked.power_best[asked.kind == 0]).all()
    for set_ in ("paper", "limits", "big"):  # tiny forces are below what IPOPT allows constraints to miss
        robot = next(k for k, robot in enumerate(shipped.robots) if robot.set == set_)
        reach = IpoptReach(shipped.layout(robot), shipped.sigma(robot))
        for row in np.flatnonzero((asked.robot == robot) & (asked.kind >= BEYOND)):
            wanted = asked.wrench[row] / shipped.sigma(robot)
            least = reach.least_error(wanted, np.ones(6, dtype=bool))
            assert asked.best_error[row] == pytest.approx(least, abs=1e-3 * float(np.linalg.norm(wanted)))


def test_no_random_command_beats_what_is_known(shipped: Problems) -> None:
    asked, rng = shipped.targets, np.random.default_rng(3)
    for row in np.flatnonzero(asked.kind > 0)[::20]:
        plant, sigma = plant_of(shipped.layout(asked.robot[row])), shipped.sigma(asked.robot[row])
        tried = plant.wrench(plant.sample(rng, (2000,)))
        best = np.linalg.norm((tried - asked.wrench[row]) / sigma, axis=-1).min()
        assert asked.best_error[row] <= best + 1e-6


@pytest.mark.exhaustive
def test_shipped_file_is_what_its_seed_makes(shipped: Problems) -> None:
    """Robots and what is asked of them; costs take minutes."""
    made = make_problems(costs=False)
    for ours, theirs in zip(made.robots, shipped.robots, strict=True):
        assert (ours.set, ours.layout["name"]) == (theirs.set, theirs.layout["name"])
        np.testing.assert_allclose(ours.sigma, theirs.sigma, rtol=1e-6)
    asked, kept = made.targets.wrench, shipped.targets.wrench
    inside = shipped.targets.kind == 0
    np.testing.assert_allclose(asked[inside], kept[inside], rtol=1e-5, atol=1e-6)
    # The boundary of what tables give is known to a percent; the file was made by an earlier method.
    assert (np.linalg.norm(asked - kept, axis=1) <= 0.01 * np.linalg.norm(kept, axis=1)).all()
    np.testing.assert_allclose(made.sequences.wrench, shipped.sequences.wrench, rtol=1e-4, atol=1e-4)


def test_what_is_written_is_read_and_later_versions_are_refused(
    tmp_path: Path, few: Problems, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "p.npz"
    save_problems(few, path)
    again = open_problems(path)
    assert again.robots == few.robots and again.checksum != few.checksum
    assert np.array_equal(again.targets.wrench, few.targets.wrench)
    monkeypatch.setattr(module, "VERSION", 3)
    save_problems(few, path)
    monkeypatch.undo()
    with pytest.raises(DataError, match=r"version 2, got 'finlab-bench-problems' 3"):
        open_problems(path)


def test_tables_stay_in_their_folder_and_arrays_are_complete(tmp_path: Path, shipped: Problems) -> None:
    robot = next(robot for robot in shipped.robots if robot.tables)
    away = replace(robot, tables={f"../{name}": table for name, table in robot.tables.items()})
    save_problems(replace(shipped, robots=(away,)), tmp_path / "p.npz")
    with pytest.raises(DataError, match="outside of its folder"):
        open_problems(tmp_path / "p.npz")
    save_problems(replace(shipped, robots=(replace(robot, tables=None),)), tmp_path / "q.npz")  # type: ignore[arg-type]
    with pytest.raises(DataError, match=r"q\.npz: is incomplete or of another form"):
        open_problems(tmp_path / "q.npz")


def test_quick_is_a_part_and_sets_are_named(shipped: Problems) -> None:
    quick, sets = shipped.quick(), {robot.set for robot in shipped.robots}
    assert len(quick.targets.robot) == 11 * len(sets) and len(quick.sequences.robot) == 2
    with pytest.raises(DataError, match="expected some of paper, shipped"):
        shipped.of_sets(["nowhere"])
    assert {shipped.robots[k].set for k in shipped.of_sets(["tiny"]).targets.robot} == {"tiny"}
