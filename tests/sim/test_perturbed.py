"""Robots that are not as their layouts say."""

import math
from dataclasses import replace

import numpy as np
import pytest

from finlab.errors import LayoutError
from finlab.layout import FinModelSpec, Layout, load_layout
from finlab.physics import plant_of
from finlab.sim import ClosedLoop, make_trajectory, perturbed
from finlab.vehicle.attitude import euler
from finlab.vehicle.body import complete_body
from finlab.vehicle.vehicle import Vehicle
from tests.any_robot import AnyRobot


def test_weight_elsewhere_is_felt_by_fins_and_buoyancy(layout_a: Layout) -> None:
    """A robot whose weight lies 2 cm ahead hangs with its nose down, its buoyancy above its weight."""
    true = perturbed(layout_a, gravity_offset_m=(0.02, 0.0, 0.0))
    np.testing.assert_allclose(true.position, layout_a.position - (0.02, 0.0, 0.0))
    height = complete_body(layout_a).center_of_buoyancy_m[2]  # type: ignore[index]
    vehicle, state = Vehicle(complete_body(true)), np.zeros(13)
    state[3] = 1.0
    for _ in range(6000):
        state = vehicle.step(state, [0.0] * 6, 0.02)
    pitch = euler(state[3:7])[1]
    assert pitch == pytest.approx(math.atan2(0.02, height), abs=5e-3), "positive with the nose down"
    level = perturbed(layout_a, gravity_offset_m=(0.02, 0.0, 0.0), ballasted=True)
    assert complete_body(level).center_of_buoyancy_m == complete_body(layout_a).center_of_buoyancy_m
    np.testing.assert_allclose(level.position, true.position)


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
    with pytest.raises(LayoutError, match="truth: expected the fins of A"):
        ClosedLoop(layout_a, analytic.on(layout_a), make_trajectory("circle"), truth=load_layout("pair"))
