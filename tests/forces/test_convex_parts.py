"""Arcs wider than half a turn, searched in their halves."""

from itertools import product

import numpy as np
import pytest

from finlab.arrays import Array
from finlab.forces.convex_parts import arcs_to_search
from finlab.forces.envelopes import layout_envelopes
from finlab.layout import load_layout
from finlab.physics.objective import Objective

FINS = layout_envelopes(load_layout("octo"), Objective())


def arcs_of(half: list[float], n_seeds: int = 1) -> tuple[Array, Array] | None:
    return arcs_to_search(FINS.within(np.linspace(-2.0, 2.0, len(half)), np.array(half)), n_seeds)


@pytest.mark.parametrize("half", [[np.pi] * 8, [0.3] * 8, [0.5 * np.pi] * 8, [np.pi, 0.5 * np.pi] * 4])
def test_convex_sets_are_searched_whole(half: list[float]) -> None:
    assert arcs_of(half) is None


def test_the_parts_are_all_combinations_of_halves() -> None:
    found = arcs_of([np.pi, 2.0, 1.0, 2.4, np.pi, np.pi, np.pi, np.pi])
    assert found is not None
    own = np.linspace(-2.0, 2.0, 8)
    middle, half = found
    assert middle.shape == half.shape == (5, 8)
    np.testing.assert_array_equal(middle[0], own)
    np.testing.assert_array_equal(half[0, [1, 2, 3]], [2.0, 1.0, 2.4])
    # Each half begins at one end of the arc and ends at its middle, and is convex.
    np.testing.assert_array_equal(half[1:, [1, 3]], np.tile([1.0, 1.2], (4, 1)))
    assert {tuple(row) for row in (middle[1:, [1, 3]] - own[[1, 3]]).round(12)} == set(
        product((-1.0, 1.0), (-1.2, 1.2))
    )
    others = [0, 2, 4, 5, 6, 7]
    np.testing.assert_array_equal(middle[:, others], np.tile(own[others], (5, 1)))
    np.testing.assert_array_equal(half[:, others], np.tile(half[0, others], (5, 1)))
