"""The three experiments and their pictures on small runs, and what the verbs refuse."""

import json
from pathlib import Path

import numpy as np
import pytest

from finlab.allocation.allocator import Allocator
from finlab.cli import main
from finlab.evaluation.experiments.closed_loop_runs import run_all
from finlab.evaluation.experiments.faults import (
    all_faults,
    fault_rows,
    fault_scenarios,
    fault_verdict,
)
from finlab.evaluation.experiments.trajectory_and_velocity import (
    trajectory_rows,
    trajectory_scenarios,
    velocity_rows,
    velocity_scenarios,
)
from finlab.evaluation.on_board import OnBoard
from finlab.evaluation.report.sections.closed_loop import fault_blocks, trajectory_blocks, velocity_blocks
from finlab.evaluation.report.text import to_text
from finlab.layout import Layout
from finlab.sim import Trajectory

MOST_BYTES = 150_000


@pytest.fixture(scope="module")
def line() -> Trajectory:
    """A metre ahead in eight seconds."""
    return Trajectory("line", np.array([0.0, 8.0]), np.array([[0.0, 0.0, -1.0], [1.0, 0.0, -1.0]]))


def is_small_png(path: Path) -> bool:
    content = path.read_bytes()
    return content.startswith(b"\x89PNG") and 5_000 < len(content) < MOST_BYTES


def test_trajectory(layout_a: Layout, analytic: Allocator, line: Trajectory) -> None:
    runs = run_all(trajectory_scenarios([layout_a], line), {"analytic": analytic}, range(2))
    one, every = trajectory_rows(runs)
    assert (one["layout"], one["runs"], every["layout"]) == ("A", 2, "all")
    assert 0.0 < one["ate"] < 0.3 and one["ate_std"] > 0.0
    report = to_text(*trajectory_blocks([one, every])).replace("\n", " ")
    assert "paper's method, printed" in report and "0.134" in report and "nothing aligned" in report


def test_paths_are_followed_by_the_papers_controller_or_by_ours(
    layout_a: Layout, analytic: Allocator, line: Trajectory
) -> None:
    scenarios = trajectory_scenarios([layout_a], line)
    (_, paper), (_, ours) = (
        run_all(scenarios, {"analytic": analytic}, [0], **named)[0]
        for named in ({}, {"controller": "tracking"})
    )
    assert (paper.controller, ours.controller) == ("waypoint", "tracking")


def test_faults(layout_a: Layout, analytic: Allocator, line: Trajectory) -> None:
    faults = all_faults(layout_a, 4.0)
    assert len(faults) == 1 + 4 + 6 + 4
    assert sum(not fault.controllable for fault in faults) == 2
    chosen = [fault for fault in faults if "back_right" in fault.fins or not fault.fins]
    rows = fault_rows(chosen, run_all(fault_scenarios(layout_a, line, chosen), {"analytic": analytic}, [0]))
    assert rows[0]["ate_over_healthy"] == 1.0
    hopeless = next(row for row in rows if not row["controllable"])
    report = to_text(*fault_blocks(rows))
    assert "Not swum" in report and f"- {hopeless['fault']}" in report and "ate" not in hopeless


@pytest.mark.parametrize(
    ("growth", "tracked", "verdict"),
    [(1.15, True, "within 1.15"), (1.16, True, "beyond 1.15"), (1.0, False, "lost"), (None, True, "")],
)
def test_a_lost_fin_may_let_the_error_grow_a_little(growth: float, tracked: bool, verdict: str) -> None:
    row = {"kind": "one fin", "tracked": tracked, "ate_over_healthy": growth}
    assert fault_verdict(row) == verdict
    assert fault_verdict({**row, "kind": "healthy", "tracked": True}) == ""


def test_velocity(layout_a: Layout, analytic: Allocator) -> None:
    methods = {"analytic": analytic, "on-board": OnBoard(analytic.normalization)}
    runs = run_all(velocity_scenarios(layout_a, (0.1,), duration_s=12.0), methods, [0])
    rows = velocity_rows(runs)
    assert [row["speed"] for row in rows] == [0.1, 0.1, None, None]
    assert rows[0]["inertial_w"] < rows[1]["inertial_w"], "a fixed fast beat costs more"
    change = rows[1]["inertial_w"] / rows[0]["inertial_w"] - 1.0
    assert f"{100 * change:+.1f} %" in to_text(*velocity_blocks(rows, "analytic"))


def test_on_board_is_exact_within_its_limits_and_scales_beyond(layout_a: Layout, analytic: Allocator) -> None:
    method = OnBoard(analytic.normalization)
    modest = method.allocate(layout_a, [4.0, 0.3, 1.0, 0.1, 0.1, 0.2])
    assert modest.err_norm < 0.05
    assert (modest.command[:, 1] == 2.0).all()
    huge = method.allocate(layout_a, [60.0, 0, 0, 0, 0, 0])
    assert huge.command[:, 0].max() == pytest.approx(0.6)
    assert huge.wrench[0] > 15.0 and np.abs(huge.wrench[1:]).max() < 1e-6
    one_lost = method.allocate(layout_a, [2.0, 0, 0.3, 0, 0, 0.1], failed=["front_left"])
    assert np.isnan(one_lost.command[layout_a.index("front_left")]).all()
    assert one_lost.err_norm < 0.05


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["eval", "trajectory", "--runs", "0"], "runs: expected a number of at least 1"),
        (["eval", "faults", "--methods", ","], "methods: expected names"),
        (["eval", "velocity", "--duration", "5"], "more than 10 s"),
    ],
)
def test_bad_input_is_one_sentence(argv: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(argv) == 2
    err = capsys.readouterr().err
    assert err.startswith("finlab: error: ") and message in err and len(err.splitlines()) == 1


def test_verbs_have_help_and_write_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for verb in (["eval", "trajectory"], ["eval", "faults"], ["eval", "velocity"]):
        assert main([*verb, "--help"]) == 0
    capsys.readouterr()
    file = tmp_path / "rows.json"
    argv = [
        "eval",
        "velocity",
        "--methods",
        "analytic",
        "--runs",
        "1",
        "--duration",
        "11",
        "--json",
        str(file),
        "--figures",
        str(tmp_path),
    ]
    assert main(argv) == 0
    assert "velocity.png: written." in capsys.readouterr().out and is_small_png(tmp_path / "velocity.png")
    rows = json.loads(file.read_text())["rows"]
    assert {row["speed"] for row in rows} == {0.1, 0.15, 0.2, None}
