"""Who leads, from tables made by hand: intervals apart, overlapping, and not known."""

from typing import Any

import pytest

from finlab.evaluation.report.sections.summary import comparisons
from finlab.evaluation.report.verdicts import (
    LEADS,
    LEVEL,
    TRAILS,
    UNKNOWN,
    compare,
    standings,
    with_printed,
)
from finlab.evaluation.statistics.bootstrap import Interval, spread_interval


def _row(method: str, mean: float, half: float, **more: Any) -> dict[str, Any]:
    return {"method": method, "err": mean, "err_interval": [mean - half, mean + half], **more}


def _compare(rows: list[dict[str, Any]], case: Any = "here", **options: Any) -> list[dict[str, Any]]:
    return compare("mean error", rows, "err", case, **options)


@pytest.mark.parametrize(
    ("ours", "half", "verdict"),
    [
        (0.5, 0.2, LEADS),
        (0.5, 0.45, LEVEL),  # ends at 0.95, where the other begins at 0.9
        (1.0, 0.01, LEVEL),  # the whole interval lies inside the other's
        (1.5, 0.45, LEVEL),
        (1.5, 0.3, TRAILS),
    ],
)
def test_one_leads_where_intervals_do_not_overlap(ours: float, half: float, verdict: str) -> None:
    (one,) = _compare([_row("search", ours, half), _row("qp", 1.0, 0.1)])
    assert one["verdict"] == verdict
    assert (one["method"], one["against"], one["ours"], one["theirs"]) == ("search", "qp", ours, 1.0)


def test_intervals_that_touch_do_not_lead() -> None:
    rows = [{"method": "search", "err": 1.0, "err_interval": [0.5, 1.5]}]
    rows.append({"method": "qp", "err": 2.0, "err_interval": [1.5, 2.5]})
    assert _compare(rows)[0]["verdict"] == LEVEL


def test_a_single_run_has_no_verdict_and_more_runs_have_one() -> None:
    def rows(runs: int) -> list[dict[str, Any]]:
        return [
            {"method": name, "err": mean, "err_std": 0.01, "runs": runs}
            for name, mean in (("search", 1.0), ("on-board", 2.0))
        ]

    assert _compare(rows(1))[0]["verdict"] == UNKNOWN
    assert _compare(rows(4))[0]["verdict"] == LEADS
    # Two runs: Student's t with one degree of freedom makes the interval 12.7 deviations wide.
    assert spread_interval(1.0, 0.01, 2) == pytest.approx(Interval(1 - 0.12706, 1 + 0.12706), abs=1e-4)


def test_only_rows_of_one_case_are_compared_and_the_family_never() -> None:
    rows = [
        _row("search", 1.0, 0.1, fins=2),
        _row("search-effort", 9.0, 0.1, fins=2),
        _row("qp", 2.0, 0.1, fins=2),
        _row("qp", 0.5, 0.1, fins=3),
        {"method": "sqp", "err": None, "fins": 2},
    ]
    found = _compare(rows, lambda row: f"{row['fins']} fins")
    assert [(one["against"], one["case"], one["verdict"]) for one in found] == [("qp", "2 fins", LEADS)]


def test_several_forms_are_each_set_against_the_others() -> None:
    rows = [_row(name, mean, 0.1) for name, mean in (("search-effort", 1.0), ("search", 3.0), ("qp", 2.0))]
    found = _compare(rows, methods=("search-effort", "search"))
    assert [(one["method"], one["against"], one["verdict"]) for one in found] == [
        ("search-effort", "qp", LEADS),
        ("search", "qp", TRAILS),
    ]


def test_printed_figures_count_as_exact() -> None:
    rows = with_printed([_row("search", 0.05, 0.01)], "err", {"paper (printed)": 0.0857})
    (one,) = _compare(rows)
    assert (one["against"], one["theirs"], one["verdict"]) == ("paper (printed)", 0.0857, LEADS)


def test_standings_list_the_cases_of_each_verdict() -> None:
    rows = []
    for fins, theirs in ((2, 2.0), (3, 1.05), (4, 0.5)):
        rows += [_row("search", 1.0, 0.1, fins=fins), _row("qp", theirs, 0.1, fins=fins)]
        rows += [_row("sqp", 3.0, 0.1, fins=fins)]
    found = _compare(rows, lambda row: f"{row['fins']} fins")
    qp, sqp = standings(found)
    assert (qp["method"], qp["against"]) == ("search", "qp")
    assert (qp[LEADS], qp[LEVEL], qp[TRAILS]) == ("2 fins", "3 fins", "4 fins")
    assert (sqp[LEADS], sqp[LEVEL], sqp[TRAILS]) == ("all 3", "", "")
    assert len(found) == 6 and found[0]["verdict"] == LEADS and found[0]["our_interval"] == (0.9, 1.1)


def test_nothing_known_nothing_listed() -> None:
    assert standings(_compare([])) == []
    alone = [{"method": name, "err": 1.0, "err_std": 0.0, "runs": 1} for name in ("search", "qp")]
    assert standings(_compare(alone)) == []


def test_the_summary_compares_every_table_it_has() -> None:
    """One row of each table, the default method ahead in all but the time of a call."""
    closed_loop = {"ate_std": 0.001, "runs": 4}
    speed = {"speed": 0.1, "inertial_w_std": 0.01, "mae_std": 1e-4, "runs": 5}
    tables: dict[str, list[dict[str, Any]]] = {
        "wrench": [
            {"split": "id", "method": m, "err_norm_mean": e, "err_norm_mean_interval": (0.9 * e, 1.1 * e)}
            for m, e in (("search", 3e-4), ("qp", 0.5))
        ],
        "cost": [
            {"split": "id", "objective": objective, "method": m, "fins": fins, "cost_ratio": ratio}
            | {"cost_ratio_interval": None if ratio is None else [0.99 * ratio, 1.01 * ratio]}
            for objective in ("power", "effort")
            for fins in (4, "all")
            for m, ratio in (
                ("search", 1.0),
                ("multistart", 1.5 if objective == "power" else 0.9),
                ("analytic", 2.0),  # does not keep the cost least: neither leads nor trails
                ("sqp", None),
            )
        ],
        "ablation": [
            {
                "variant": "ours",
                "refinement": "adam",
                "scored_by": "surrogate",
                "j_norm_mean": 0.04,
                "j_norm_mean_interval": (0.03, 0.05),
            }
        ],
        "latency": [
            {"method": m, "p50_ms": t, "p50_ms_interval": (t, t)} for m, t in (("search", 2.0), ("qp", 0.1))
        ],
        "trajectory": [
            {**closed_loop, "layout": "A", "method": m, "ate": a}
            for m, a in (("search", 0.03), ("on-board", 0.06))
        ],
        "velocity": [
            {**speed, "method": m, "inertial_w": w, "mae": w / 100}
            for m, w in (("search-effort", 1.0), ("analytic", 2.0))
        ],
    }
    found = [(one["measure"], one["case"], one["against"], one["verdict"]) for one in comparisons(tables)]
    assert found == [
        ("mean error", "id", "qp", LEADS),
        ("mean error", "id", "paper (printed)", LEADS),
        ("J_norm", "ablation by the surrogate", "paper (printed)", TRAILS),
        ("power", "split id", "multistart", LEADS),
        ("effort", "split id", "multistart", TRAILS),
        ("time per call", "4 fins", "qp", TRAILS),
        ("ATE", "layouts A", "on-board", LEADS),
        ("speed error", "0.10 m/s", "analytic", LEADS),
    ]
