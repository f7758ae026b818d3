"""Rows of losses made by hand, and one small run of each kind."""

import math

import numpy as np
import pytest

from finlab.evaluation.experiments.monitor import Loss, monitoring_rows, swim_loss
from finlab.layout import Layout
from finlab.sim import Trajectory
from tests.any_robot import AnyRobot

QUICK = Loss("A", "bow", 1.0, True, 0, 900.0, 0.06, 0.05)


def test_shares_hours_and_ratios() -> None:
    losses = [
        QUICK,
        QUICK._replace(found_s=2.0, right=False),
        QUICK._replace(found_s=4.0),
        QUICK._replace(found_s=math.inf, right=False),
        QUICK._replace(fin=None, false_alarms=2, found_s=math.inf, right=False, ate=9.0),
    ]
    one, every = monitoring_rows(losses)
    assert (one["layout"], every["layout"]) == ("A", "all")
    assert every["losses"] == 4 and every["found"] == 0.5
    assert every["right"] == pytest.approx(2 / 3) and every["found_s"] == 2.0
    assert every["hours"] == pytest.approx(1.25) and every["false_per_hour"] == pytest.approx(1.6)
    assert every["ate_ratio"] == pytest.approx(1.2)


def test_a_loss_is_swum_beside_an_announced_one(layout_a: Layout, analytic: AnyRobot) -> None:
    time = np.array([0.0, 24.0])
    line = Trajectory("line", time, np.outer(time, [0.12, 0.0, 0.0]) + [0.0, 0.0, -1.0])
    lost = swim_loss(layout_a, "front_left", line, analytic, 1)
    assert lost.fin == "front_left" and lost.right and lost.found_s < 3.0 and lost.false_alarms == 0
    assert 0.5 < lost.ate / lost.ate_announced < 2.0
    whole = swim_loss(layout_a, None, line, analytic, 2)
    assert whole.whole_s == pytest.approx(24.0) and whole.false_alarms == 0 and np.isnan(whole.ate_announced)
