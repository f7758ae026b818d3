"""Who may move where, and who follows."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from finlab.analysis import Bounds, mirror_pairs
from finlab.analysis.moves import Moves, is_mirrored
from finlab.errors import LayoutError
from finlab.layout import Layout

Layouts = Callable[[str], Layout]
"""The type of the fixture `shipped`: a shipped robot by its name."""


def test_layout_a_is_two_pairs(shipped: Layouts) -> None:
    assert mirror_pairs(shipped("A")) == (
        ("front_right", "front_left"),
        ("back_left", "back_right"),
    )


def test_a_twin_follows_and_the_rest_stays(shipped: Layouts) -> None:
    layout = shipped("A")
    bounds = {"front_left": Bounds((0.2, 0.3), (0.1, 0.2), (0.0, 0.0), (0.5, 2.0))}
    moves = Moves(layout, ["front_left", "front_right"], bounds, mirror_pairs(layout))
    assert moves.leaders == ("front_left",)
    assert moves.names == ("front_right", "front_left")
    assert moves.lower == pytest.approx([0.2, 0.1, 0.5])  # z is held
    moved = moves.moved(np.array([0.25, 0.12, 0.7]))
    right, left, *rest = moved.fins
    assert left.position == pytest.approx((0.25, 0.12, 0.0))
    assert right.position == pytest.approx((0.25, -0.12, 0.0))
    assert (left.mounting_angle, right.mounting_angle) == pytest.approx((0.7, -0.7))
    assert is_mirrored(left, right)
    assert tuple(rest) == layout.fins[2:]


@pytest.mark.parametrize("name", ["A", "bluerov2_heavy", "turtle_hybrid", "catamaran", "torpedo"])
def test_free_actuators_can_keep_the_symmetry_there_is(shipped: Layouts, name: str) -> None:
    layout = shipped(name)
    moves = Moves(
        layout,
        layout.names,
        {actuator.name: Bounds.around(actuator) for actuator in layout.actuators},
    )
    vectors = np.random.default_rng(0).uniform(moves.lower, moves.upper, (5, len(moves.lower)))
    for vector, free in zip(moves.mirrored(vectors), vectors, strict=True):
        assert (vector >= moves.lower).all() and (vector <= moves.upper).all()
        assert (
            mirror_pairs(moves.moved(vector))
            == mirror_pairs(layout)
            != mirror_pairs(moves.moved(free))
        )


@pytest.mark.parametrize(
    ("fins", "pairs", "message"),
    [
        ([], (), "expected at least one fin to move"),
        (["nobody"], (), "has no fin 'nobody'"),
        (["back_left"], (), "bounds: .* but has none"),
        (["front_left"], (("front_left", "back_left"),), "not each other's mirror image"),
        (["front_left"], (("front_left", "front_left"),), "not each other's mirror image"),
        (
            ["front_left"],
            (("front_left", "front_right"), ("front_right", "front_left")),
            "one mirror pair",
        ),
    ],
)
def test_wrong_questions(
    shipped: Layouts, fins: list[str], pairs: tuple[tuple[str, str], ...], message: str
) -> None:
    layout = shipped("A")
    bounds = {"front_left": Bounds.around(layout.fins[1])}
    with pytest.raises(LayoutError, match=message):
        Moves(layout, fins, bounds, pairs)


@pytest.mark.parametrize("wrong", [(1.0, 0.0), (0.0, math.inf), (math.nan, 1.0)])
def test_bounds_are_checked(wrong: tuple[float, float]) -> None:
    with pytest.raises(LayoutError, match="bounds of y"):
        Bounds((0.0, 1.0), wrong, (0.0, 0.0), (0.0, 0.0))
