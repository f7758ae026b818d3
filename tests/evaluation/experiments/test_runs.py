"""Whole runs: a method over a split, latency, and the command line."""

import json
from pathlib import Path

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.allocation.allocator import Allocator
from finlab.allocation.baselines.analytic import Analytic
from finlab.allocation.solution import Solution
from finlab.cli import main
from finlab.evaluation.experiments.ablation import REFINEMENTS, VARIANTS
from finlab.evaluation.experiments.first_answers import (
    KINDS,
    N_FINS,
    first_answer_rows,
)
from finlab.evaluation.experiments.latency import latency_rows, machine
from finlab.evaluation.experiments.wrench_tracking import run_method
from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.report.numbers import FORMATS
from finlab.evaluation.report.sections.ablation import TITLES, ablation_blocks
from finlab.evaluation.report.text import to_text
from finlab.evaluation.splits import make_split
from finlab.inference.normalization import Normalization
from finlab.layout import Layout
from finlab.physics import Plant

NORMALIZATION = Normalization(np.zeros(6), np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.35]))


class Idle(Allocator):
    """Answers every target with the least command."""

    name = "idle"
    normalization = NORMALIZATION

    def _solve(
        self, layout: Layout, targets: np.ndarray, *, seed: int, previous: np.ndarray | None
    ) -> Solution:
        least = layout.lower
        return Solution(np.tile(least, (len(targets), 1, 1)))


@pytest.fixture
def statistics(tmp_path: Path) -> str:
    """A checkpoint folder of which only the wrench statistics are there, enough for the baselines."""
    config = {"format": "finlab-checkpoint", "version": 1}
    statistics = {"mean": NORMALIZATION.mean.tolist(), "std": NORMALIZATION.std.tolist()}
    folder = tmp_path / "statistics"
    folder.mkdir()
    (folder / "config.json").write_text(json.dumps({**config, "normalization": statistics}))
    return str(folder)


@pytest.mark.parametrize("first", [None, 2])
def test_the_plant_scores(first: int | None) -> None:
    cases = make_split("failure", 3, 4, 11)
    records = run_method(Idle(), cases, first=first)
    expected = []
    for case in cases:
        command = case.layout.lower.copy()
        command[[name in case.failed for name in case.layout.names]] = np.nan
        expected.append(NORMALIZATION.error(Plant(case.layout).wrench(command), case.targets[:first]))
    np.testing.assert_allclose(records.err_norm, np.concatenate(expected))
    assert (records.solve_ms > 0).all()


def test_latency_compares_with_search() -> None:
    cases = make_split("id", 3, 4, 11)
    slow, fast = Analytic(NORMALIZATION), Idle()
    rows = latency_rows({"search": fast, "analytic": slow}, cases, n_calls=7)
    assert [row["calls"] for row in rows] == [7, 7]
    assert rows[0]["p50_over_search"] == 1.0
    assert all(0 < row["p50_ms"] <= row["p99_ms"] for row in rows)
    assert "p50_over_search" not in latency_rows({"analytic": slow}, cases, n_calls=1)[0]
    assert latency_rows({"analytic": slow}, cases, n_calls=1000, budget_s=0.0)[0]["calls"] == len(cases)


def test_fins_never_seen_are_compiled_once() -> None:
    """The seed is this test's own, so that no other one has compiled these fins."""
    allocator = load_allocator()
    rows = first_answer_rows(allocator, robots=1, seed=4711)
    assert [(row["fins"], row["new_models"]) for row in rows] == [(k, n) for k in KINDS for n in (1, N_FINS)]
    for row in rows[KINDS.index("soft") * 2 :]:  # compiling takes ten times the call itself
        assert row["first_ms"] > 2.0 * row["again_ms"] > 0.0
    again = first_answer_rows(allocator, robots=1, seed=4711)
    assert sum(row["first_ms"] for row in again) < 0.2 * sum(row["first_ms"] for row in rows)


def test_the_ablation_has_the_papers_rows_twice() -> None:
    ours = [
        {"variant": name, "refinement": by, "scored_by": scored_by, "err_norm_mean": 0.5, "time_s": 0.01}
        | {"j_norm_mean": 0.3, "j_norm_mean_interval": (0.2, 0.4), "j_norm_std": 0.1}
        | {"err_phys_mean": 0.765, "err_phys_square_mean": 0.678}
        for name in VARIANTS
        for by in REFINEMENTS
        for scored_by in ("plant", "surrogate")
    ]
    text = to_text(*ablation_blocks(ours))
    for variant, printed in paper_figures()["ablation"].items():
        lines = [line for line in text.splitlines() if line.startswith(TITLES[variant])]
        show = FORMATS["error"]
        # For each refinement a table of J_norm and one of the wrench error, where printed values stand last.
        assert [show(printed["err_norm_mean"]) in line for line in lines[::2]] == [True, True]
        assert [line.split()[-5:] for line in lines[1::2]] == [
            ["0.77", "0.77", "0.68", "0.68", show(printed["err_phys_mean"])]
        ] * 2


def test_eval_latency(statistics: str, capsys: pytest.CaptureFixture[str]) -> None:
    few = ["--methods", "analytic", "--calls", "3", "--robots", "1"]
    assert main(["eval", "latency", *few, "--checkpoint", statistics]) == 0
    printed = capsys.readouterr().out
    assert "99th percentile [ms]" in printed and "another robot, same fins [ms]" in printed
    assert machine()["processor"] in " ".join(printed.split())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("latency --fins 9 --methods qp", "fins: expected 2 to 5"),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: str, message: str, statistics: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["eval", *arguments.split(), "--checkpoint", statistics]) == 2
    error = capsys.readouterr().err
    assert error.startswith("finlab: error: ") and message in error and error.count("\n") == 1


def test_eval_ablation(
    untrained_checkpoint: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("finlab.evaluation.experiments.ablation.TIMED_CALLS", 1)
    file = tmp_path / "rows.json"
    arguments = ["eval", "ablation", "--layouts", "2", "--targets", "2", "--candidates", "8"]
    assert main([*arguments, "--checkpoint", str(untrained_checkpoint), "--json", str(file)]) == 0
    rows = json.loads(file.read_text())["rows"]
    shown = [(row["variant"], row["refinement"], row["scored_by"]) for row in rows]
    models = ("surrogate", "plant")
    assert shown == [(name, by, model) for name in VARIANTS for by in REFINEMENTS for model in models]
    alike = [row["err_norm_mean"] for row in rows if row["variant"] == "mean_only"]
    assert alike[:2] == alike[2:]  # where nothing is refined, how it would be makes no difference
    assert all(row["n"] == 4 and row["time_s"] > 0 for row in rows)
    assert "8 candidates, temperature 0.02" in " ".join(capsys.readouterr().out.split())
