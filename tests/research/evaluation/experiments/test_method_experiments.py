"""Experiments of methods at small sizes: what the figures of each say is true; intervals."""

import math
from typing import Any

import numpy as np
import pytest

from finlab.allocation.baselines.pseudo_inverse import Analytic
from finlab.allocation.method import LeastErrorMethod
from finlab.allocation.methods import MethodChoice
from finlab.allocation.solution import Solution
from finlab.errors import DataError
from finlab.layout import Fin, Layout, Limits
from finlab.physics import Plant
from finlab.research.evaluation import method_specs, scoring
from finlab.research.evaluation.experiment import Row, load_experiment
from finlab.research.evaluation.experiments.temperature import diversity
from finlab.research.evaluation.experiments.thrusters import METHODS, misses_more, missing_by_group
from finlab.research.evaluation.method_specs import MethodSpec, load_method_spec
from finlab.research.evaluation.scoring import (
    joined,
    mean_interval,
    paper_sigma,
    ratio_interval,
    run_method,
)
from finlab.research.evaluation.splits import make_split
from tools import cost


def by(rows: list[Row], *keys: str) -> dict[Any, Row]:
    """Rows of a table by the value of a column, or by those of several."""
    return {tuple(row[key] for key in keys) if len(keys) > 1 else row[keys[0]]: row for row in rows}


class Idle(LeastErrorMethod):
    """Answers every target with the least command."""

    name = "idle"

    def _solve(self, targets: np.ndarray, *, seed: int, previous: np.ndarray | None) -> Solution:
        return Solution(np.tile(self.layout.lower, (len(targets), 1, 1)))


class Cheat(Analytic):
    """Delivers the wrench from beyond its limits."""

    def _solve(self, targets: Any, *, seed: int, previous: Any) -> Any:
        solution = super()._solve(targets, seed=seed, previous=previous)
        return solution._replace(command=solution.command + [0.0, 0.0, 8 * np.pi])


@pytest.mark.parametrize("first", [None, 2])
def test_the_plant_scores(first: int | None) -> None:
    cases = make_split("failure", 3, 4, 11)
    idle = MethodSpec("idle", MethodChoice(Idle, Idle.settings_class()))
    found = joined([run_method(idle, case, number=k, first=first) for k, case in enumerate(cases)])
    expected = []
    for case in cases:
        command = case.layout.lower.copy()
        command[[name in case.lost for name in case.layout.names]] = np.nan
        wrench = Plant(case.layout).wrench(command)
        expected.append(np.linalg.norm((wrench - case.targets[:first]) / paper_sigma(), axis=-1))
    np.testing.assert_allclose(found["err_norm"], np.concatenate(expected))
    assert (found["solve_ms"] > 0).all() and np.unique(found["layout"]).tolist() == [0, 1, 2]


def test_dual_costs_no_more_than_the_best_start() -> None:
    pytest.importorskip("casadi")
    sizes = {"layouts": 3, "targets": 1, "seed": 6, "starts": 8, "methods": ("dual",)}
    rows = cost.experiment.rows(split=("id", "failure"), objectives=("power",), **sizes)
    assert [row["split"] for row in rows] == ["id", "failure"]
    for row in rows:
        assert row["tracked"] == 1.0 and row["cost_ratio"] < 1.002 and row["ratio_max"] < 1.005
        low, high = row["cost_ratio_interval"]
        assert low <= row["cost_ratio"] <= high
    sizes["methods"] = ("dual", "sqp", "mdn")
    effort = cost.experiment.rows(split=("id",), objectives=("effort",), **sizes)
    assert [row["method"] for row in effort] == ["sqp", "mdn"]
    assert effort[1]["cost"] != rows[0]["cost"] and effort[1]["cost_ratio"] < 1.05


def test_an_answer_outside_its_limits_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("casadi")
    cheat = MethodSpec("cheat", MethodChoice(Cheat, Cheat.settings_class()))
    monkeypatch.setattr(method_specs, "load_method_spec", lambda *_: cheat)
    (row,) = cost.experiment.rows(
        methods=("cheat",), objectives=("power",), layouts=2, targets=1, starts=2
    )
    assert row["tracked"] == 0.0 and "cost_ratio" not in row


def surge_robot(arc: tuple[float, float] = (-math.pi, math.pi)) -> tuple[Layout, float]:
    """Two fins abeam that push along x and z, and the thrust of one [N]."""
    limits = Limits(zero_direction=arc)
    fins = [
        Fin(name, (0.0, y, 0.0), -math.pi / 2, limits)
        for name, y in (("port", 0.2), ("star", -0.2))
    ]
    layout = Layout("pair", tuple(fins))
    full = np.array([[*limits.upper[:2], 0.5 * sum(arc)]] * 2)
    return layout, float(np.linalg.norm(Plant(layout).body_forces(full)[0]))


def test_latency_compares_methods_on_the_same_targets(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("casadi")
    monkeypatch.setattr("finlab.research.evaluation.experiments.latency.LAYOUTS", 2)
    monkeypatch.setattr("finlab.research.evaluation.experiments.latency.TARGETS", 5)
    names = ("dual", "analytic", "ipopt", "px4")
    sizes = {"robots": ("fins-3", "thrusters-7"), "reach": (0.9, 1.5), "calls": 6, "seed": 4711}
    rows = load_experiment("latency").rows(methods=names, **sizes)
    found = by(rows, "robot", "call", "method")
    assert len(rows) == 3 * 3 + 3 * 4  # px4 knows thrusters alone
    assert all(0 < row["p50_ms"] <= row["p99_ms"] for row in rows)
    for robot in sizes["robots"]:
        for method in ("dual", "ipopt"):
            near, beyond = (found[robot, f"{share} of reach", method] for share in (0.9, 1.5))
            assert (near["delivered"], beyond["delivered"]) == (1.0, 0.0)
            assert near["power_over_dual"] == pytest.approx(1.0, abs=2e-3)
            assert beyond["power_over_dual"] is None
    dual, inverse = (found["fins-3", "next tick", name] for name in ("dual", "analytic"))
    assert dual["p50_over_dual"] == 1.0 and dual["calls"] == 6
    assert inverse["p50_over_dual"] == pytest.approx(inverse["p50_ms"] / dual["p50_ms"])
    with pytest.raises(DataError, match="robots: expected fins-N or thrusters-N, .* got 'fins-99'"):
        load_experiment("latency").rows(robots=("fins-99",))


def test_ipopt_in_the_space_of_forces_misses_no_more_and_takes_no_more() -> None:
    pytest.importorskip("casadi")
    for case in make_split("ood-fins", 2, 3, 8):
        ours, theirs = (load_method_spec(each).on(case.layout) for each in ("dual", "ipopt"))
        best = ours.allocate_batch(case.targets)
        found = theirs.allocate_batch(case.targets)
        assert found.reachable.all()
        np.testing.assert_allclose(found.power, best.power, rtol=2e-3)
        best = ours.allocate_batch(5.0 * case.targets)
        found = theirs.allocate_batch(5.0 * case.targets)
        np.testing.assert_allclose(found.err_norm, best.err_norm, rtol=1e-3, atol=1e-3)


def test_more_temperature_more_diversity_and_none_between_equals() -> None:
    cold, hot = load_experiment("temperature").rows(
        # Most of the mixture's weight is on one component, so a temperature of 1 draws few others.
        temperatures=(1e-3, 10.0),
        layouts=2,
        targets=2,
        candidates=16,
    )
    assert (cold["temperature"], cold["n"]) == (1e-3, 4) and hot["diversity"] > 1.5 * cold[
        "diversity"
    ]
    low, high = cold["best_j_mean_interval"]
    assert low <= cold["best_j_mean"] <= high
    layout, _ = surge_robot()
    command = np.array([layout.lower, layout.lower, layout.upper])
    assert diversity(command[:2], layout) == 0.0
    # A full turn apart is no difference; amplitude and frequency differ by their whole ranges.
    assert diversity(command[1:], layout) == pytest.approx(math.sqrt(2.0 / 3.0))


def test_the_ablation_scores_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("finlab.research.evaluation.experiments.ablation.TIMED_CALLS", 1)
    experiment = load_experiment("ablation")
    sizes = {"layouts": 2, "targets": 2, "candidates": 8}
    rows = experiment.rows(variants=("mean_only", "without_refinement", "ours"), **sizes)
    found = by(rows, "variant", "scored_by")
    assert len(found) == 6 and all(row["n"] == 4 and row["call_ms"] > 0 for row in rows)
    refined, raw = (found[v, "surrogate"]["j_norm_mean"] for v in ("ours", "without_refinement"))
    assert refined < 0.1 * raw
    printed = experiment.table(rows).rows[-3:]
    assert [row["j_norm_mean"] for row in printed] == [3.64e-2, 1.01e-1, 3.03e-4]
    with pytest.raises(DataError, match="variants: expected some of mean_only"):
        experiment.rows(variants=("theirs",))


N_GROUPS = 100
"""How many groups the made-up values have."""
GROUP_SIZE = 20
"""How many values a group has."""
INTERVAL_HALF_WIDTH = 1.96 * np.sqrt(2.0)
"""Half of a 95 % interval of a difference of two normal values: 1.96 sqrt(2)."""


def _draw(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Values that resemble each other within a group: the spread of groups is what counts."""
    rng = np.random.default_rng(seed)
    group = np.repeat(np.arange(N_GROUPS), GROUP_SIZE)
    return 5.0 + np.repeat(rng.normal(size=N_GROUPS), GROUP_SIZE) + 0.1 * rng.normal(
        size=len(group)
    ), group


def test_the_width_is_that_of_the_groups() -> None:
    values, group = _draw(0)
    low, high = mean_interval(values, group)
    assert high - low == pytest.approx(2 * INTERVAL_HALF_WIDTH / np.sqrt(N_GROUPS), rel=0.15)


@pytest.mark.parametrize("kind", ["mean", "share", "ratio"])
def test_reruns_land_inside(kind: str) -> None:
    def look(seed: int) -> tuple[float, object]:
        values, group = _draw(seed)
        if kind == "mean":
            return values.mean(), mean_interval(values, group)
        if kind == "share":
            return (values < 5.5).mean(), scoring.share_interval(values < 5.5, group)
        below = values + np.random.default_rng(seed + 999).normal(size=N_GROUPS).repeat(GROUP_SIZE)
        return values.sum() / below.sum(), ratio_interval(values, below, group)

    seen = [look(seed) for seed in range(24)]
    values = np.array([value for value, _ in seen])[:, None]
    low, high = np.array([interval for _, interval in seen]).T
    inside = (low <= values) & (values <= high)
    assert np.mean(inside) > 0.88


def test_no_failure_is_no_proof() -> None:
    low, high = scoring.share_interval(np.ones(1000, bool), np.arange(1000) // 10)
    assert high == 1.0 and 0.985 < low < 0.997


def test_one_layout_is_drawn_by_its_targets() -> None:
    values = np.random.default_rng(0).normal(size=400)
    low, high = mean_interval(values, np.zeros(400, np.int64))
    assert 0 < high - low == pytest.approx(2 * INTERVAL_HALF_WIDTH / 20, rel=0.2)


def test_same_seed_same_interval() -> None:
    values, group = _draw(1)
    assert mean_interval(values, group) == mean_interval(values, group)


def test_groups_are_compared_in_order() -> None:
    missing = np.array([[3.0, 4.0, 0.5, 0.0, 0.2, 0.1], [0.0, 0.0, 0.5, 0.0, 0.2, 0.1]])
    sizes = missing_by_group(missing, METHODS["px4"][2])
    np.testing.assert_allclose(sizes, [[0.2, 0.5, 0.1, 5.0], [0.2, 0.5, 0.1, 0.0]])
    more = np.array([[0.1, 9.0, 0.0, 0.0], [0.2, 0.5, 0.2, 0.0]])
    assert misses_more(more, sizes).tolist() == [False, True]
    assert misses_more(sizes, more).tolist() == [True, False]
    assert not misses_more(sizes, sizes + 1e-7).any()


def test_beside_the_autopilots_dual_misses_no_more_and_takes_the_least() -> None:
    """BlueROV2 Heavy, whole and with one thruster lost."""
    sizes = {"lost": (0, 1), "reach": (0.8, 1.2, 3.0), "layouts": 2, "targets": 6, "seed": 12}
    rows = load_experiment("thrusters").rows(robots=("bluerov2_heavy",), **sizes)
    assert len(rows) == 2 * 3 * 5
    for row in rows:
        assert row["n"] == 12
        assert row.get("dual_more_mean", 0.0) == 0.0
        if row["method"] == "dual":
            assert row["not_delivered"] == (0.0 if row["of_reach"] < 100.0 else 1.0)
            assert row["of_reach"] > 100.0 or row["watts_max"] < 1.001
    near = {(row["lost"], row["method"]): row for row in rows if row["of_reach"] == 80.0}
    assert (
        near[0, "pseudo-inverse"]["not_delivered"] > 0.05
        and near[0, "pseudo-inverse"]["watts"] > 1.01
    )
    assert near[0, "ardusub"]["not_delivered"] > near[0, "pseudo-inverse"]["not_delivered"]


def test_a_surveyed_frame_shows_the_axis_that_a_drawing_hides() -> None:
    """Nothing drives pitch alone; thrusters a little out of place seem to, and the pseudo-inverse
    clips."""
    rows = load_experiment("thrusters").rows(
        robots=("surveyed",), lost=(0,), reach=(0.8,), layouts=2, targets=6
    )
    by = {row["method"]: row for row in rows}
    assert by["dual"]["not_delivered"] == 0.0
    assert by["pseudo-inverse"]["n"] == 12
