"""A whole report at a tiny size, with an untrained network; then again from what was kept."""

import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

import pytest

from finlab.evaluation.experiments.training_study import CHANGES
from finlab.evaluation.method_specs import Checkpoints
from finlab.evaluation.report import plan as planning
from finlab.evaluation.report.jobs import Job
from finlab.evaluation.report.make import PAGE, PICTURES, TABLES, TWIN, make_report
from finlab.evaluation.report.plan import make_plan
from finlab.evaluation.report.sizes import Sizes, cases

pytest.importorskip("matplotlib")
pytest.importorskip("casadi")

TINY = Sizes(
    "tiny",
    {
        "wrench": cases(2, 3),
        "wrench-other": cases(2, 2),
        "wrench-slow": cases(1, 1),
        "cost": cases(2, 1),
        "network": cases(1, 2, fins=[4]),
        "modes": cases(2, 1, starts=4),
        "unreachable": {"layouts": 4},
        "rerun": cases(2, 2),
        "beyond": cases(1, 1),
        "sequences": {"layouts": ["D"], "paths": 1, "ticks": 3},
        "steadiness": {"layouts": ["D"], "paths": 1, "ticks": 3},
        "latency": {"calls": 3, "budget_s": 0.5},
        "first_answers": {"robots": 1},
        "swims": {"scenarios": "saturated", "seeds": 1},
        "ablation": cases(2, 2),
        "temperature": cases(2, 2),
        "training": cases(2, 2, preset="smoke", steps=4, batch_size=32),
    },
)


FEW_SPLITS = ("id", "ood", "failure", "tables")


@pytest.fixture(scope="module")
def few() -> pytest.MonkeyPatch:
    """Fewer methods, temperatures and trainings than a real report has."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(planning, "QUICK", ("search", "paper", "analytic"))
        patch.setattr(planning, "SLOW", ("ipopt",))
        patch.setattr(planning, "SPLITS", FEW_SPLITS)
        patch.setattr(planning, "COST_METHODS", ("search", "analytic"))
        patch.setattr(planning, "COST_SETS", ("id", "axes", "tables"))
        patch.setattr(planning, "N_STARTS", 4)
        patch.setattr(planning, "LATENCY_METHODS", ("search", "paper", "analytic", "ipopt"))
        patch.setattr(planning, "TEMPERATURES", (0.01, 1.0))
        patch.setattr(planning, "CHANGES", {name: CHANGES[name] for name in ("recipe", "one_component")})
        patch.setattr("finlab.evaluation.experiments.ablation.TIMED_CALLS", 1)
        patch.setattr("finlab.evaluation.experiments.first_answers.KINDS", ("drag", "table"))
        yield patch


@pytest.fixture(scope="module")
def untrained(untrained_mdn: Path, untrained_checkpoint: Path) -> Checkpoints:
    return Checkpoints(str(untrained_mdn), str(untrained_checkpoint))


@pytest.fixture(scope="module")
def folder(few: pytest.MonkeyPatch, untrained: Checkpoints, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("report")
    _make(out, untrained)
    return out


def _make(out: Path, checkpoints: Checkpoints, **options: Any) -> None:
    make_report(
        out,
        sizes=TINY,
        seed=0,
        checkpoints=checkpoints,
        records=out / "records",
        command="finlab eval report -o DIR",
        processes=0,
        **options,
    )


def test_page_twin_pictures_and_rows_say_the_same(folder: Path, untrained_checkpoint: Path) -> None:
    page, twin = (folder / PAGE).read_text("utf-8"), (folder / TWIN).read_text("utf-8")
    tables = json.loads((folder / TABLES).read_text("utf-8"))
    for words in (
        "What is not shown",
        "Who was tuned on what",
        "Who leads",
        "asked over largest",
        "Sequences with noise",
        "the other leads",
        "Every comparison",
        "0.0857",
        "SHA-256",
        "random starts of IPOPT",
    ):
        assert words in page and words in twin
    digest = json.loads((untrained_checkpoint / "config.json").read_text())["sha256"]
    assert digest in page and digest in twin
    names = {path.name for path in (folder / PICTURES).iterdir()}
    assert len(names) == page.count("<svg") == twin.count("](pictures/")
    assert all(f"](pictures/{name})" in twin for name in names)
    assert len(tables["wrench"]) == len(FEW_SPLITS) * 4 and len(tables["ablation"]) == 20
    costs = {(row["split"], row["objective"], row["method"]) for row in tables["cost"]}
    assert costs == {
        (split, objective, method)
        for split in ("id", "axes", "tables")
        for objective in ("power", "effort")
        for method in ("search", "analytic")
    }
    again = {(row["split"], row["method"]): row["err_norm_mean"] for row in tables["rerun"]}
    assert set(again) == {
        (split, method) for split in FEW_SPLITS for method in ("search", "paper", "analytic")
    }
    for row in tables["wrench"]:  # drawn anew
        assert row["method"] == "ipopt" or row["err_norm_mean"] != again[row["split"], row["method"]]
    assert [row["temperature"] for row in tables["temperature"]] == [0.01, 1.0]
    assert {(row["fins"], row["objective"]) for row in tables["network"]} == {(4, "power"), (4, "effort")}
    assert [row["fins"] for row in tables["first_answers"]] == ["drag", "drag", "table", "table"]
    assert [row["layout"] for row in tables["steadiness"]] == ["D"]
    for section, parts in planning.SECTIONS.items():
        assert section == "closed-loop" or set(parts) & set(tables)  # hardly anything swims in a tiny report
    assert "slow_swims" not in tables
    swum = [(swim["scenario"], swim["layout"], swim["method"]) for swim in tables["swims"]]
    assert swum == [
        ("saturated", layout, method)
        for layout in ("A", "C")
        for method in ("search", "analytic", "on-board")
    ]
    for words in ("Hard days", "The path asks for more than the fins can give", "error, hard days"):
        assert words in page and words in twin


def test_every_method_says_what_it_was_given(folder: Path) -> None:
    tables, twin = json.loads((folder / TABLES).read_text("utf-8")), (folder / TWIN).read_text("utf-8")
    told = twin[twin.index("## Who knows what") : twin.index("## Wrench tracking")]
    assert all(f"`{row['method']}`" in told for name in ("wrench", "cost", "latency") for row in tables[name])


def test_the_page_stands_alone(folder: Path) -> None:
    page = (folder / PAGE).read_text("utf-8")
    assert "<script" not in page and "<img" not in page and "@import" not in page
    assert page.index("the other leads") < page.index('<h2 id="wrench-tracking">')


def test_the_second_time_nothing_is_done_again(
    folder: Path, untrained: Checkpoints, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("work was done twice")

    monkeypatch.setattr(Job, "run", refuse)
    rows = (folder / TABLES).read_text("utf-8")
    _make(folder, untrained)
    assert (folder / TABLES).read_text("utf-8") == rows


def test_a_report_can_be_made_section_by_section(few: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def headings(sections: Collection[str]) -> list[str]:
        _make(tmp_path, Checkpoints(), sections=sections)
        lines = (tmp_path / TWIN).read_text("utf-8").splitlines()
        return [line.removeprefix("## ") for line in lines if line.startswith("## ")]

    first, last = ["What is shown", "Who leads", "Who knows what"], ["How this was made"]
    assert headings(["unreachable"]) == [*first, "Out of reach", *last]
    assert headings(["steadiness"]) == [*first, "Out of reach", "From tick to tick", *last]
    assert "Not run yet when this page was made: " in (tmp_path / TWIN).read_text("utf-8")


def test_two_runs_with_one_seed_print_the_same(few: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """All but times, digit for digit."""

    def printed(folder: str) -> dict[str, Any]:
        _make(tmp_path / folder, Checkpoints(), sections=["wrench", "beyond", "sequences"])
        tables = json.loads((tmp_path / folder / TABLES).read_text("utf-8"))
        names = "wrench", "rerun", "beyond", "sequences"
        return {name: list(map(_timeless, tables[name])) for name in names}

    assert printed("first") == printed("second")


def _timeless(row: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in row.items() if "ms" not in key.split("_")}


def test_sections_that_take_hours_are_run_where_they_are_named(tmp_path: Path) -> None:
    assert planning.parse_sections("hard-days, slow-days") == ["hard-days", "slow-days"]
    assert set(planning.SECTIONS) - set(planning.parse_sections("all")) == {"slow-days"}
    plan = make_plan(TINY, seed=0, checkpoints=Checkpoints(), runs=tmp_path).only(["slow-days"])
    compared = {"search,analytic,on-board", "sqp", "paper"}
    assert {job.settings["methods"] for job in plan} == compared


def test_a_study_without_one_of_its_parts_is_left_out(few: pytest.MonkeyPatch, tmp_path: Path) -> None:
    plan = make_plan(TINY, seed=0, checkpoints=Checkpoints(), runs=tmp_path).only(["temperature"])
    *parts, last = plan
    for job in parts:
        job.path(tmp_path).touch()
    assert not plan.only_done(tmp_path).tables
    last.path(tmp_path).touch()
    assert plan.only_done(tmp_path) == plan


def test_without_casadi_and_torch_the_rest_is_planned(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    whole = make_plan(TINY, seed=0, checkpoints=Checkpoints(), runs=tmp_path).tables
    monkeypatch.setattr(planning, "find_spec", lambda _: None)
    bare = make_plan(TINY, seed=0, checkpoints=Checkpoints(), runs=tmp_path).tables
    assert set(whole) - set(bare) == {"training", "unreachable", "beyond"}
    assert {method for _, method in set(whole["wrench"]) - set(bare["wrench"])} == {"ipopt"}
    assert bare["cost"] == whole["cost"]  # SLSQP stands in for IPOPT
    assert bare["ablation"] == whole["ablation"]
    assert bare["wrench"]["id", "search"] == whole["wrench"]["id", "search"]
