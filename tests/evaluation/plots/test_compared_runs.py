"""Swims side by side, read from the drawn axes."""

import numpy as np
import pytest

from finlab.allocation.allocator import Allocator
from finlab.errors import DataError
from finlab.layout import Layout
from finlab.sim import NO_NOISE, ClosedLoop, Cruise, RunLog, make_trajectory

pytest.importorskip("matplotlib")

from finlab.evaluation.plots.compared_runs import distance_cm, draw_compared, smooth_power  # noqa: E402


def swum(layout: Layout, allocator: Allocator, seconds: float) -> RunLog:
    swim = ClosedLoop(layout, allocator, make_trajectory("circle"), sensors=NO_NOISE)
    while swim.time < seconds:
        swim.step()
    return swim.log


def test_each_swim_has_its_line_in_each_plot(layout_a: Layout, analytic: Allocator) -> None:
    logs = {"short": swum(layout_a, analytic, 3.0), "long": swum(layout_a, analytic, 6.0)}
    view = draw_compared(logs)
    above, off, power = view.axes
    for axis in (above, off, power):
        lines = {line.get_label(): line for line in axis.lines}
        assert {"short", "long"} <= set(lines)
        assert lines["short"].get_color() != lines["long"].get_color()
        assert len(lines["short"].get_xdata()) == 30 and len(lines["long"].get_xdata()) == 60
    (line,) = [line for line in off.lines if line.get_label() == "long"]
    log = logs["long"]
    away = 100 * np.linalg.norm(log.position - log.reference, axis=1)
    assert line.get_ydata() == pytest.approx(away)
    with pytest.raises(DataError, match="expected one to 3, got 0"):
        draw_compared({})


def test_power_is_smooth_and_keeps_its_mean(layout_a: Layout, analytic: Allocator) -> None:
    log = swum(layout_a, analytic, 6.0)
    smooth, power = smooth_power(log), log.driving_power.sum(axis=1)
    assert smooth[30] == pytest.approx(power[25:35].mean()) or smooth[30] == pytest.approx(
        power[26:36].mean()
    )
    assert np.abs(np.diff(smooth)).max() < np.abs(np.diff(power)).max()
    even = RunLog(**{**vars(log), "columns": {**log.columns, "driving_power": np.full((60, 4), 0.5)}})
    assert smooth_power(even) == pytest.approx(np.full(60, 2.0)), "at the ends, too"


def test_only_what_the_task_says_counts_as_off(layout_a: Layout, analytic: Allocator) -> None:
    swim = ClosedLoop(layout_a, analytic, Cruise(0.1), sensors=NO_NOISE)
    for _ in range(20):
        swim.step()
    log = swim.log
    assert distance_cm(log) == pytest.approx(100 * np.abs(log.position[:, 2] + 1.0))
