"""The table's interpolation against one written out anew: uneven grids, edges, and the seam of the circle."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from finlab.physics.table import TableLaw

Array = NDArray[np.float64]
UNEVEN = np.array([-3.0, -2.5, -1.2, -0.9, 0.4, 1.9, 2.2])
"""Zero directions [rad] of which no two neighbours are equally far apart, nor those across the seam."""


def along_one_axis(axis: int, knots: Array, values: Array, periodic: bool = False) -> TableLaw:
    """A table whose horizontal force depends on one command only."""
    axes = [np.array([0.0, 1.0]) for _ in range(3)]
    axes[axis] = knots
    shape = [1, 1, 1]
    shape[axis] = len(knots)
    forces = np.zeros((*(len(a) for a in axes), 3))
    forces[..., 1] = values.reshape(shape)
    return TableLaw(axes, forces, periodic)


def asked(axis: int, at: Array) -> Array:
    command = np.full((len(at), 3), 0.5)
    command[:, axis] = at
    return command


def check(law: TableLaw, axis: int, at: Array, spline: CubicHermiteSpline, where: Array) -> None:
    force, slopes = law.force_and_slopes(asked(axis, at))
    assert force[:, 1] == pytest.approx(spline(where), abs=1e-12)
    assert slopes[:, axis, 1] == pytest.approx(spline(where, 1), abs=1e-11)
    assert law.force(asked(axis, at))[:, 1] == pytest.approx(spline(where), abs=1e-12)
    assert np.delete(slopes[..., 1], axis, axis=1) == pytest.approx(0.0, abs=1e-12)
    assert not force[:, [0, 2]].any()


def test_around_the_circle() -> None:
    """A knot's slope is that of the line through its neighbours, also where these lie across the seam."""
    values = np.random.default_rng(0).standard_normal(len(UNEVEN))
    turns = np.concatenate([UNEVEN - 2 * math.pi, UNEVEN, UNEVEN + 2 * math.pi])
    height = np.tile(values, 3)
    slope = np.gradient(np.zeros(len(turns)))
    slope[1:-1] = (height[2:] - height[:-2]) / (turns[2:] - turns[:-2])
    spline = CubicHermiteSpline(turns, height, slope)
    law = along_one_axis(2, UNEVEN, values, periodic=True)
    at = np.linspace(-3.0, -3.0 + 2 * math.pi, 400, endpoint=False)
    check(law, 2, at, spline, at)
    check(law, 2, at + 4 * math.pi, spline, at)
    check(law, 2, at - 2 * math.pi, spline, at)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("n", [2, 3, 7])
def test_between_edges(axis: int, n: int) -> None:
    """At an edge the slope is that of the last line."""
    knots = UNEVEN[:n] / 2.0
    values = np.random.default_rng(axis).standard_normal(n)
    around = np.concatenate([[0], np.arange(n), [n - 1]])
    slope = (values[around[2:]] - values[around[:-2]]) / (knots[around[2:]] - knots[around[:-2]])
    spline = CubicHermiteSpline(knots, values, slope)
    at = np.linspace(knots[0], knots[-1], 202)[1:-1]
    check(along_one_axis(axis, knots, values), axis, at, spline, at)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_beyond_an_edge_is_the_edge_without_slope(axis: int) -> None:
    knots, values = np.array([-0.5, 0.0, 1.0]), np.array([2.0, -1.0, 3.0])
    law = along_one_axis(axis, knots, values)
    force, slopes = law.force_and_slopes(asked(axis, np.array([-0.5001, -2.0, 1.0001, 3.0])))
    assert force[:, 1] == pytest.approx([2.0, 2.0, 3.0, 3.0])
    assert not slopes[:, axis].any()
    at_ends = law.force_and_slopes(asked(axis, knots[[0, 2]]))[1][:, axis, 1]
    assert at_ends == pytest.approx([-6.0, 4.0])
    if axis == 2:  # the far side of the circle belongs to the nearer end
        far = law.force(asked(2, 0.25 + math.pi + np.array([-0.01, 0.01])))
        assert far[:, 1] == pytest.approx([3.0, 2.0])


def test_axes_multiply() -> None:
    """Products of straight lines come back exactly, with the slopes of each."""
    axes = [np.array([0.0, 0.2, 0.7]), np.array([0.0, 1.0, 1.5, 2.0]), np.array([-1.0, 0.5, 1.0])]
    a, f, d = np.meshgrid(*axes, indexing="ij")
    law = TableLaw(axes, np.stack([a * f, f * d, a * f * d], axis=-1), False)
    u = np.random.default_rng(1).uniform([0.0, 0.0, -1.0], [0.7, 2.0, 1.0], (50, 3))
    force, slopes = law.force_and_slopes(u)
    (a, f, d), none = u.T, np.zeros(50)
    assert force == pytest.approx(np.stack([a * f, f * d, a * f * d], axis=-1))
    by = [[f, none, f * d], [a, d, a * d], [none, f, a * f]]
    assert slopes == pytest.approx(np.stack([np.stack(row, axis=-1) for row in by], axis=1), abs=1e-12)
