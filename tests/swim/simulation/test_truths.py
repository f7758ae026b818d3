"""What layouts do not say: a robot that is not built as drawn."""

import math

import numpy as np
import pytest

from finlab.errors import LayoutError
from finlab.layout import Layout, load_layout
from finlab.layout.effectiveness import own_effectiveness
from finlab.research.evaluation.experiments.hard_days import BUILT_OFF
from finlab.swim.simulation import ClosedLoop, make_trajectory, perturbed
from finlab.swim.vehicle.attitude import euler
from tests.allocator_cache import AllocatorCache


@pytest.fixture(scope="module")
def robot() -> Layout:
    """Robot A as it is drawn."""
    return load_layout("A")


def test_a_robot_built_askew_feels_its_fins_elsewhere(robot: Layout) -> None:
    true = perturbed(robot, **BUILT_OFF)
    drawn = own_effectiveness(robot)
    built = own_effectiveness(true)
    turn = np.einsum("nw,nw->n", built[:, 1, :3], drawn[:, 1, :3])
    np.testing.assert_allclose(np.degrees(np.arccos(turn)), 5.0, rtol=1e-6)
    # One newton upwards pitches about the true centre: 1.6 cm further behind, 1.2 cm to the left of
    # it.
    np.testing.assert_allclose(
        built[:, 2, 3:5] - drawn[:, 2, 3:5], np.tile([-0.012, -0.016], (4, 1)), atol=1e-12
    )


def test_a_robot_built_askew_stays_afoot(robot: Layout) -> None:
    loop = ClosedLoop(
        robot,
        AllocatorCache().on(robot),
        make_trajectory("circle"),
        truth=perturbed(robot, **BUILT_OFF),
    )
    for _ in range(120):
        loop.step()
    assert np.abs(euler(loop.state[3:7])[:2]).max() < 0.3
    assert np.linalg.norm(loop.log.position[-1] - loop.log.reference[-1]) < 0.5
    given = loop.log.allocated - loop.log.delivered
    assert np.linalg.norm(given[60:].mean(axis=0)) > 0.01


def test_what_makes_no_sense_is_refused(robot: Layout, analytic: AllocatorCache) -> None:
    for wrong in ({"damping": 0.0}, {"buoyancy": math.nan}):
        with pytest.raises(LayoutError):
            perturbed(robot, **wrong)  # type: ignore[arg-type]
    with pytest.raises(LayoutError, match="truth: expected the actuators of A"):
        ClosedLoop(robot, analytic.on(robot), make_trajectory("circle"), truth=load_layout("pair"))
