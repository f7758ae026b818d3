"""Robots that are not as their layouts say."""

import math

import pytest

from finlab.errors import LayoutError
from finlab.layout import Layout, load_layout
from finlab.sim import ClosedLoop, make_trajectory, perturbed
from tests.any_robot import AnyRobot


def test_what_makes_no_sense_is_refused(layout_a: Layout, analytic: AnyRobot) -> None:
    for wrong in ({"damping": 0.0}, {"buoyancy": math.nan}):
        with pytest.raises(LayoutError):
            perturbed(layout_a, **wrong)  # type: ignore[arg-type]
    with pytest.raises(LayoutError, match="truth: expected the actuators of A"):
        ClosedLoop(layout_a, analytic.on(layout_a), make_trajectory("circle"), truth=load_layout("pair"))
