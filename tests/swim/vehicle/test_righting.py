"""The speed from which water overturns a robot, against swims of the body."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.layout import load_layout
from finlab.swim.vehicle.fossen import complete_body
from finlab.swim.vehicle.righting import overturning_speed, righting_words
from finlab.swim.vehicle.vehicle import Vehicle


@pytest.mark.parametrize("name", ["ucat", "bluerov2_heavy", "fish"])
def test_a_body_overturns_above_that_speed_and_not_below(name: str) -> None:
    layout = load_layout(name)
    body = replace(complete_body(layout), buoyancy_n=None)
    speed = overturning_speed(replace(layout, body=body))
    assert speed is not None
    for share, overturns in ((0.7, False), (1.4, True)):
        vehicle = Vehicle(body)
        state = np.zeros(13)
        state[3] = 1.0
        state[5] = 0.01
        state[7] = share * speed
        pitched = []
        for _ in range(1500):
            state = vehicle.step(state, [0.0] * 6, 0.02)
            state[7] = share * speed
            state[8] = 0.0
            state[[10, 12]] = 0.0
            pitched.append(abs(state[5]))
        assert (max(pitched[1000:]) > 0.02) == overturns


def test_only_a_robot_that_nothing_rights_is_told_of() -> None:
    layout = load_layout("ucat")
    assert righting_words(layout) is None
    flat = replace(
        layout, body=replace(complete_body(layout), center_of_buoyancy_m=(0.0, 0.0, 0.0))
    )
    assert str(righting_words(flat)).startswith("no righting moment: overturns in pitch from 0.")
    top = replace(
        layout, body=replace(complete_body(layout), center_of_buoyancy_m=(0.0, 0.0, -0.02))
    )
    assert righting_words(top) == "no righting moment: overturns in pitch at rest"
