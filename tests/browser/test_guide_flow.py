"""The tour, lessons, the list of commands; tabs that are apart, and work that is there after a
reload."""

from collections.abc import Callable
from typing import Any

import numpy as np

from finlab.layout import load_layout
from tests.browser.conftest import Served
from tests.browser.page import Page
from webapp.app import App
from webapp.guard import Guard
from webapp.session import Display
from webapp.session.lessons import LESSONS, TOUR
from webapp.tasks.solver import Solver
from webapp.viser_internals import start_server, stop_server


def apart(page: Any, one: str, other: str) -> bool:
    """Whether two elements share nothing."""
    a, b = (page.page.locator(name).bounding_box() for name in (one, other))
    return bool(a["x"] + a["width"] <= b["x"] or b["x"] + b["width"] <= a["x"])


def test_the_tour_sets_each_stop_and_brings_the_work_back(page: Any) -> None:
    page.type("Fy [N]", "0.5")
    page.until(lambda: page.session.state.target[1] == 0.5)
    page.tab("Improve")
    page.key("2")
    mine = page.session.state
    camera = page.view.scenery.robot.camera
    undo = page.session.history.undo_name
    page.press("Tour")
    page.page.get_by_text("Your own work comes back").locator("visible=true").wait_for()
    page.press(f"1. {TOUR[0].title}")
    page.until(lambda: "1 of 4" in page.text(".tour"))
    page.until(lambda: apart(page, ".fl-tour", "canvas[data-engine]"))
    for stop in range(2, 4):
        page.press("Next")
        page.until(lambda stop=stop: f"{stop} of 4" in page.text(".tour"))
    page.until(
        lambda: page.view.jobs.swimming.swimmer is not None and page.view.jobs.swimming.time > 0.3
    )
    page.visible("/floor", False)
    page.until(lambda: "off the path" in page.text(".fl-status"))
    page.press("Next")
    page.until(lambda: not page.view.jobs.swimming.active)
    page.visible("/floor")
    page.until(lambda: "6 of 6 actuators" in page.text(".fl-status"))
    page.press("Finish")
    page.until(lambda: page.session.state == mine and page.session.guide.stop is None)
    assert page.session.drawer == "Improve" and page.session.history.undo_name == undo
    back = page.view.scenery.robot.camera
    page.until(lambda: np.allclose(back, camera, atol=1e-3))
    assert page.problems == []


def test_a_lesson_sees_when_its_task_is_done(page: Any) -> None:
    page.tab("Comparison")
    mine = page.session.state
    desk = page.session.desk
    page.press("Lessons")
    page.press(f"1. {LESSONS[0].title}")
    page.until(lambda: "One wrench, several ways" in page.text(".fl-lesson"))
    page.until(lambda: not page.view.busy and len(page.view.jobs.answering.modes.visible) > 1)
    assert "○" in page.text(".fl-lesson")
    page.page.locator("table.modes tr.pick").nth(1).click()
    page.until(lambda: "✓" in page.text(".fl-lesson"))
    assert "the green arrows did not" in page.text(".fl-lesson")
    page.press("Next")
    page.until(
        lambda: (
            "From a sample" in page.text(".fl-lesson") and not page.view.jobs.answering.searching
        )
    )
    page.press("▶ Play")
    page.until(lambda: "✓" in page.text(".fl-lesson") and page.session.step is None)
    page.press("Next")
    page.until(lambda: "temperature" in page.text(".fl-lesson"))
    page.type("Temperature", "2")
    page.until(lambda: "✓" in page.text(".fl-lesson"))
    page.press("Next")
    page.until(lambda: "Watts are not effort" in page.text(".fl-lesson"))
    page.choose("Least", "watts")
    page.until(lambda: "✓" in page.text(".fl-lesson"))
    page.press("Close")
    page.until(lambda: page.session.guide.stop is None and page.session.state == mine)
    assert page.session.desk == desk and page.problems == []


def test_a_command_is_found_by_its_words(page: Any) -> None:
    page.key("Control+k")
    box = page.page.get_by_placeholder("Search commands")
    box.wait_for()
    page.page.keyboard.type("dive")
    page.page.get_by_text("Ask for: Dive").wait_for()
    page.page.keyboard.press("Enter")
    page.until(lambda: page.session.state.target[2] < 0.0)
    box.wait_for(state="hidden")


def test_panels_are_built_when_they_are_met(new_page: Any) -> None:
    page = new_page()
    assert page.page.locator("label", has_text="Scenario").count() == 0
    page.tab("Simulate")
    page.row("Scenario").first.wait_for()
    page.page.context.close()


def test_reload_and_reconnect_restore_and_tabs_are_apart(
    page: Any, new_page: Callable[..., Any], served: Any
) -> None:
    page.type("Fy [N]", "0.5")
    page.until(lambda: page.session.state.target[1] == 0.5)
    page.tab("Improve")
    page.choose("Goal", "worst single failure")
    page.until(lambda: page.session.draft.goal == "worst single failure")
    page.tab("Simulate")
    page.choose("Path", "square")
    page.until(lambda: page.session.swim.path == "square")
    page.page.reload()
    page.ready()
    assert page.view.session is page.session
    page.shows("Path", "square")
    page.tab("Improve")
    page.shows("Goal", "worst single failure")
    page.tab("Allocate")
    page.shows("Fy [N]", "0.5")
    before = page.view
    served.server._websock_server.disconnect_all_clients()
    page.until(lambda: before not in served.app.views.values())
    back = served.app.views
    page.until(lambda: any(view.session is page.session for view in back.values()))
    page.ready()
    assert page.page.get_by_role("button", name="Undo").count() == 1, "no widget twice"
    other = new_page(page.page.context)  # the same browser profile, so the same storage
    assert other.session is not page.session and other.session.state.target[1] == 0.0
    other.page.close()
    page.page.bring_to_front()


def test_a_token_opens(browser: Any) -> None:
    guard = Guard("127.0.0.1", "a-secret-token")
    layout = load_layout("ucat")

    server = start_server(guard, 0)
    app = App(server, Solver(), layout, Display(shadows=False, frozen=True))
    first = Served(f"http://127.0.0.1:{server.get_port()}/?token={guard.token}", app, server)
    port = first.server.get_port()
    context = browser.new_context(viewport={"width": 900, "height": 600})
    stranger = context.new_page()
    stranger.goto(f"http://127.0.0.1:{port}/")
    assert "token" in stranger.inner_text("body") and stranger.locator("canvas").count() == 0
    stranger.close()
    page = Page(context.new_page(), first)
    assert "token" not in page.page.url
    context.close()
    first.app.stop()
    stop_server(first.server)
