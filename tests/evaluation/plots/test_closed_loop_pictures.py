"""What the closed loop's pictures show, read from the drawn axes: paths, errors, commands, wrenches."""

from typing import Any

import numpy as np
import pytest

from finlab.layout import Layout
from finlab.sim import NO_NOISE, ClosedLoop, RunLog, Trajectory

pytest.importorskip("matplotlib")

from finlab.evaluation.plots import closed_loop_run  # noqa: E402
from tests.any_robot import AnyRobot

WRENCH = ("Fx [N]", "Tx [N m]", "Fy [N]", "Ty [N m]", "Fz [N]", "Tz [N m]")


@pytest.fixture(scope="module")
def log(layout_a: Layout, analytic: AnyRobot) -> RunLog:
    """Six seconds ahead; the front left fin is lost at the third."""
    line = Trajectory("line", np.array([0.0, 6.0]), np.array([[0.0, 0.0, -1.0], [0.6, 0.0, -1.2]]))
    return ClosedLoop(
        layout_a, analytic.on(layout_a), line, sensors=NO_NOISE, failures=[("front_left", 3.0)]
    ).run()


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
