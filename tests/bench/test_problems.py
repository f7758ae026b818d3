"""The shipped problems: what they say of themselves holds, and a changed file is refused."""

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from finlab.allocation.search.search_allocator import SearchAllocator
from finlab.bench import problems as module
from finlab.bench.generate import SEED, make_problems
from finlab.bench.page import SETS, WHERE
from finlab.bench.problems import FILE, KINDS, Problems, open_problems, save_problems
from finlab.bench.questions import error_bound
from finlab.errors import DataError
from finlab.evaluation.experiments.unreachable import Judge
from finlab.forces.fin_sets import planar_sets
from finlab.inference.normalization import Normalization
from finlab.physics import plant_of

ROOT = Path(module.__file__).resolve().parents[1]
BESIDE = 1e-2
"""How far a cost may lie below the bound: the compiled fins are tables."""


def test_index_fits_its_schema_and_layouts_fit_theirs() -> None:
    schema = json.loads(FILE.with_name("problems.schema.json").read_text())
    layout = json.loads((ROOT / "layout" / "layout.schema.json").read_text())
    with np.load(FILE) as file:
        index = json.loads(file["index"].tobytes())
    jsonschema.validate(index, schema)
    for robot in index["robots"]:
        jsonschema.validate(robot["layout"], layout)


def test_file_is_small_and_of_the_documented_seed(shipped: Problems) -> None:
    assert FILE.stat().st_size < 3_000_000
    assert shipped.about["seed"] == SEED == 8821


def test_card_counts_what_is_there(shipped: Problems) -> None:
    card = FILE.with_name("problems.md").read_text()
    paths = len(shipped.sequences.robot)
    assert (
        f"{len(shipped.robots)} robots, {len(shipped.targets.robot)} single wrenches, {paths} paths" in card
    )
    for name in dict.fromkeys(robot.set for robot in shipped.robots):
        assert f"`{name}`" in card
    assert set(SETS) == {robot.set for robot in shipped.robots} and tuple(WHERE) == KINDS


def test_every_layout_opens_and_is_finite(shipped: Problems) -> None:
    for place in range(len(shipped.robots)):
        layout = shipped.layout(place)
        assert np.isfinite(plant_of(layout).wrench(layout.upper)).all()


def test_yardsticks_agree_with_each_other(shipped: Problems) -> None:
    asked = shipped.targets
    inside, beyond = asked.kind == 0, asked.kind >= KINDS.index("beyond-1.2")
    assert (asked.best_error[inside] == 0.0).all()
    assert (asked.power_best[inside] >= asked.power_bound[inside] * (1.0 - 1.1 * BESIDE)).all()
    assert np.isnan(asked.power_best[~inside]).all()
    size = [np.linalg.norm(w / shipped.sigma(k)) for k, w in zip(asked.robot, asked.wrench, strict=True)]
    gap = (asked.best_error - asked.error_bound) / np.array(size)
    assert gap.min() > -2e-3 and np.quantile(gap, 0.99) < 2e-3
    assert (asked.error_bound[beyond] > 0.0).mean() > 0.99


def test_error_bound_is_what_ipopt_finds(shipped: Problems) -> None:
    asked = shipped.targets
    for set_ in ("paper", "limits", "big"):  # tiny forces are below what IPOPT allows constraints to miss
        place = next(k for k, robot in enumerate(shipped.robots) if robot.set == set_)
        judge = Judge(shipped.layout(place), shipped.sigma(place))
        for row in np.flatnonzero((asked.robot == place) & (asked.kind >= KINDS.index("beyond-1.2"))):
            wanted = asked.wrench[row] / shipped.sigma(place)
            least = judge.least_error(wanted, np.ones(6, dtype=bool))
            assert asked.best_error[row] == pytest.approx(least, abs=1e-3 * np.linalg.norm(wanted))


def test_nothing_undercuts_the_error_bound(shipped: Problems) -> None:
    asked, rng = shipped.targets, np.random.default_rng(3)
    for row in np.flatnonzero(asked.error_bound > 0.0)[::20]:
        layout, sigma = shipped.layout(asked.robot[row]), shipped.sigma(asked.robot[row])
        sets = planar_sets(SearchAllocator(Normalization(np.zeros(6), sigma)).pipeline.prepare(layout).planar)
        bound, plant = error_bound(sets, asked.wrench[row], sigma), plant_of(layout)
        tried = plant.wrench(plant.sample(rng, (2000,)))
        assert bound == pytest.approx(asked.error_bound[row], rel=1e-6)
        assert bound <= np.linalg.norm((tried - asked.wrench[row]) / sigma, axis=-1).min()


def test_same_seed_same_file(tmp_path: Path) -> None:
    first, again = (save_problems(make_problems(6, 1, costs=False), tmp_path / f"{k}.npz") for k in "ab")
    assert first == again == open_problems(tmp_path / "a.npz").checksum
    assert save_problems(make_problems(7, 1, costs=False), tmp_path / "c.npz") != first


def test_shipped_file_is_what_its_seed_makes(shipped: Problems) -> None:
    """Robots and what is asked of them; the yardsticks of cost take ten minutes."""
    made = make_problems(SEED, costs=False)
    for ours, theirs in zip(made.robots, shipped.robots, strict=True):
        assert (ours.set, ours.description["name"]) == (theirs.set, theirs.description["name"])
        np.testing.assert_allclose(ours.sigma, theirs.sigma, rtol=1e-6)
    assert np.array_equal(made.targets.robot, shipped.targets.robot)
    np.testing.assert_allclose(made.targets.wrench, shipped.targets.wrench, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(made.sequences.wrench, shipped.sequences.wrench, rtol=1e-9, atol=1e-12)


def test_changed_file_is_refused(tmp_path: Path, few: Problems) -> None:
    path = tmp_path / "p.npz"
    save_problems(few, path)
    with np.load(path) as file:
        arrays = dict(file)
    arrays["target_wrench"] = arrays["target_wrench"] * 1.001
    np.savez(path, **arrays)
    with pytest.raises(DataError, match="checksum does not fit"):
        open_problems(path)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 nothing", b"1,2,3"])
def test_other_files_are_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "p.npz"
    path.write_bytes(content)
    with pytest.raises(DataError, match="p.npz"):
        open_problems(path)


def test_later_version_is_refused(tmp_path: Path, few: Problems, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "VERSION", 2)
    save_problems(few, tmp_path / "p.npz")
    monkeypatch.undo()
    with pytest.raises(DataError, match="reads version 1, got 2"):
        open_problems(tmp_path / "p.npz")


def test_tables_stay_in_their_folder_and_arrays_are_complete(tmp_path: Path, shipped: Problems) -> None:
    place = next(k for k, robot in enumerate(shipped.robots) if robot.tables)
    robot = shipped.robots[place]
    away = replace(robot, tables={f"../{name}": table for name, table in robot.tables.items()})
    save_problems(replace(shipped, robots=(away,)), tmp_path / "p.npz")
    with pytest.raises(DataError, match="outside of its folder"):
        open_problems(tmp_path / "p.npz")
    broken = replace(robot, tables=None)  # type: ignore[arg-type]
    save_problems(replace(shipped, robots=(broken,)), tmp_path / "q.npz")
    with pytest.raises(DataError, match="q.npz: is incomplete or of another form"):
        open_problems(tmp_path / "q.npz")


def test_quick_is_a_part_and_sets_are_named(shipped: Problems) -> None:
    quick = shipped.quick()
    assert len(quick.targets.robot) == 11 * len(SETS) and len(quick.sequences.robot) == 2
    with pytest.raises(DataError, match="expected some of paper, shipped"):
        shipped.of_sets(["nowhere"])
    assert {shipped.robots[k].set for k in shipped.of_sets(["tiny"]).targets.robot} == {"tiny"}
    assert replace(quick).checksum == shipped.checksum
