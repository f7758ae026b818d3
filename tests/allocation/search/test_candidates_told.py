"""What is told of candidates: each number is the plant's own, whatever was kept least."""

from typing import Any

import numpy as np
import pytest

from finlab.layout import load_layout
from finlab.physics import Plant
from finlab.physics.effort import command_effort
from tests.any_robot import AnyRobot

TARGET = np.array([1.0, 0.5, 2.0, 0.0, 0.1, 0.1])
OBJECTIVES: list[dict[str, Any]] = [
    {"objective": "power"},
    {"objective": "effort"},
]


@pytest.mark.parametrize("options", OBJECTIVES)
def test_candidates_tell_what_the_plant_says_of_them(options: dict[str, Any]) -> None:
    method, layout = AnyRobot(**options), load_layout("penta")
    answer, plant = method.allocate(layout, TARGET), Plant(layout)
    told = answer.candidates
    assert told is not None
    np.testing.assert_allclose(told.wrench, plant.wrench(told.command), atol=1e-9)
    error = np.linalg.norm((told.wrench - TARGET) / answer.scale, axis=-1)
    np.testing.assert_allclose(told.err_norm, error, atol=1e-9)
    np.testing.assert_allclose(told.effort, command_effort(told.command, plant.upper), rtol=1e-9)
    np.testing.assert_allclose(told.power, plant.power(told.command).sum(-1), rtol=1e-9)
