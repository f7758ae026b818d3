"""The solver of three actuators in the examples, against the library and against own judges."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import finlab
from tests.oracle_optima import lower_bound
from tests.oracle_plant import OraclePlant
from tests.random_robots import T200, T200_FORCE, layout_of, load

PATH = Path(__file__).resolve().parents[2] / "examples" / "12_three_actuators.py"
"""The example under test."""
ROBOT = layout_of(
    "three",
    [
        {
            "name": "left",
            "type": "thruster",
            "position_m": [-0.8, 0.4, 0.0],
            "axis": [1.0, 0.0, 0.0],
        }
        | {"force_n": T200_FORCE, "model": T200},
        {
            "name": "right",
            "type": "thruster",
            "position_m": [-0.8, -0.4, 0.0],
            "axis": [1.0, 0.0, 0.0],
        }
        | {"force_n": T200_FORCE, "model": T200},
        {
            "name": "bow",
            "type": "azimuth",
            "position_m": [0.9, 0.0, 0.0],
            "turn_axis": [0.0, 0.0, 1.0],
        }
        | {"zero": [1.0, 0.0, 0.0], "force_n": [0.0, T200_FORCE[1]], "model": T200},
    ],
)
"""The three actuators of the example, as a layout file says them."""


@pytest.mark.parametrize("seed", range(10))
def test_least_watts_of_three_actuators(seed: int) -> None:
    plant = OraclePlant(ROBOT)
    rng = np.random.default_rng(seed)
    wrench = plant.wrench(plant.draw(rng, float(rng.uniform(0.2, 1.0))))
    force, watts, bound = runpy.run_path(str(PATH))["solve"](wrench[[0, 1, 5]])
    np.testing.assert_allclose(plant.effectiveness @ force, wrench, atol=1e-8)
    assert lower_bound(plant, wrench) == pytest.approx(watts, rel=1e-6)
    assert bound == pytest.approx(watts, rel=1e-9)
    result = finlab.Allocator(load(ROBOT)).allocate(wrench)
    assert result.power == pytest.approx(watts, rel=1e-6)
