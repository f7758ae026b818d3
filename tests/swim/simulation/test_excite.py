"""The manoeuvre that robots are learned from: within its bounds, and rich enough."""

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.errors import DataError, FinlabError
from finlab.layout import Layout, load_layout
from finlab.swim.simulation import RunLog
from finlab.swim.simulation.excite import BOUNDS, Exciting, excitation
from finlab.swim.vehicle.attitude import euler
from tests.terminal import refused


@pytest.fixture(scope="module", params=["A", "penta"])
def swim(request: pytest.FixtureRequest) -> RunLog:
    """A minute of the manoeuvre."""
    return excitation(load_layout(request.param), 60.0, seed=3).run()


def test_depth_attitude_and_place_stay_within_bounds(swim: RunLog) -> None:
    away = np.abs(swim.position - swim.position[0]).max(axis=0)
    assert np.hypot(away[0], away[1]) < BOUNDS[0] and away[2] < BOUNDS[1]
    assert np.abs(euler(swim.quaternion)[:, :2]).max() < BOUNDS[2]


def test_every_axis_and_every_fin_is_varied(swim: RunLog) -> None:
    layout = load_layout(swim.layout)
    assert (swim.delivered.std(axis=0) > [1.0, 0.5, 1.0, 0.1, 0.2, 0.2]).all()
    assert (swim.motion.std(axis=0) > [0.03, 0.005, 0.01, 0.03, 0.05, 0.05]).all()
    for i in range(layout.n_fins):
        command = swim.command[:, i]
        assert np.ptp(command[:, 0]) > 0.3 and np.ptp(command[:, 1]) > 1.0
        counts, _ = np.histogram(command[:, 2], bins=4, range=(-np.pi, np.pi))
        assert counts.min() > 10
        # Amplitude and frequency are no function of each other, or the law of the fin could not be
        # told.
        assert abs(np.corrcoef(command[:, 0], command[:, 1])[0, 1]) < 0.8
    force = swim.force.reshape(len(swim.time), -1)
    assert np.linalg.matrix_rank(force - force.mean(axis=0), tol=1.0) >= min(
        force.shape[1], 2 * layout.n_fins
    )


def test_commands_give_the_wrench_where_the_fins_can() -> None:
    layout = load_layout("A")
    allocator = Allocator(layout, Exciting, seed=1)
    target = np.array([2.0, 0.5, -1.0, 0.05, 0.1, 0.1])
    answers = [allocator.allocate(target) for _ in range(50)]
    missed = [np.linalg.norm((answer.wrench - target)[:3]) for answer in answers]
    assert np.median(missed) < 0.5
    assert len({round(answer.command[0, 0], 3) for answer in answers}) > 1


def test_what_cannot_be_shaken_is_refused() -> None:
    layout: Layout = load_layout("A")
    with pytest.raises(FinlabError, match="rudders of layout torpedo give nothing on the spot"):
        excitation(load_layout("torpedo"), 60.0)
    with pytest.raises(DataError, match="30 to 300 s, got 301"):
        excitation(layout, 301.0)
    error = refused(["simulate", "A", "--excite", "--lost", "front_left@3"])
    assert (
        "leave --controller, --lost, --torn, --stuck, --whole, --monitor and --learn out" in error
    )
