"""The closed loop in the report, from rows made by hand."""

from typing import Any

from finlab.evaluation.report.sections.closed_loop import closed_loop_claims


def _whole(method: str, ate: float) -> dict[str, Any]:
    return {"layout": "all", "method": method, "ate": ate, "depth_rmse": ate / 2}


def _fault(fault: str, kind: str, over: float, tracked: bool = True) -> dict[str, Any]:
    return {"fault": fault, "kind": kind, "method": "learned", "ate_over_healthy": over, "tracked": tracked}


def _speed(method: str, power: float, error: float) -> dict[str, Any]:
    return {"method": method, "speed": None, "inertial_w": power, "mae": error}


def test_what_is_ahead_leads_and_what_is_behind_trails() -> None:
    rows = {
        "trajectory": [_whole("learned", 0.04), _whole("on-board", 0.03)],
        "faults": [_fault("bow lost", "one fin", 1.1), _fault("bow + port lost", "two fins", 3.0, False)],
        "velocity": [
            _speed("learned-power", 0.8, 0.01),
            _speed("analytic", 1.0, 0.02),
            _speed("on-board", 0.4, 0.01),
        ],
    }
    leads, trails = closed_loop_claims(rows)
    assert leads[0].startswith("Closed loop on layouts A to D: ATE 4.0 cm") and "12.4" in leads[0]
    assert leads[1] == "With one fin lost the ATE is at most 1.10 times that of the healthy robot."
    assert leads[2] == (
        "At constant speed, minimizing inertial power (`learned-power`): 20 % less inertial power than "
        "`analytic` with 50 % smaller speed error."
    )
    assert trails == (
        "`on-board` follows the trajectories closer: ATE 3.0 cm.",
        "Loses its way with bow + port lost.",
        "At constant speed, minimizing inertial power (`learned-power`): 100 % more inertial power than "
        "`on-board` with 0 % larger speed error.",
    )


def test_nothing_swum_nothing_said() -> None:
    assert closed_loop_claims({}) == ((), ())
