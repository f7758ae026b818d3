"""What the closed loop's pictures show, read from the drawn axes: paths, errors, commands, wrenches."""

from typing import Any

import numpy as np
import pytest

from finlab.allocation.allocator import Allocator
from finlab.layout import Layout
from finlab.sim import NO_NOISE, ClosedLoop, RunLog, Trajectory

pytest.importorskip("matplotlib")

from finlab.evaluation.plots import closed_loop_run  # noqa: E402
from finlab.evaluation.plots.closed_loop_experiments import (  # noqa: E402
    draw_faults,
    draw_layouts,
    draw_velocity,
    track_of,
)

WRENCH = ("Fx [N]", "Tx [N m]", "Fy [N]", "Ty [N m]", "Fz [N]", "Tz [N m]")


@pytest.fixture(scope="module")
def log(layout_a: Layout, analytic: Allocator) -> RunLog:
    """Six seconds ahead; the front left fin is lost at the third."""
    line = Trajectory("line", np.array([0.0, 6.0]), np.array([[0.0, 0.0, -1.0], [0.6, 0.0, -1.2]]))
    return ClosedLoop(layout_a, analytic, line, sensors=NO_NOISE, failures=[("front_left", 3.0)]).run()


def _line(axis: Any, label: str) -> np.ndarray:
    (line,) = [line for line in axis.lines if line.get_label() == label]
    return line.get_xydata()


def test_the_path_from_above_and_from_the_side(log: RunLog) -> None:
    above, side = closed_loop_run.draw_path(log).axes
    assert _line(above, "robot") == pytest.approx(log.position[:, :2])
    assert _line(side, "robot") == pytest.approx(log.position[:, [0, 2]])
    assert _line(side, "reference") == pytest.approx(log.reference[:, [0, 2]])
    (where,) = _line(above, "front_left lost at 3 s")
    assert where == pytest.approx(log.position[np.searchsorted(log.time, 3.0), :2])
    assert (above.get_xlabel(), above.get_ylabel(), side.get_ylabel()) == ("x [m]", "y [m]", "z [m]")


def test_errors_and_attitude_over_time(log: RunLog) -> None:
    top, bottom = closed_loop_run.draw_errors(log).axes
    distance = np.linalg.norm(log.position - log.reference, axis=1)
    assert _line(top, "distance") == pytest.approx(np.column_stack([log.time, distance]))
    assert _line(top, "depth, up positive")[:, 1] == pytest.approx(log.position[:, 2] - log.reference[:, 2])
    assert {"roll", "pitch"} <= {line.get_label() for line in bottom.lines}
    assert bottom.get_ylabel() == "angle [deg]" and top.get_xlim() == (0.0, log.time[-1])


def test_commands_in_degrees_end_where_a_fin_is_lost(log: RunLog) -> None:
    view = closed_loop_run.draw_commands(log)
    assert [axis.get_ylabel() for axis in view.axes] == [
        "amplitude [deg]",
        "frequency [Hz]",
        "zero direction [deg]",
    ]
    did = _line(view.axes[0], "front_left")
    lost = ~log.alive[:, log.fins.index("front_left")]
    assert lost.any() and np.isnan(did[lost, 1]).all() and np.isfinite(did[~lost, 1]).all()
    other = log.fins.index("back_left")
    assert _line(view.axes[0], "back_left")[:, 1] == pytest.approx(np.degrees(log.fin_motion[:, other, 0]))
    assert _line(view.axes[1], "back_left")[:, 1] == pytest.approx(log.fin_motion[:, other, 1])
    # Every fin: its command, and what it did; and the mark of the loss.
    assert [len(axis.lines) for axis in view.axes] == [2 * 4 + 1] * 3


def test_each_axis_of_the_wrench_has_its_own_place(log: RunLog) -> None:
    view = closed_loop_run.draw_wrench(log)
    assert tuple(axis.get_ylabel() for axis in view.axes) == WRENCH
    for k, name in enumerate(("Fx [N]", "Fy [N]", "Fz [N]", "Tx [N m]", "Ty [N m]", "Tz [N m]")):
        axis = view.axes[WRENCH.index(name)]
        assert _line(axis, "asked")[:, 1] == pytest.approx(log.asked[:, k])
        assert _line(axis, "delivered")[:, 1] == pytest.approx(log.delivered[:, k])


def test_layouts_have_a_column_each(log: RunLog) -> None:
    runs = (("A", "search"), ("B", "search"), ("B", "on-board"))
    tracks = [(names, track_of(log)) for names in runs]
    rows = [{"layout": name, "ate": ate} for name, ate in (("A", 0.012), ("B", 0.034))]
    view = draw_layouts(tracks, rows)
    above_a, above_b, _, depth_b = view.axes
    assert (
        above_a.get_title(loc="left") == "A: ATE 1.2 cm" and above_b.get_title(loc="left") == "B: ATE 3.4 cm"
    )
    assert (len(above_a.lines), len(above_b.lines)) == (2, 3)
    assert _line(above_b, "on-board") == pytest.approx(log.position[:, :2])
    assert depth_b.lines[1].get_xydata() == pytest.approx(np.column_stack([log.time, log.position[:, 2]]))


def test_faults_stand_in_order_with_the_allowed_growth_and_the_printed_below() -> None:
    rows = [
        {"fault": fault, "controllable": controllable, "method": "search", "ate": ate, "ate_std": 0.01}
        for fault, controllable, ate in (("healthy", True, 0.04), ("bow lost", True, 0.05), ("all", False, 9))
    ]
    (axis,) = draw_faults(rows, {"healthy (printed)": 0.13}).axes
    (container,) = axis.containers
    assert container[0].get_xydata() == pytest.approx(np.array([[0.04, 0.0], [0.05, 1.0]]))
    assert container[2][0].get_segments()[0][:, 0] == pytest.approx([0.03, 0.05])
    assert any(np.allclose(line.get_xdata(), 1.15 * 0.04) for line in axis.lines)
    assert any(
        np.allclose(line.get_xydata(), [[0.13, 2.0]]) for line in axis.lines if len(line.get_xdata()) == 1
    )
    shown = [label.get_text() for label in axis.get_yticklabels()]
    assert shown == ["healthy", "bow lost", "healthy (printed)"] and axis.yaxis_inverted()


def test_speed_over_time_and_power_against_error(log: RunLog) -> None:
    over_time, trade = draw_velocity([((0.1, "search"), log), ((0.1, "analytic"), log)]).axes
    speed = log.motion[:, 0]
    assert sum(np.array_equal(line.get_ydata(), speed) for line in over_time.lines) == 2
    ((error, power),) = _line(trade, "search, 0.10 m/s")
    assert error == pytest.approx(np.abs(speed - log.reference_surge).mean())
    assert power == pytest.approx(log.inertial_power.sum(axis=1).mean())
    assert trade.get_xlim()[0] == trade.get_ylim()[0] == 0.0
