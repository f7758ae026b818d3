"""Plans of measurements: all over the limits, in an order that spares time, some of them twice."""

import csv
import io

import numpy as np
import pytest

from finlab.errors import DataError
from finlab.fit.rig_plan import CALM, plan_measurements
from finlab.layout import Limits


def test_the_plan_fills_the_limits_and_repeats_a_tenth() -> None:
    limits = Limits((0.1, 0.5), (0.2, 1.8), (-1.0, 2.0))
    plan = plan_measurements(limits, 200)
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    assert plan.command.shape == (200, 3) and plan.repeats == 20
    assert (plan.command >= lower).all() and (plan.command <= upper).all()
    share = (plan.command - lower) / (upper - lower)
    for axis in share.T:
        assert np.histogram(axis, 4, (0.0, 1.0))[0].min() > 30
    first, again = plan.command[:-20], plan.command[-20:]
    assert all((first == row).all(axis=1).any() for row in again)


def test_the_rig_turns_seldom_and_works_up() -> None:
    plan = plan_measurements(Limits(), 200)
    first = plan.command[: -plan.repeats]
    turns = np.flatnonzero(np.diff(first[:, 2])) + 1
    assert len(turns) == len(np.unique(first[:, 2])) - 1
    for spell in np.split(first, turns):
        assert (np.diff(spell[:, 0] * spell[:, 1]) >= 0.0).all()


def test_the_duration_adds_up() -> None:
    plan = plan_measurements(Limits(), 100)
    slowest = plan.command[:, 1].argmin()
    assert plan.seconds[slowest] == pytest.approx(11.0 / plan.command[slowest, 1])
    turns = 1 + np.count_nonzero(np.diff(plan.command[:, 2]))
    assert plan.duration == pytest.approx(plan.seconds.sum() + CALM * turns)
    assert plan.seconds.min() > 3.0


def test_a_fin_that_cannot_be_turned_keeps_the_middle() -> None:
    plan = plan_measurements(Limits(zero_direction=(-1.0, 2.0)), 40, turn=False)
    assert (plan.command[:, 2] == 0.5).all()


def test_the_file_has_room_for_forces() -> None:
    rows = list(csv.DictReader(io.StringIO(plan_measurements(Limits(), 20).csv())))
    assert len(rows) == 20 and set(rows[0]) == {"A", "f", "phi", "seconds", "Fx", "Fy", "Fz"}
    assert rows[0]["Fy"] == "" and float(rows[0]["A"]) > 0.0


def test_too_few_samples() -> None:
    with pytest.raises(DataError, match="12 samples are too few"):
        plan_measurements(Limits(), 12)
