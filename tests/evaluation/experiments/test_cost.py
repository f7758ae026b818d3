"""Costs over the best of random starts, at a tiny size."""

from typing import Any

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.allocation.baselines.analytic import Analytic
from finlab.cli import main
from finlab.errors import DataError
from finlab.evaluation.experiments.cost import cost_rows, cost_sets, parse_objectives
from finlab.evaluation.report.sections.cost import cost_blocks
from finlab.evaluation.report.text import to_text
from finlab.evaluation.splits import SPLITS
from finlab.evaluation.symmetric_cases import SETS
from finlab.layout.arrays import Array
from finlab.physics import Plant

SMALL: dict[str, Any] = {"layouts": 3, "targets": 2, "seed": 6, "n_starts": 8}


class Cheat(Analytic):
    """Delivers the wrench from beyond its limits."""

    def _solve(self, layout: Any, targets: Array, *, seed: int, previous: Array | None) -> Any:
        solution = super()._solve(layout, targets, seed=seed, previous=previous)
        command = solution.command.copy()
        command[:, 0, 2] += 8 * np.pi
        return solution._replace(command=command)


class Lazy(Analytic):
    """Never does anything."""

    def _commands(self, plant: Plant, targets: Array, seed: int) -> Array:
        return np.broadcast_to(plant.lower, (len(targets), plant.n_fins, 3))


@pytest.mark.parametrize("name", ["id", "fins", "failure", "coincident"])
def test_the_search_costs_no_more_than_the_best_start(name: str) -> None:
    rows = cost_rows(name, {"search": load_allocator()}, "power", **SMALL)
    *by_fins, whole = rows
    assert whole["fins"] == "all" and whole["n"] == 6 == sum(row["n"] for row in by_fins)
    assert whole["tracked"] == 1.0 and whole["solved_by_starts"] >= 4
    assert whole["cost_ratio"] < 1.002 and whole["ratio_max"] < 1.005
    assert all(row["split"] == name and row["objective"] == "power" for row in rows)


def test_the_objective_is_told_to_methods_that_can_choose() -> None:
    allocators = {"search": load_allocator("search", objective="effort")}
    (*_, power), (*_, effort) = (cost_rows("id", allocators, aim, **SMALL) for aim in ("power", "effort"))
    assert power["cost_ratio"] < 1.002, "left at effort it would cost more"
    assert power["cost"] != effort["cost"]
    watts, proxy = (to_text(*cost_blocks([row], 32)) for row in (power, effort))
    assert "mean cost [W]" in watts and "mean cost [J_en]" in proxy


def test_answers_that_miss_or_leave_their_limits_do_not_count() -> None:
    normalization = load_allocator().normalization
    methods = {"cheat": Cheat(normalization), "lazy": Lazy(normalization)}
    rows = {row["method"]: row for row in cost_rows("id", methods, "power", **SMALL) if row["fins"] == "all"}
    for row in rows.values():
        assert row["tracked"] == 0.0 and row["cost_ratio"] is None and row["cost_ratio_interval"] is None


def test_names() -> None:
    assert cost_sets("all") == [*SPLITS, *SETS] and cost_sets("axes") == ["axes"]
    assert parse_objectives("effort, power") == ["power", "effort"]
    with pytest.raises(DataError, match="split: expected all or one of id, .*axes-mixed, got 'nowhere'"):
        cost_sets("nowhere")
    for wrong in ("money", "power,money", ","):
        with pytest.raises(DataError, match="objectives: expected power, effort or both"):
            parse_objectives(wrong)


def test_the_verb_prints_every_objective(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    import json

    file = tmp_path / "rows.json"
    sizes = ["--split", "axes", "--layouts", "1", "--targets", "1", "--starts", "2", "--methods", "search"]
    assert main(["eval", "cost", *sizes, "--json", str(file)]) == 0
    rows = json.loads(file.read_text())["rows"]
    assert [(row["objective"], row["fins"]) for row in rows] == [
        *(("power", 4), ("power", "all"), ("effort", 4), ("effort", "all"))
    ]
    printed = capsys.readouterr().out
    assert printed.index("mean cost [W]") < printed.index("mean cost [J_en]")
    assert "cheapest end of 2 random starts" in " ".join(printed.split())
