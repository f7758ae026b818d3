"""The suite of hard days: every swim can be built, and its figures on made-up logs."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from finlab.research.evaluation.experiments.hard_days import HARD_DAYS, HardDay, HardDaySwim
from finlab.research.evaluation.experiments.swims import DAYS, day_rows, swim_figures
from finlab.swim.simulation import RunLog
from finlab.swim.vehicle.fossen import complete_body
from finlab.swim.vehicle.vehicle import Vehicle
from tests.allocator_cache import AllocatorCache


@pytest.mark.parametrize("day", HARD_DAYS, ids=lambda day: day.name)
def test_every_day_can_be_swum(day: HardDay, analytic: AllocatorCache) -> None:
    """One tick of the first case of every layout."""
    first = {case.layout: case for case in reversed(day.cases())}
    assert set(first) == set(day.layouts)
    for case in first.values():
        loop = day.swim(case, analytic, 3)
        assert np.isfinite(loop.step().delivered).all() and loop.controller.name == "tracking"
        assert (loop.monitor is None) == day.announced


def test_what_is_true_is_not_what_is_believed(analytic: AllocatorCache) -> None:
    damped = DAYS["damping-double"].swim(HardDaySwim("A", ()), analytic, 0)
    plain = DAYS["nominal"].swim(HardDaySwim("A", ()), analytic, 0)
    assert damped.layout == plain.layout
    motion = np.zeros(13)
    motion[[3, 7]] = 1.0, 0.2
    braking = [loop.vehicle.derivative(motion, [0.0] * 6)[7] for loop in (damped, plain)]
    assert braking[0] == pytest.approx(2.0 * braking[1], rel=0.05) and braking[1] < 0.0
    torn = DAYS["weak"].swim(HardDaySwim("A", ("front_left",)), analytic, 0)
    assert (
        torn.broken["front_left"].share == 0.7 and not torn.told and not torn.damage.faults_by_kind
    )


def test_a_body_that_is_drawn_too_small_and_who_steers_it(analytic: AllocatorCache) -> None:
    high = DAYS["parameters-high"].swim(HardDaySwim("B", ()), analytic, 0)
    drawn = high.layout
    true = high.vehicle
    assert drawn == DAYS["nominal"].robot("B", 0)
    moments = np.array(true.inertia[3:]) / np.array(Vehicle(complete_body(drawn)).inertia[3:])
    np.testing.assert_allclose(moments, 1.3)


def test_fins_of_a_day_are_known_and_drawn_by_the_seed() -> None:
    own = DAYS["nominal"].robot("A", 0)
    mixed = DAYS["fins-mixed"].robot("A", 0)
    assert [fin.position for fin in mixed.fins] == [fin.position for fin in own.fins]
    assert len({fin.model for fin in mixed.fins}) == 4
    assert mixed == DAYS["fins-mixed"].robot("A", 0) != DAYS["fins-mixed"].robot("A", 1)


def test_each_fin_in_turn_but_no_hopeless_pair() -> None:
    assert [case.fins[0] for case in DAYS["weak"].cases()] == list(DAYS["weak"].robot("A", 0).names)
    assert len(DAYS["lost-two"].cases()) == 6
    hopeless = [
        case.fins for case in DAYS["lost-two"].cases() if DAYS["lost-two"].is_hopeless(case)
    ]
    assert len(hopeless) == 2 and hopeless[0] == ("front_right", "back_right")
    assert not any(DAYS["lost-one"].is_hopeless(case) for case in DAYS["lost-one"].cases())


def _log(command: list[list[list[float]]], missing: list[float]) -> RunLog:
    """A log of one fin or more that stands at its reference; `missing` is what each tick lacks
    along x."""
    n = len(command)
    n_fins = len(command[0])
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
    assert found["out_of_reach"] == pytest.approx(1 / 3)
    assert found["peak_w"] == 10.0 and found["driving_w"] == pytest.approx(6.0)
    assert found["cpu_s_per_min"] == pytest.approx(2.0)


def test_a_short_day(analytic: AllocatorCache) -> None:
    day = replace(DAYS["lost-two"], duration_s=12.0, trajectory="station")
    (row,) = day_rows(day, {"analytic": analytic}, [1])
    assert row["swims"] == 4 and 0.0 < row["ate"] < 0.5
    assert row["driving_w"] < row["peak_w"] and row["cpu_s_per_min"] > 0.0
