"""Open axes are filled with what the fins give along with the wanted ones."""

import numpy as np
import pytest

from finlab.assets import shipped_layouts
from finlab.layout import Layout, load_layout
from finlab.layout.effectiveness import layout_effectiveness
from finlab.swim.control import Completion

AXES = ("Fx", "Fz", "Tz")
"""Axes that a controller asks for."""
WANTED_INDICES = [0, 2, 5]
"""Their indices in a wrench."""


def shipped(name: str) -> Layout:
    """A shipped robot by its name."""
    return load_layout(shipped_layouts()[name])


@pytest.mark.parametrize("name", ["A", "B", "C", "D"])
def test_the_papers_layouts_hold_the_open_axes_at_zero(name: str) -> None:
    complete = Completion(shipped(name), (), AXES)
    assert complete.controllable
    wrench = np.array([4.0, 9.0, 1.0, 9.0, 9.0, 0.3])
    np.testing.assert_allclose(complete(wrench), [4.0, 0, 1.0, 0, 0, 0.3], atol=1e-9)


@pytest.mark.parametrize("name", ["A", "B", "C", "D"])
def test_any_one_fin_lost_leaves_them_controllable_and_the_target_reachable(name: str) -> None:
    robot = shipped(name)
    for fin in robot.names:
        complete = Completion(robot, (fin,), AXES)
        assert complete.controllable, fin
        wrench = np.array([4.0, 0, 1.0, 0, 0, 0.3])
        full = complete(wrench)
        np.testing.assert_allclose(full[WANTED_INDICES], wrench[WANTED_INDICES], atol=1e-9)
        planar = layout_effectiveness(robot.without([fin]))
        rest = full - planar @ np.linalg.lstsq(planar, full, rcond=None)[0]
        np.testing.assert_allclose(rest, 0.0, atol=1e-8)


def test_open_axes_are_as_small_as_they_can_be() -> None:
    """Against a search over all forces that give the wanted axes exactly."""
    robot = shipped("A")
    lost = ("front_left", "front_right")
    wrench = np.array([3.0, 0, 0.8, 0, 0, 0.2])
    full = Completion(robot, lost, AXES)(wrench)
    planar = layout_effectiveness(robot.without(lost))
    scale = np.array([1, 1, 1, 4, 4, 4])

    def size(w: np.ndarray) -> float:
        return float(np.linalg.norm((w * scale)[[1, 3, 4]]))

    particular = np.linalg.lstsq(planar[WANTED_INDICES], wrench[WANTED_INDICES], rcond=None)[0]
    null = np.linalg.svd(planar[WANTED_INDICES])[2][3:].T
    rng = np.random.default_rng(0)
    others = [size(planar @ (particular + null @ (5 * rng.standard_normal(1)))) for _ in range(500)]
    assert size(full) <= min(others) + 1e-9
