"""The suite of hard days: every swim can be built, its figures on made-up logs, who leads on made-up rows."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from finlab.allocation.allocator import Allocator
from finlab.cli import main
from finlab.errors import DataError
from finlab.evaluation.experiments.hard_days import HARD_DAYS, Case, HardDay, choose_days
from finlab.evaluation.experiments.swims import (
    FIGURES,
    Swim,
    duels,
    goal_sentences,
    not_swum,
    paired_interval,
    swim_all,
    swim_figures,
    swim_rows,
    verdict_of,
)
from finlab.evaluation.on_board import OnBoard
from finlab.evaluation.report.sections.swims import slow_day_blocks, swim_blocks
from finlab.evaluation.report.text import to_text
from finlab.evaluation.statistics.bootstrap import Interval
from finlab.sim import RunLog
from finlab.vehicle.body import complete_body
from finlab.vehicle.vehicle import Vehicle

DAYS = {day.name: day for day in HARD_DAYS}


@pytest.mark.parametrize("day", HARD_DAYS, ids=lambda day: day.name)
def test_every_day_can_be_swum(day: HardDay, analytic: Allocator) -> None:
    """One tick of the first case of every layout."""
    first = {case.layout: case for case in reversed(day.cases())}
    assert set(first) == set(day.layouts)
    for case in first.values():
        loop = day.swim(case, analytic, 3)
        assert np.isfinite(loop.step().delivered).all() and loop.controller.name == "tracking"
        assert (loop.monitor is None) == day.announced


def test_what_is_true_is_not_what_is_believed(analytic: Allocator) -> None:
    damped = DAYS["damping-double"].swim(Case("A", ()), analytic, 0)
    plain = DAYS["nominal"].swim(Case("A", ()), analytic, 0)
    assert damped.layout == plain.layout
    motion = np.zeros(13)
    motion[[3, 7]] = 1.0, 0.2
    braking = [loop.vehicle.derivative(motion, [0.0] * 6)[7] for loop in (damped, plain)]
    assert braking[0] == pytest.approx(2.0 * braking[1], rel=0.05) and braking[1] < 0.0
    one, other = (
        DAYS["waves"].swim(Case("A", ()), analytic, seed).water.flow([0, 0, -1], 1.0) for seed in (1, 2)
    )
    assert one != other


def test_a_body_that_is_drawn_too_large_and_who_steers_it(analytic: Allocator) -> None:
    low = DAYS["parameters-low"].swim(Case("B", ()), analytic, 0, controller="waypoint")
    drawn, true = low.layout, low.vehicle
    assert low.controller.name == "waypoint" and drawn == DAYS["nominal"].robot("B", 0)
    moments = np.array(true.inertia[3:]) / np.array(Vehicle(complete_body(drawn)).inertia[3:])
    np.testing.assert_allclose(moments, 0.7)


def test_fins_of_a_day_are_known_and_drawn_by_the_seed() -> None:
    own, mixed = DAYS["nominal"].robot("A", 0), DAYS["fins-mixed"].robot("A", 0)
    assert [fin.position for fin in mixed.fins] == [fin.position for fin in own.fins]
    assert len({fin.model for fin in mixed.fins}) == 4
    assert mixed == DAYS["fins-mixed"].robot("A", 0) != DAYS["fins-mixed"].robot("A", 1)
    assert {fin.model.type for fin in DAYS["fins-soft"].robot("A", 0).fins} == {"soft"}


def test_each_fin_in_turn_and_hopeless_pairs_have_a_reason() -> None:
    assert [case.fins[0] for case in DAYS["weak"].cases()] == list(DAYS["weak"].robot("A", 0).names)
    assert len(DAYS["lost-two"].cases()) == 6
    assert not not_swum([DAYS["lost-one"], DAYS["nominal"]])
    reasons = [row["reason"] for row in not_swum([DAYS["lost-two"]])]
    assert len(reasons) == 2 and "front_right and back_right" in reasons[0]


def test_names_of_days() -> None:
    assert choose_days("all") == list(HARD_DAYS)
    assert [day.name for day in choose_days("waves, nominal,waves")] == ["waves", "nominal"]
    for wrong in ("gale", "", "all,gale"):
        with pytest.raises(DataError, match="scenarios: expected all"):
            choose_days(wrong)


def _log(command: list[list[list[float]]], missing: list[float]) -> RunLog:
    """A log of one fin or more that stands at its reference; `missing` is what each tick lacks along x."""
    n, n_fins = len(command), len(command[0])
    asked = np.zeros((n, 6))
    asked[:, 0] = missing
    power = np.full((n, n_fins), 2.0)
    power[-1] = 5.0
    columns = SimpleNamespace(
        time=0.1 * np.arange(n),
        n_ticks=n,
        position=np.zeros((n, 3)),
        reference=np.full((n, 3), [0.3, 0.0, 0.4]),
        command=np.array(command),
        asked=asked,
        allocated=np.zeros((n, 6)),
        inertial_power=power,
        torque_power=power,
        driving_power=power,
        solve_ms=np.ones(n),
    )
    return cast(RunLog, columns)


def test_figures_of_a_swim() -> None:
    nan = float("nan")
    command = [
        [[0.2, 1.0, 3.1], [0.0, 0.1, 0.0]],
        [[0.3, 1.5, -3.1], [0.4, 2.0, 2.0]],  # turns through pi; the other fin begins to work
        [[0.3, 1.5, -3.05], [nan, nan, nan]],  # the other one is lost
    ]
    found = swim_figures(_log(command, [0.0, 0.0, 0.2]), cpu_s=0.01)
    assert found["ate"] == pytest.approx(0.5) and found["depth_rmse"] == pytest.approx(0.4)
    assert found["turn"] == pytest.approx(2 * np.pi - 6.2)
    assert found["frequency_step"] == pytest.approx(0.5)  # what a fin at rest is told does not count
    assert found["amplitude_step"] == pytest.approx(0.4)
    assert found["rests_per_min"] == pytest.approx(1 / 0.005)
    assert found["out_of_reach"] == pytest.approx(1 / 3)
    assert found["peak_w"] == 10.0 and found["driving_w"] == pytest.approx(6.0)
    assert found["cpu_s_per_min"] == pytest.approx(2.0)


def _swim(method: str, seed: int, ate: float, watts: float, farthest: float = 0.1) -> Swim:
    figures: dict[str, Any] = dict.fromkeys(FIGURES, 1.0) | {"ate": ate, "driving_w": watts, "max": farthest}
    return Swim("nominal", method, "A", (), seed, figures)


def test_swims_of_the_same_noise_are_held_against_each_other() -> None:
    """Seeds differ by far more than methods do, but all in the same way."""
    ours = [_swim("search", seed, 0.05 * seed, 1.0) for seed in range(1, 6)]
    more = [0.004, 0.005, 0.006, 0.005, 0.005]
    theirs = [_swim("analytic", seed, 0.05 * seed + more[seed - 1], 1.0) for seed in range(1, 6)]
    interval = paired_interval(ours, theirs[::-1], "ate")
    assert interval is not None and -0.007 < interval.low < -0.005 < interval.high < -0.003
    assert verdict_of(interval) == "better" and verdict_of(Interval(-0.1, 0.1)) == "level"
    assert verdict_of(Interval(0.1, 0.2)) == "worse"
    assert paired_interval(ours[:1], theirs[:1], "ate") is None
    row = swim_rows([*ours, *theirs])[0]
    assert row["ate_ratio_interval"][0] < row["ate_ratio"] < row["ate_ratio_interval"][1] < 1.0
    assert row["verdict"] == "error better, power level"


def test_the_best_baseline_is_another_for_each_figure() -> None:
    swims = [
        *(_swim("search", seed, 0.05 + 0.001 * seed, 2.0 + seed) for seed in range(4)),
        *(_swim("analytic", seed, 0.10 + 0.001 * seed, 4.0) for seed in range(4)),
        *(_swim("on-board", seed, 0.20, 3.0) for seed in range(4)),
        *(_swim("qp", seed, 0.01, 0.1, farthest=2.0) for seed in range(4)),  # loses its path: is no yardstick
    ]
    own, *others = swim_rows(swims)
    assert own["ate_best"] == "analytic" and own["ate_ratio"] == pytest.approx(0.0515 / 0.1015)
    assert own["driving_w_best"] == "on-board" and own["driving_w_ratio"] == pytest.approx(3.5 / 3.0)
    assert own["verdict"] == "error better, power level"
    assert all("verdict" not in row for row in others) and others[-1]["lost"] == 4
    text = to_text(*swim_blocks([DAYS["nominal"]], [own, *others], [])).replace("\n", " ")
    assert "error better, power level; error 0.51 of that of `analytic`, power 1.17 of that of" in text
    known = replace(DAYS["nominal"], reason="Nobody knows why.")
    told = " ".join(to_text(*swim_blocks([known], [own, *others], [])).split())
    assert "board`. Nobody knows why." in told


def test_who_alone_keeps_the_path_and_who_loses_it() -> None:
    ours, theirs = (
        [_swim("search", s, 0.1, 1.0) for s in (0, 1)],
        [_swim("analytic", s, 0.1, 1.0, 3.0) for s in (0, 1)],
    )
    row = swim_rows([*ours, *theirs])[0]
    assert row["verdict"] == "the only one that keeps its path" and "ate_ratio" not in row
    lost = [swim._replace(figures={**swim.figures, "max": 3.0}) for swim in ours]
    kept = [swim._replace(figures={**swim.figures, "max": 0.1}) for swim in theirs]
    assert swim_rows([*lost, *kept])[0]["verdict"].startswith("loses its path")


def test_slow_methods_are_set_against_the_swims_that_they_share() -> None:
    ours = [_swim("search", seed, 0.05 * seed, 1.0) for seed in range(1, 6)]
    sqp = [_swim("sqp", seed, 0.05 * seed + 0.005 + 1e-4 * seed, 0.5 + 0.01 * seed) for seed in range(1, 6)]
    paper = [_swim("paper", seed, 0.1, 3.0, farthest=2.0) for seed in (1, 2, 7)]  # ours has not swum seed 7
    against_sqp, against_paper = duels(ours, [*sqp, *paper])
    assert (against_sqp["method"], against_sqp["swims"]) == ("sqp", 5)
    assert against_sqp["ours_ate"] == pytest.approx(0.15) and against_sqp["ate"] == pytest.approx(0.1553)
    assert against_sqp["ate_ratio"] == pytest.approx(0.15 / 0.1553)
    assert against_sqp["verdict"] == "error better, power worse"
    assert (against_paper["method"], against_paper["swims"], against_paper["lost"]) == ("paper", 2, 2)
    assert against_paper["ours_ate"] == pytest.approx(0.075)
    assert against_paper["verdict"] == "the only one that keeps its path"
    told = " ".join(
        to_text(*slow_day_blocks(*([s._asdict() for s in each] for each in (ours, sqp + paper)))).split()
    )
    assert (
        "search against sqp: error better on 1 and worse on 0 of 1 days, at 0.97 to 0.97 of its error; power "
        "better on 0 and worse on 1 of 1 days (nominal), at 1.89 to 1.89 of its power."
    ) in told.replace("`", "")
    assert "`paper` loses its path on 2 of 2." in told


def test_goals_depend_on_the_kind_of_day() -> None:
    def row(scenario: str, ate: float, watts: float) -> dict[str, Any]:
        ratios = {"ate_ratio": ate, "driving_w_ratio": watts}
        return {"scenario": scenario, "method": "search", "verdict": "", **ratios}

    rows = [
        row("nominal", 0.9, 0.96),
        row("current", 1.0, 1.02),
        row("late", 1.03, 0.5),
        row("wake", 0.6, 9.0),
    ]
    rows.append({"scenario": "weak", "method": "search", "verdict": "the only one that keeps its path"})
    rows.append({"scenario": "late", "method": "analytic"})
    assert goal_sentences(HARD_DAYS, rows) == [
        "Days of kind 'nominal': 1 of 1 at most 0.95 of the best baseline's error",
        "Days of kind 'nominal': 0 of 1 at most 0.95 of the best baseline's power"
        "; not `search` on `nominal` (0.96)",
        "Days of kind 'law kept': 1 of 2 at most 1.02 of the best baseline's error"
        "; not `search` on `late` (1.03)",
        "Days of kind 'law kept': 2 of 2 at most 1.02 of the best baseline's power",
        "Days of kind 'hard': 2 of 2 at most 0.7 of the best baseline's error",
    ]


def test_one_seed_has_no_interval_and_no_verdict() -> None:
    row, _ = swim_rows([_swim("search", 0, 0.1, 1.0), _swim("analytic", 0, 0.2, 2.0)])
    assert "ate_interval" not in row and row["verdict"] == "" and row["ate_ratio"] == 0.5
    told = to_text(*swim_blocks([DAYS["nominal"]], [row], []))
    assert "Not won" not in told
    assert "one seed has no interval" in to_text(
        *swim_blocks([DAYS["nominal"]], [{**row, "ate_ratio": 1.1}], [])
    )


def test_a_short_day(analytic: Allocator) -> None:
    methods = {"analytic": analytic, "on-board": OnBoard(analytic.normalization)}
    days = [
        replace(DAYS["waves"], duration_s=12.0, layouts=("A",)),
        replace(DAYS["lost-two"], duration_s=12.0, trajectory="station"),
    ]
    swims = swim_all(days, {"analytic": analytic}, [1]) + swim_all(days[:1], methods, [2])
    assert {swim.fins for swim in swims if swim.scenario == "lost-two"} == {
        case.fins for case in days[1].cases() if days[1].obstacle(case) is None
    }
    rows = swim_rows(swims)
    assert [(row["method"], row["swims"]) for row in rows] == [
        ("analytic", 2),
        ("analytic", 4),
        ("on-board", 1),
    ]
    for row in rows:
        assert 0.0 < row["ate"] < 0.5 and row["driving_w"] < row["peak_w"] and row["cpu_s_per_min"] > 0.0


def test_what_the_verb_refuses(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["eval", "swims", "--seeds", "0"]) == 2
    assert "seeds" in capsys.readouterr().err
    assert main(["eval", "swims", "--scenarios", "gale"]) == 2
    assert "expected all, or some of nominal" in capsys.readouterr().err
