"""Tracks and steps of the sliders of the wrench fit the robot."""

import math

import numpy as np
import pytest

from finlab.analysis.authority import authority
from finlab.layout import load_layout
from webapp.session.files import shipped
from webapp.session.targets import axis_reach, lone_reach, nudge, slider_end, widened_end

REACHES = (1e-3, 0.0899, 0.36, 1.0, 3.33, 8.0, 23.07, 129.2, 640.0)
"""Reaches [N] from a fish to a ferry."""


@pytest.mark.parametrize("name", sorted(shipped()))
def test_a_track_is_as_long_as_the_robot_reaches(name: str) -> None:
    layout = shipped()[name]
    reach = lone_reach(layout)
    sizes = authority(layout)
    alone = np.maximum(sizes.largest, sizes.most_negative)
    for axis in range(6):
        if alone[axis] > 0.0:
            assert reach[axis] == alone[axis] <= axis_reach(layout)[axis] * (1.0 + 1e-9)
        else:
            assert reach[axis] == axis_reach(layout)[axis]
        end = slider_end(float(reach[axis]))
        assert end >= reach[axis], "what is within reach can be asked"
        assert end <= max(1.3 * reach[axis], 1.0)


def test_a_robot_without_actuators_that_work_has_no_reach() -> None:
    layout = load_layout("pair")
    assert not lone_reach(layout, layout.names).any()
    assert slider_end(0.0) == 1.0


@pytest.mark.parametrize("reach", REACHES)
def test_a_nudge_is_a_hundredth_of_the_reach(reach: float) -> None:
    step = nudge(reach)
    assert 0.6 <= max(step, 1e-4) / max(reach / 100.0, 1e-4) <= 1.7
    digits = step / 10.0 ** math.floor(math.log10(step) + 1e-9)
    assert round(digits, 9) in (1.0, 2.0, 5.0)
    n_steps = slider_end(reach) / step
    assert n_steps == pytest.approx(round(n_steps), abs=1e-6), "zero lies on a step of the track"


def test_a_value_beyond_the_end_widens_the_track_by_whole_steps() -> None:
    assert widened_end(22.0, 21.0) == 22.0
    assert widened_end(22.0, 22.0) == 22.0
    assert widened_end(22.0, -100.0) == 100.0
    assert widened_end(22.0, 100.1235) == 110.0
    assert widened_end(1.0, 1000.0) == 1000.0
