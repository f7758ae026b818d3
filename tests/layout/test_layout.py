"""Layouts as values: names, losses, changes; and as padded arrays."""

import math
from itertools import chain

import numpy as np
import pytest

from finlab.errors import LayoutError
from finlab.layout import Fin, Layout, Limits, layout_effectiveness
from finlab.layout.effectiveness import force_effectiveness
from finlab.research.random_layouts import TRAINING_BOX, random_layout

THREE_FINS = Layout(
    "three",
    tuple(Fin(name, (0.1 * i, 0.2, -0.1), 0.5 * i) for i, name in enumerate(["a", "b", "c"])),
)
"""A robot of three fins."""


def test_fins_are_found_by_name_and_an_unknown_name_lists_those_there_are():
    assert THREE_FINS.names == ("a", "b", "c")
    assert THREE_FINS.index("b") == 1
    assert THREE_FINS.indices(["c", "a"]) == (2, 0)
    with pytest.raises(LayoutError, match="layout three has no fin 'nobody', it has a, b, c"):
        THREE_FINS.index("nobody")


def test_without_leaves_the_rest_in_order_and_never_nothing():
    assert THREE_FINS.without(["b"]).names == ("a", "c")
    assert THREE_FINS.without([]) == THREE_FINS
    assert THREE_FINS.n_fins == 3
    with pytest.raises(LayoutError, match="no fin left"):
        THREE_FINS.without(["a", "b", "c"])
    with pytest.raises(LayoutError, match="no fin 'x'"):
        THREE_FINS.without(["x"])


def test_layouts_are_values():
    moved = THREE_FINS.replace_actuator("b", position=(0.3, 0.0, 0.0))
    assert moved.fins[1].position == (0.3, 0.0, 0.0)
    assert THREE_FINS.fins[1].position == (0.1, 0.2, -0.1)
    assert hash(THREE_FINS) == hash(Layout("three", THREE_FINS.fins))
    with pytest.raises(LayoutError, match="already the name"):
        THREE_FINS.replace_actuator("b", name="a")


def test_numpy_numbers_become_plain_ones():
    fin = Fin("f", np.array([0.1, 0.2, 0.3]), np.float64(1.0), Limits(np.array([0.1, 0.2])))
    assert all(
        type(value) is float for value in (*fin.position, fin.mounting_angle, *fin.limits.amplitude)
    )


def test_force_columns_are_force_and_moment_of_a_newton():
    rng = np.random.default_rng(0)
    position = rng.normal(size=(7, 3, 3))
    angle = rng.uniform(-4, 4, (7, 3))
    columns = force_effectiveness(position, angle)
    assert columns.shape == (7, 3, 3, 6)
    for b in range(7):
        for i in range(3):
            c = math.cos(angle[b, i])
            s = math.sin(angle[b, i])
            for k, axis in enumerate(np.array([(c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)])):
                expected = np.concatenate([axis, np.cross(position[b, i], axis)])
                np.testing.assert_allclose(columns[b, i, k], expected, atol=1e-14)


def test_layout_effectiveness_sets_the_blocks_side_by_side():
    matrix = layout_effectiveness(THREE_FINS)
    assert matrix.shape == (6, 6)
    np.testing.assert_array_equal(matrix[:, 5], [0, 0, 1, 0.2, -0.2, 0])


def test_random_layouts_keep_to_box_counts_and_limits():
    rng = np.random.default_rng(0)
    layouts = [random_layout(rng, limits="varied") for _ in range(1200)]
    assert {layout.n for layout in layouts} == {2, 3, 4, 5}
    fins = chain.from_iterable(layout.fins for layout in layouts)
    assert all((np.abs(fin.position) <= TRAINING_BOX).all() for fin in fins)
    upper, lower = (
        np.concatenate([getattr(layout, end) for layout in layouts]) for end in ("upper", "lower")
    )
    assert 0.3 <= upper[:, 0].min() < 0.31 and 0.79 < upper[:, 0].max() <= 0.8
    assert 1.0 <= upper[:, 1].min() < 1.02 and 2.98 < upper[:, 1].max() <= 3.0
    width = upper[:, 2] - lower[:, 2]
    arc = width < 2 * math.pi - 1e-9
    assert arc.mean() == pytest.approx(1 / 3, abs=0.03)
    assert width[arc].min() >= math.pi / 2 - 1e-9 and width[arc].max() <= 1.5 * math.pi + 1e-9
    assert (np.abs(upper[:, 2]) <= math.pi + 1e-9).all() and (
        np.abs(lower[:, 2]) <= math.pi + 1e-9
    ).all()


def test_random_layouts_outside_a_box_have_a_fin_there():
    rng = np.random.default_rng(1)
    for _ in range(200):
        layout = random_layout(rng, n_fins=(6, 8), box=(0.45, 0.45, 0.2), outside=TRAINING_BOX)
        assert 6 <= layout.n <= 8 and (np.abs(layout.position) > np.array(TRAINING_BOX)).any()


def test_a_random_layout_is_seeded():
    layout = random_layout(np.random.default_rng(3), n_fins=4, limits="varied")
    assert layout == random_layout(np.random.default_rng(3), n_fins=4, limits="varied")
    assert layout.names == ("fin_1", "fin_2", "fin_3", "fin_4")
