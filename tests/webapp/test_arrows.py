"""Arrows stand clear of what gives their forces, are framed by their outlines, and fit the view."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import viser

from finlab import Allocator
from finlab.allocation.allocation import Allocation
from finlab.assets import shipped_layouts
from finlab.layout import load_layout
from finlab.swim.hull import hull_of
from tests.webapp.stand_in import Recorded, SilentClient
from webapp.markup.words import html
from webapp.panels.status import corner, in_unit, scale_words
from webapp.scene.actuator_node import _moving, shape_of
from webapp.scene.actuator_shapes import SHORTEST
from webapp.scene.force_nodes import ForceNodes
from webapp.scene.outline import HEAD_LENGTH, HEAD_RADIUS, Outline
from webapp.scene.stage import arrow_size, part_size
from webapp.scene.wrench_nodes import (
    ACTUATOR_ARROWS,
    ARROWS,
    LENGTH,
    Scale,
    WrenchNodes,
    fitting_scale,
    fixed_scale,
)
from webapp.session.state import State
from webapp.viser_internals import start_server, stop_server

ONE = Scale(1.0, 1.0, 1.0)


def test_two_actuators_at_one_place_leave_the_others_their_size() -> None:
    layout = load_layout(shipped_layouts()["ucat"])
    first = layout.actuators[0]
    twin = replace(first, name="twin")
    assert part_size(replace(layout, actuators=(*layout.actuators, twin))) == part_size(layout)
    x, y, z = first.position
    beside = replace(twin, position=(x, y, z + 0.06))
    assert part_size(replace(layout, actuators=(*layout.actuators, beside))) == pytest.approx(0.5)


@pytest.mark.parametrize("name", ["ucat", "octo", "bluerov2", "catamaran", "torpedo", "fish"])
def test_arrows_begin_outside_of_what_gives_the_force(name: str) -> None:
    layout = load_layout(shipped_layouts()[name])
    size = part_size(layout)
    nodes: Any = ForceNodes(Recorded())  # type: ignore[arg-type]
    nodes.place(layout, hull_of(layout), (size, arrow_size(layout)))
    for direction in np.random.default_rng(3).normal(size=(20, 3)):
        forces = []
        for actuator in layout.actuators:  # across a fin's shaft, along a thruster's axis
            frame = np.array(actuator.frame)
            is_across = actuator.KIND.drawn_as in ("fin", "foil")
            force = direction - frame[0] * (direction @ frame[0]) if is_across else frame[0]
            forces.append(0.15 * force / np.linalg.norm(force))
        vectors = np.array(forces)
        starts = nodes._clear_starts(vectors)
        for k, actuator in enumerate(layout.actuators):
            if actuator.KIND.drawn_as not in ("fin", "foil"):
                off = np.linalg.norm(starts[k] - layout.position[k])
                assert off > 0.5 * 0.046 * size, "beyond the duct"
                continue
            slenderness, scale = shape_of(actuator, size)
            blade = scale * _moving(actuator.KIND.drawn_as, slenderness).vertices[:, 0]
            own = (starts[k] - layout.position[k]) @ np.array(actuator.frame[0])
            assert own > blade.max() or own < blade.min(), f"beside the blade of {actuator.name}"


def test_an_arrow_that_would_end_in_the_hull_ends_at_its_actuator() -> None:
    layout = load_layout(shipped_layouts()["ucat"])
    hull = hull_of(layout)
    nodes: Any = ForceNodes(Recorded())  # type: ignore[arg-type]
    nodes.place(layout, hull, (1.0, 1.0))
    inward = -0.5 * nodes._outward
    starts = nodes._clear_starts(inward)
    assert not hull.contains(starts + inward).any() and not hull.contains(starts).any()
    np.testing.assert_allclose(starts + inward, nodes._starts, atol=1e-9)
    outward = 0.5 * nodes._outward
    np.testing.assert_allclose(nodes._clear_starts(outward), nodes._starts, atol=1e-9)


def test_an_outline_is_one_margin_outside_of_its_arrow() -> None:
    scene = Recorded()
    outline: Any = Outline(scene, "/outline", 0.01, 0.003, (0, 0, 0))  # type: ignore[arg-type]
    starts = np.array([[0.1, 0.2, 0.3], [0.0, 0.0, 0.0]])
    vectors = np.array([[0.2, 0.0, 0.0], [0.0, 0.0, 0.0]])
    outline.show(starts, vectors, 2.0)
    node = outline.node
    assert node.visible and node.points.shape == (1, 2, 3) and node.scale == 2.0
    ends = node.scale * node.points[0, :, 0]
    margin = 2.0 * 0.003
    radius = 2.0 * 0.01
    assert ends[0] == pytest.approx(0.1 - margin, abs=2e-4)
    assert node.scale * node.shaft_radius == pytest.approx(radius + margin)
    length = node.scale * node.head_length
    head = HEAD_LENGTH * radius
    assert ends[1] - length == pytest.approx(0.3 - head - margin, abs=3e-4)
    # Distance of the tip of the arrow from the side of the cone about it.
    half = math.atan2(HEAD_RADIUS, HEAD_LENGTH)
    assert math.atan2(node.scale * node.head_radius, length) == pytest.approx(half, abs=1e-9)
    assert (ends[1] - 0.3) * math.sin(half) == pytest.approx(margin, abs=3e-4)
    outline.show(starts, 0.0 * vectors, 2.0)
    assert not node.visible


def test_outlines_follow_their_arrows_by_a_script() -> None:
    server = start_server()
    outline: Any = Outline(server.scene, "/halo", 0.01, 0.003, (0, 0, 0))
    starts = np.zeros((1, 3))
    first = outline.show(starts, np.array([[0.2, 0.0, 0.0]]), 1.0)
    assert first == "", "told by a message"
    script = outline.show(starts, np.array([[0.3, 0.0, 0.0]]), 1.0)
    assert script.startswith('finlabFrames.point("/halo",')
    assert f"{float(outline.node.points[0, 1, 0]):.4f}" in script
    again = outline.show(starts, np.array([[0.3, 0.0, 0.0]]), 1.0)
    assert again == "", "the page knows"
    stop_server(server)


def test_what_is_asked_frames_what_is_delivered() -> None:
    nodes: Any = WrenchNodes(Recorded())  # type: ignore[arg-type]
    wrench = [1.0, 0.5, 0.0, 0.0, 0.0, 0.2]
    nodes.refresh(wrench, wrench, [0.0] * 6, 0.1, 0.1, 0.1, 1.0)
    outline = nodes._asked_force.node
    arrow = nodes._forces.node
    assert outline.visible and arrow.visible
    assert outline.shaft_radius > arrow.shaft_radius and outline.head_radius > arrow.head_radius


def answer_of(name: str, wrench: tuple[float, ...]) -> Allocation:
    """The answer of a shipped robot."""
    answer: Allocation = Allocator(load_layout(shipped_layouts()[name])).allocate(wrench)
    return answer


@pytest.mark.parametrize(
    ("name", "wrench"),
    [
        ("ucat", (1.2, 0.0, 0.0, 0.0, 0.0, 0.25)),
        ("bluerov2_heavy", (90.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
        ("octo", (0.2, 0.0, 0.0, 0.0, 0.0, 0.0)),
    ],
)
def test_arrows_of_actuators_and_of_the_wrench_both_fit(
    name: str, wrench: tuple[float, ...]
) -> None:
    answer = answer_of(name, wrench)
    scale = fitting_scale(wrench, answer, ONE)
    longest = LENGTH * np.linalg.norm(answer.forces, axis=1).max() / scale.actuator
    assert ACTUATOR_ARROWS[0] <= longest <= ACTUATOR_ARROWS[1]
    assert ARROWS[0] <= LENGTH * wrench[0] / scale.newtons <= ARROWS[1]
    assert fitting_scale(wrench, answer, scale) == scale, "it rests"


@pytest.mark.parametrize("name", ["ucat", "fish", "turtle_hybrid", "bluerov2"])
def test_a_robot_at_rest_has_no_arrows_and_no_figures_of_noise(name: str) -> None:
    rest = (0.0,) * 6
    answer = answer_of(name, rest)
    scale = fitting_scale(rest, answer, ONE)
    assert scale == ONE, "what fins give that idle sets no scale"
    longest = LENGTH * np.linalg.norm(answer.forces, axis=1).max() / scale.actuator
    assert longest < SHORTEST
    shown = corner(State(answer.layout, target=rest), "", answer, False, None)
    assert "≤ 0.001" in shown and "e−" not in shown.partition("</b>")[2] and "Exact" in shown


def test_a_fixed_scale_does_not_know_the_answer() -> None:
    scale = fixed_scale([23.0, 13.0, 26.0, 4.0, 6.0, 6.0], 6.7, ONE)
    assert LENGTH * 26.0 / scale.newtons <= ARROWS[1]
    assert LENGTH * 6.7 / scale.actuator <= ACTUATOR_ARROWS[1]


def test_large_forces_are_in_thousands() -> None:
    assert in_unit(2000.0, "N") == "2 kN" and in_unit(500.0, "N m") == "500 N m"
    words = scale_words(Scale(5000.0, 200.0, 0.5), 3.0)
    for part in ("0.3 m = 5 kN", "ring 200 N m", "actuator 0.5 N"):
        assert html("{}", part) in words


def test_outlines_are_nodes_of_viser() -> None:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    client: Any = SilentClient(server)
    outline = Outline(client.scene, "/outline", 0.01, 0.003, (1, 2, 3))
    outline.show(np.zeros((1, 3)), np.array([[0.0, 0.2, 0.0]]), 1.0)
    outline.paint((9, 8, 7))
    outline.show(np.zeros((1, 3)), np.array([[0.0, 0.2, 0.0]]), 1.0)
    assert outline.node.visible and outline.node.colors.tolist() == [[9, 8, 7]]
    assert outline.node.points.shape == (1, 2, 3)
    server.stop()
