"""Robots that are not as their layouts say."""

import math
from dataclasses import replace

import numpy as np
import pytest

from finlab.errors import LayoutError
from finlab.layout import FinModelSpec, Layout, load_layout
from finlab.physics import plant_of
from finlab.sim import ClosedLoop, make_trajectory, perturbed
from tests.any_robot import AnyRobot


def test_a_torn_fin_gives_a_share_of_its_thrust(layout_a: Layout) -> None:
    true = perturbed(layout_a, thrust={"back_left": 0.7})
    command = np.tile([0.4, 1.2, 0.5], (4, 1))
    share = np.linalg.norm(plant_of(true).forces(command), axis=1)
    share /= np.linalg.norm(plant_of(layout_a).forces(command), axis=1)
    expected = np.where(np.arange(4) == layout_a.index("back_left"), 0.7, 1.0)
    np.testing.assert_allclose(share, expected)


def test_what_makes_no_sense_is_refused(layout_a: Layout, analytic: AnyRobot) -> None:
    for wrong in ({"damping": 0.0}, {"buoyancy": math.nan}, {"thrust": {"front_left": -0.1}}):
        with pytest.raises(LayoutError):
            perturbed(layout_a, **wrong)  # type: ignore[arg-type]
    with pytest.raises(LayoutError, match="no fin 'tail'"):
        perturbed(layout_a, thrust={"tail": 0.5})
    measured = replace(layout_a.fins[0], model=FinModelSpec("table", (("path", "x.csv"),)))
    table = replace(layout_a, actuators=(measured, *layout_a.fins[1:]))
    with pytest.raises(LayoutError, match="table cannot be scaled"):
        perturbed(table, thrust={"front_right": 0.5})
    with pytest.raises(LayoutError, match="truth: expected the actuators of A"):
        ClosedLoop(layout_a, analytic.on(layout_a), make_trajectory("circle"), truth=load_layout("pair"))
