"""The body from its hull, typed over, forgotten; and distances measured in the view. All with real keys."""

import math
from typing import Any

import pytest

from tests.browser.test_inspector_flow import typed

HALF = (0.25, 0.15, 0.1)
"""Half axes of the ellipsoid that a new robot has [m]."""


def shown(page: Any, label: str) -> list[float]:
    """The numbers in the boxes of a row."""
    boxes = page.row(label)
    return [float(boxes.nth(k).input_value()) for k in range(boxes.count())]


def test_a_body_is_estimated_from_its_hull_and_typed_over(page: Any) -> None:
    session = page.session
    page.tab("Design")
    page.press("New")
    page.until(lambda: session.state.layout.name == "New robot")
    page.page.locator(".fin-list [data-press=robot]").click()
    page.page.get_by_text("Not said: mass").wait_for()

    page.press("All")
    page.until(lambda: session.history.undo_name == "Estimate mass and damping from the hull")
    page.page.get_by_text("It is neutral.").wait_for()
    a, b, c = HALF
    mass = 1000.0 * 4.0 / 3.0 * math.pi * a * b * c
    solid = [mass / 5.0 * (u * u + v * v) for u, v in ((b, c), (a, c), (a, b))]
    page.until(lambda: shown(page, "Mass [kg]") == pytest.approx([mass], rel=0.03))
    page.until(lambda: shown(page, "Inertia [kg m²]") == pytest.approx(solid, rel=0.05))
    page.until(lambda: shown(page, "Buoyancy [N]") == pytest.approx([9.81 * mass], rel=0.03))
    surge, sway, heave = shown(page, "Added mass [kg]")
    assert 0.1 * mass < surge < sway < heave < 2.0 * mass, "the flatter it is to the way, the more water"
    assert all(value > 0.0 for value in shown(page, "Drag ∝ v² [N s²/m²]"))

    typed(page, "Mass [kg]", "2*9 kg")
    page.until(lambda: session.state.layout.body.mass_kg == 18.0)
    page.press("Buoyancy")  # until now it went with the mass
    page.page.get_by_text("It sinks with 2.").wait_for()
    typed(page, "Mass [kg]", "-3")
    page.page.locator(".fl.missing:visible, .fl .missing:visible", has_text="mass").first.wait_for()
    assert session.state.layout.body.mass_kg == 18.0, "what is refused changes nothing"
    page.page.keyboard.press("Escape")
    page.press("Forget")
    page.until(
        lambda: session.state.layout.body.mass_kg is None and session.state.layout.body.hull is not None
    )
    page.page.get_by_text("Not said: mass").wait_for()


def test_a_distance_is_measured_between_two_fins(page: Any) -> None:
    page.look_from_above()
    page.key("l")
    page.until(lambda: page.session.display.measure)
    page.catch_up()  # the page listens to clicks once it has been told to
    rule = page.view.scenery.robot._measure
    label = rule._label
    roots = [fin.position for fin in page.session.state.layout.fins[:2]]
    for count, place in enumerate(roots, start=1):
        page.page.mouse.click(*page.pixel("/robot", place))
        page.until(lambda count=count: len(rule._places) == count)
    page.visible("/measure/line")
    across = math.dist(*roots)
    assert (
        label.text.startswith(f"{across:.3f} m") and f"y {abs(roots[0][1] - roots[1][1]):.3f}" in label.text
    )
    page.page.mouse.click(*page.pixel("/robot", roots[0]))
    page.visible("/measure/line", False)  # the next click begins anew
    page.key("l")
    page.until(lambda: not page.session.display.measure)
    page.visible("/measure/ends", False)
