"""The tour, the list of commands, and damage that is less than a failure."""

from typing import Any

import numpy as np
import pytest

from finlab.physics import Plant
from webapp.markup.first_sight import tell
from webapp.markup.words import small
from webapp.scene.wrench_nodes import NUMBER_AT


def test_the_tour_sets_each_stop_and_brings_the_work_back(page: Any) -> None:
    page.type("Fy [N]", "0.5")
    page.until(lambda: page.session.state.target[1] == 0.5)
    page.tab("Improve")
    page.key("2")
    mine, camera = page.session.state, page.view.scenery.robot.camera
    page.press("Tour")
    page.until(lambda: "1 of 6" in page.text(".tour"))
    assert page.session.state.target[1] == 0.0
    for stop in range(2, 5):
        page.press("Next")
        page.until(lambda stop=stop: f"{stop} of 6" in page.text(".tour"))
        page.until(lambda: not page.view.busy)
    page.press("Next")
    page.until(lambda: len(page.view.swimming.swimmers) == 1 and page.view.swimming.time > 0.3)
    page.visible("/robot", False)
    page.until(lambda: "off the path" in page.text(".fl-status"))
    page.press("Next")
    page.until(lambda: not page.view.swimming.active)
    page.visible("/robot")
    page.until(lambda: "6 of 6 fins" in page.text(".fl-status"))
    page.press("Finish")
    page.until(lambda: page.session.state == mine and not page.session.guided)
    assert page.session.drawer == "Improve" and page.session.history.undo_name == "Set Fy"
    back = page.view.scenery.robot.camera
    page.until(lambda: np.allclose(back, camera, atol=1e-3))
    assert page.problems == []


def test_the_refinement_is_played_and_any_step_is_seen_again(page: Any) -> None:
    page.until(lambda: not page.view.busy and len(page.view.answering.modes.shown) > 1)
    page.page.locator("table.modes tr.pick").nth(1).click()
    page.until(lambda: page.session.mode == 1)
    page.press("Play the refinement")
    rows = page.page.locator("table.way tr.pick")
    page.until(lambda: rows.count() == 4 and "chosen" in rows.nth(3).get_attribute("class"))
    assert "Mode 2" in rows.nth(3).inner_text()
    rows.nth(1).click()
    page.until(lambda: "Search, step 1" in page.text(".fl-status .pill"))
    step = page.view.shown
    missing = (step.target - Plant(step.layout).wrench(step.command)) / step.sigma
    assert small(float(np.linalg.norm(missing))) in rows.nth(1).inner_text()
    page.until(lambda: page.text(".fl-status .err") == rows.nth(1).locator("td").nth(2).inner_text())
    page.page.locator("table.modes tr.pick").nth(0).click()
    rows.first.wait_for(state="hidden")
    assert page.problems == []


def test_a_command_is_found_by_its_words(page: Any) -> None:
    page.key("Control+k")
    box = page.page.get_by_placeholder("Search commands")
    box.wait_for()
    box.fill("heave alone")
    page.page.get_by_text("Ask for heave alone").wait_for()
    page.page.keyboard.press("Enter")
    page.until(lambda: page.session.state.target[2] != 0.0 and page.session.state.target[0] == 0.0)
    box.wait_for(state="hidden")
    page.key("n")
    page.key("x")
    page.until(lambda: page.session.state.failed == ("front_right",))
    page.key("Control+z")
    page.until(lambda: page.session.state.failed == ())


def test_keys_typed_while_the_list_of_commands_opens_are_its_own(page: Any) -> None:
    display = page.session.display
    page.page.evaluate("document.activeElement?.blur()")
    page.page.keyboard.press("Control+k")
    page.page.keyboard.type("preset nmx")  # shortcuts all: freeze, swim, tour, next fin, mirror, fail
    box = page.page.get_by_placeholder("Search commands")
    box.wait_for()
    page.until(lambda: box.input_value() == "preset nmx")
    page.page.keyboard.press("Escape")
    box.wait_for(state="hidden")
    page.catch_up()
    assert page.session.selected is None and page.session.state.failed == ()
    assert page.session.display == display
    page.page.keyboard.press("Control+k")
    page.page.keyboard.type("heave alone")
    page.page.keyboard.press("Enter")
    page.until(lambda: page.session.state.target[2] != 0.0 and page.session.state.target[0] == 0.0)
    box.wait_for(state="hidden")


def test_a_weak_and_stuck_fin_is_told_and_mended(page: Any) -> None:
    page.tab("Damage a fin")
    page.choose("Which fin", "back_left")
    page.until(lambda: page.session.selected == "back_left")
    page.type("Strength [%]", "50")
    page.until(lambda: page.session.state.weak == (("back_left", 0.5),))
    page.row("Stuck").first.click()
    page.until(lambda: page.session.state.stuck == (("back_left", 0.0),))
    page.until(lambda: "weak 50 %, stuck at 0°" in page.text(".damage"))
    page.until(lambda: not page.view.busy and page.view.shown.command[2, 2] == 0.0)
    page.page.reload()
    page.ready()
    page.until(lambda: "weak 50 %, stuck at 0°" in page.text(".damage"))
    page.tab("Damage a fin")
    page.press("All fins")
    page.until(lambda: page.session.state.health is None)
    page.page.locator(".damage").wait_for(state="detached")


@pytest.mark.parametrize("size", [(1400, 860), (900, 700)], ids=lambda size: f"{size[0]}x{size[1]}")
def test_no_card_lies_over_the_robot(page: Any, size: tuple[int, int]) -> None:
    before = page.page.viewport_size
    page.page.set_viewport_size({"width": size[0], "height": size[1]})
    for word, seen in (("tour,", ".fl-tour"), ("lesson,two-ways", ".fl-lesson")):
        page.page.evaluate(f"() => {{ {tell(word)} }}")
        page.page.locator(seen).wait_for()
        page.until(lambda seen=seen: _apart(page, seen, "canvas[data-engine]"))
        page.until(
            lambda: _is_free(page), told=lambda: "the number of the torque lies under the camera's bar"
        )
    page.page.locator(".fl-lesson button").last.click()
    page.until(lambda: not page.session.guided)
    page.page.set_viewport_size(before)


def _is_free(page: Any) -> bool:
    """Whether the number of the torque can be read."""
    (x, y), bar = page.pixel("/robot/wrench", NUMBER_AT), page.page.locator(".fl-camera").bounding_box()
    return bool(x < bar["x"] or y - 30 > bar["y"] + bar["height"])


def _apart(page: Any, one: str, other: str) -> bool:
    """Whether two elements share nothing."""
    a, b = (page.page.locator(name).bounding_box() for name in (one, other))
    return bool(a["x"] + a["width"] <= b["x"] or b["x"] + b["width"] <= a["x"])


def test_a_link_opens_a_lesson_that_sees_when_its_task_is_done(page: Any, served: Any) -> None:
    page.session.show_drawer("Comparison")
    mine, desk = page.session.state, page.session.desk
    page.page.goto(f"{served.url}&lesson=two-ways")
    page.ready()
    page.until(lambda: "One wrench, several ways" in page.text(".fl-lesson"))
    page.until(lambda: not page.view.busy and len(page.view.answering.modes.shown) > 1)
    assert "○" in page.text(".fl-lesson") and page.session.state.objective == "effort"
    page.page.locator("table.modes tr.pick").nth(1).click()
    page.until(lambda: "✓" in page.text(".fl-lesson"))
    assert "the green arrows did not" in page.text(".fl-lesson")
    page.press("Next lesson")
    page.until(lambda: "Watts are not effort" in page.text(".fl-lesson"))
    page.choose("Keep least", "power")
    page.until(lambda: "✓" in page.text(".fl-lesson"))
    page.press("Close")
    page.until(lambda: not page.session.guided and page.session.state == mine)
    assert page.session.desk == desk
    page.page.reload()
    page.ready()
    page.catch_up()
    assert not page.session.guided and page.session.state == mine, "the address asks for it no more"
    assert page.problems == []
