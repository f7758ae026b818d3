"""Groups of axes in order, the search over starts, and systems solved without the usual wrapper: details."""

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.forces.attainable import attainable_set
from finlab.forces.fin_sets import FinSets
from finlab.forces.out_of_reach import nearest_in_turn
from finlab.layout import Fin, Layout, Limits
from tests.forces.conftest import THRUST

Array = NDArray[np.float64]
X, Y, Z = (np.arange(6) == k for k in range(3))


def planar(effectiveness: Array, radius: Array) -> FinSets:
    """One robot of free fins."""
    n = len(radius)
    return FinSets(effectiveness[None], radius[None], np.zeros((1, n)), np.full((1, n), np.pi))


def axes_of(*pairs: tuple[int, int]) -> Array:
    """Columns (n, 2, 6) of fins that push along two axes each."""
    effectiveness = np.zeros((len(pairs), 2, 6))
    for i, pair in enumerate(pairs):
        effectiveness[i, 0, pair[0]] = effectiveness[i, 1, pair[1]] = 1.0
    return effectiveness


def test_who_gives_all_for_the_first_group_gives_nothing_to_the_next() -> None:
    """The first fin spends its 2 N on x; only the second, which does not feel x, is left for y."""
    sets = planar(axes_of((0, 1), (1, 2)), np.array([2.0, 1.0]))
    served = nearest_in_turn(sets, np.array([5.0, 3.0, 0.0, 0.0, 0.0, 0.0]), [X, ~X])
    assert served.force[0] == pytest.approx(np.array([[2.0, 0.0], [1.0, 0.0]]), abs=1e-6)
    assert served.wrench[0] == pytest.approx([2.0, 1.0, 0.0, 0.0, 0.0, 0.0], abs=1e-6)


def test_what_the_first_group_leaves_goes_to_the_next() -> None:
    """Of 2 N, 1.2 N along x leave 1.6 N along y; a third group gets what the second fin has left."""
    sets = planar(axes_of((0, 1), (1, 2)), np.array([2.0, 1.0]))
    target = np.array([1.2, 2.2, 5.0, 0.0, 0.0, 0.0])
    served = nearest_in_turn(sets, target, [X, Y, ~X & ~Y])
    assert served.wrench[0] == pytest.approx([1.2, 2.2, 0.8, 0.0, 0.0, 0.0], abs=1e-4)


def test_three_groups_out_of_reach_are_served_one_by_one() -> None:
    sets = planar(axes_of((0, 1), (1, 2), (2, 3)), np.array([2.0, 1.0, 0.5]))
    served = nearest_in_turn(sets, np.array([9.0, 9.0, 9.0, 9.0, 0.0, 0.0]), [X, Y, ~X & ~Y])
    assert served.wrench[0, :2] == pytest.approx([2.0, 1.0], abs=1e-6)
    assert np.hypot(*served.wrench[0, 2:4]) == pytest.approx(0.5, abs=1e-6)
    assert served.wrench[0, 2] == pytest.approx(served.wrench[0, 3], abs=1e-6)


@pytest.mark.parametrize("arc", [(-2.0, 2.0), (-1.5, 1.5), (-np.pi, np.pi)])
def test_one_wide_arc_makes_a_set_a_hull(arc: tuple[float, float]) -> None:
    layout = Layout("one", (Fin("a", (0.2, 0.1, 0.0), 0.7, Limits(zero_direction=arc)),))
    body = attainable_set(layout, "force", alone=False)
    assert body.hull is (arc[0] == -2.0)
    assert body.dimension == 2
    assert np.linalg.norm(body.vertices, axis=1).max() == pytest.approx(THRUST, rel=1e-9)
