"""A whole report at a tiny size, with an untrained network; then again from what was kept."""

import json
from pathlib import Path

import pytest

from finlab.evaluation.experiments.training_study import CHANGES
from finlab.evaluation.method_specs import Checkpoints
from finlab.evaluation.report import plan as planning
from finlab.evaluation.report.jobs import Job
from finlab.evaluation.report.make import PAGE, PICTURES, TABLES, TWIN, make_report
from finlab.evaluation.report.plan import make_plan
from finlab.evaluation.report.sizes import Sizes

pytest.importorskip("matplotlib")
pytest.importorskip("casadi")

TINY = Sizes(
    "tiny",
    main=(2, 3),
    other=(2, 2),
    slow_other=(1, 1),
    cost=(2, 1),
    ablation=(2, 2),
    temperature=(2, 2),
    trained=(2, 2),
    latency=(3, 0.5),
    training=("smoke", 4, 32),
    swims=(0, 0, 0),
    lost_pairs=False,
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
        patch.setattr(planning, "cost_sets", lambda _: ["id", "axes", "tables"])
        patch.setattr(planning, "N_STARTS", 4)
        patch.setattr(planning, "LATENCY_METHODS", ("search", "paper", "analytic", "ipopt"))
        patch.setattr(planning, "TEMPERATURES", (0.01, 1.0))
        patch.setattr(planning, "CHANGES", {name: CHANGES[name] for name in ("recipe", "one_component")})
        patch.setattr("finlab.evaluation.experiments.ablation.TIMED_CALLS", 1)
        yield patch


@pytest.fixture(scope="module")
def folder(
    few: pytest.MonkeyPatch, untrained_checkpoint: Path, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    out = tmp_path_factory.mktemp("report")
    _make(out, untrained_checkpoint)
    return out


def _make(out: Path, checkpoint: Path) -> None:
    make_report(
        out,
        sizes=TINY,
        seed=0,
        checkpoints=Checkpoints(str(checkpoint), str(checkpoint)),
        records=out / "records",
        command="finlab eval report -o DIR",
        processes=0,
    )


def test_page_twin_pictures_and_rows_say_the_same(folder: Path, untrained_checkpoint: Path) -> None:
    page, twin = (folder / PAGE).read_text("utf-8"), (folder / TWIN).read_text("utf-8")
    tables = json.loads((folder / TABLES).read_text("utf-8"))
    for words in (
        "Who leads",
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
    assert [row["temperature"] for row in tables["temperature"]] == [0.01, 1.0]


def test_the_page_stands_alone(folder: Path) -> None:
    page = (folder / PAGE).read_text("utf-8")
    assert "<script" not in page and "<img" not in page and "@import" not in page
    assert page.index("the other leads") < page.index('<h2 id="wrench-tracking">')


def test_the_second_time_nothing_is_done_again(
    folder: Path, untrained_checkpoint: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("work was done twice")

    monkeypatch.setattr(Job, "run", refuse)
    rows = (folder / TABLES).read_text("utf-8")
    _make(folder, untrained_checkpoint)
    assert (folder / TABLES).read_text("utf-8") == rows


def test_without_casadi_and_torch_the_rest_is_planned(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    whole = make_plan(TINY, seed=0, checkpoints=Checkpoints(), runs=tmp_path)
    monkeypatch.setattr(planning, "find_spec", lambda _: None)
    bare = make_plan(TINY, seed=0, checkpoints=Checkpoints(), runs=tmp_path)
    assert whole.training and not bare.training
    assert {method for _, method in set(whole.wrench) - set(bare.wrench)} == {"ipopt"}
    assert bare.cost == whole.cost  # SLSQP stands in for IPOPT
    assert bare.ablation == whole.ablation and bare.wrench["id", "search"] == whole.wrench["id", "search"]
