"""Pull the wrench in the view, nudge by keys, push a gamepad, present, and follow another page."""

import math
from types import SimpleNamespace
from typing import Any

import pytest

from webapp.scene.wrench_handle import RING_SIZE, TIP_SIZE

COUNT_SCRIPT = """() => {
  const send = window.__viserMutable.sendMessage;
  window.sentAt = [];
  window.__viserMutable.sendMessage = (message) => {
    if (message.type.startsWith('TransformControls')) window.sentAt.push(performance.now());
    send(message);
  };
}"""
"""Script: keeps when the page sends a message of a drag."""
PAD_SCRIPT = """() => {
  const buttons = Array.from({ length: 17 }, () => ({ value: 0 }));
  window.pad = { id: 'Test pad', connected: true, axes: [0, 0, 0, 0], buttons };
  navigator.getGamepads = () => [window.pad];
}"""
"""Script: a gamepad that nobody holds."""


def test_the_tip_of_the_wrench_is_dragged(page: Any) -> None:
    session = page.session
    page.visible("/robot/wrench/tip")
    page.page.evaluate(COUNT_SCRIPT)
    before = session.state.target
    steps_before = len(session.history.past)
    handle = 0.7 * TIP_SIZE
    start = page.pixel("/robot/wrench/tip", (handle, 0.0, 0.0))
    end = page.pixel("/robot/wrench/tip", (handle + 0.2, 0.0, 0.0))
    with page.held(start, end):
        page.until(lambda: session.state.target[0] > 2.0 * before[0] and not page.view.busy)
        assert session.state.target[1:] == before[1:]
        page.until(lambda: f"{session.state.target[0]:+.2f}" in page.text(".bars"))
    page.until(lambda: page.view.scenery.robot.pulled is None)
    assert session.history.undo_name == "Pull the wrench"
    assert len(session.history.past) == steps_before + 1
    sent = page.page.evaluate("window.sentAt")
    for k in range(len(sent) - 20):
        assert sent[k + 20] - sent[k] > 900.0, "more than 20 messages in a second"
    page.key("Control+z")
    page.until(lambda: session.state.target == before)
    assert page.problems == []


def test_a_ring_of_the_wrench_is_turned(page: Any) -> None:
    session = page.session
    page.visible("/robot/wrench/ring_z")
    radius = 0.65 * RING_SIZE
    places = []
    for angle in (math.pi / 4, math.pi / 2):
        point = (radius * math.cos(angle), radius * math.sin(angle), 0.0)
        places.append(page.pixel("/robot/wrench/ring_z", point))
    before = session.state.target
    page.drag(*places)
    page.until(lambda: session.state.target[5] > before[5] + 0.5)
    assert session.state.target[:5] == before[:5]
    page.unfold("Display", "Handle")
    page.row("Handle").first.click()
    page.visible("/robot/wrench/tip", wanted=False)
    page.row("Handle").first.click()
    page.visible("/robot/wrench/tip")


def test_keys_nudge_sliders_and_what_is_selected(page: Any) -> None:
    session = page.session
    box = page.row("Fx [N]").last
    box.click()
    before = session.state.target[0]
    keyboard = page.page.keyboard
    keyboard.press("PageUp")
    page.until(lambda: session.state.target[0] == pytest.approx(before + 2.0))
    page.until(lambda: box.input_value() == "3.2")
    keyboard.press("ArrowUp")
    page.until(lambda: session.state.target[0] == pytest.approx(before + 2.2))
    page.until(lambda: box.input_value() == "3.4")
    keyboard.press("End")
    page.until(lambda: session.state.target[0] == 29.0)
    page.tab("Design")
    session.select("front_left")
    page.view.bell.ring()
    page.view.intents.is_new = True
    page.catch_up()
    page.until(lambda: page.view.board.facts["selection"] == ("front_left",))
    page.catch_up()
    x, y, z = session.state.layout.actuator("front_left").position
    page.key("ArrowUp")
    page.key("ArrowLeft")
    page.key("Shift+ArrowDown")
    nudged = pytest.approx((x + 0.01, y + 0.01, z - 0.01))
    page.until(lambda: session.state.layout.actuator("front_left").position == nudged)
    page.key("Control+z")
    page.until(lambda: session.state.layout.actuator("front_left").position[2] == z)
    assert page.problems == []


def test_a_gamepad_moves_the_wrench_and_lets_it_go(page: Any) -> None:
    session = page.session
    page.page.evaluate(PAD_SCRIPT)
    page.page.locator(".fl-gamepad").wait_for()
    assert "left stick: ahead, astern" in page.text(".fl-gamepad")
    before = session.state.target
    page.rest(300)
    assert session.state.target == before, "nobody holds it"
    page.page.evaluate("window.pad.axes = [0.1, -1, -0.6, 0]")
    page.until(lambda: session.state.target[0] > 20.0 and session.state.target[5] > 1.0)
    assert session.state.target[1] == 0.0, "within the dead zone"
    page.page.evaluate("window.pad.axes = [0, 0, 0, 0]")
    page.until(lambda: session.state.target == (0.0,) * 6)
    page.page.evaluate("navigator.getGamepads = () => []")
    page.page.locator(".fl-gamepad").wait_for(state="detached")
    page.key("Control+z")
    page.until(lambda: session.state.target == before)
    assert page.problems == []


def test_presenting_hides_all_panels_and_escape_leaves(page: Any) -> None:
    page.key("p")
    page.page.locator(".fl-present .sentence").wait_for()
    page.page.locator(".fl-present .plot").wait_for()
    assert (
        page.page.locator(".fl-tasks").is_hidden() and page.page.locator(".fl-status").is_hidden()
    )
    assert "The robot gives it with" in page.text(".fl-present .sentence")
    page.page.keyboard.press("Escape")
    page.page.locator(".fl-tasks").wait_for()
    page.until(lambda: page.page.locator(".fl-present").is_hidden())
    assert page.problems == []


def test_a_page_follows_until_it_is_made_ones_own(page: Any, browser: Any, served: Any) -> None:
    from tests.browser.page import Page

    page.press("Share")
    page.press("Let others follow")
    link = page.page.locator(".fl-ask input").input_value()
    page.press("Close")
    context = browser.new_context(viewport={"width": 1400, "height": 860})
    place = f"{link}&fixedDpr=0.1"
    pupil = Page(
        context.new_page(), SimpleNamespace(url=place, app=served.app, server=served.server)
    )
    pupil.page.locator(".fl-follow").wait_for()
    page.type("Fx [N]", "2.5")
    page.tab("Design")
    pupil.until(lambda: pupil.session.state.target[0] == 2.5)
    pupil.until(lambda: pupil.session.desk.task == "Design")
    pupil.page.locator(".fl-tasks button", has_text="Log").click()
    pupil.until(lambda: any("Make it mine" in note for note in pupil.notes()))
    assert pupil.session.desk.task == "Design"
    pupil.press("Make it mine")
    pupil.page.locator(".fl-follow").wait_for(state="detached")
    assert "follow" not in pupil.page.url
    pupil.tab("Allocate")
    pupil.type("Fx [N]", "3.5")
    pupil.until(lambda: pupil.session.state.target[0] == 3.5)
    assert page.session.state.target[0] == 2.5
    assert pupil.problems == []
    context.close()
    page.press("Stop")
    page.page.locator(".fl-lecture").wait_for(state="detached")
