"""axe-core finds nothing grave on any screen, at three widths, in light and in dark.

What a screen is stands in `SCREENS`: panels, drawers, dialogs, lists, lessons, a swim, a log, two
robots, the presenting view, and both sides of a page that is followed.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from finlab.layout import load_layout
from tests.browser.page import Page
from tests.browser.test_any_width import Newcomer
from tests.browser.test_frame import SCHEME_SCRIPT, findings
from tests.exchange.test_questions import PLAIN_URDF
from tests.sampled_cases import crossed, sampled
from webapp.session.lessons import LESSONS, TOUR
from webapp.session.looking import DRAWERS, TASKS, TWO_ROBOTS

SIZES = ((1400, 860), (933, 573), (390, 844))
"""Widths and heights of the window [px]: a laptop, the same at 150 %, a phone."""
CLOSE_SCRIPT = """() => document.querySelectorAll('[role=dialog] button').forEach((button) => {
  if (['Close', 'Cancel'].includes(button.textContent)) button.click();
})"""
"""Script: closes all dialogs."""
EVERY = 13
"""Of so many cases `make test` runs one."""
URDF_NAME = "sub.urdf"
"""Name of the file that leaves something open."""


def act(page: Page, intent: Callable[[], object]) -> None:
    """Carries out an intent where the page itself does, and waits for its answer."""
    loop = page._served.server.get_event_loop()
    loop.call_soon_threadsafe(page.view.do, intent)
    page.rest(300)
    page.until(lambda: not page.view.busy)
    page.catch_up()


def show(page: Page, name: str) -> None:
    """A task, or a tab of the drawer of one."""
    session = page.session
    is_task = name in TASKS
    act(page, partial(session.show_task if is_task else session.show_drawer, name))
    if not is_task:
        bring(page, name)


def bring(page: Page, word: str) -> None:
    """Brings the list, the values or a tab of the drawer of a phone, which has room for one of
    them."""
    button = page.page.locator(".fl-strip").get_by_role("button", name=word, exact=True)
    if button.is_visible():
        button.click()
        page.rest(300)


def select(page: Page, robot: str, task: str = "Design") -> None:
    """A robot whose first actuator is selected."""
    session = page.session
    act(page, partial(session.open_layout, load_layout(robot)))
    show(page, task)
    act(page, partial(session.select, session.state.layout.names[0]))


def body(page: Page) -> None:
    """The values of the robot as a whole, with its hull."""
    show(page, "Design")
    bring(page, "Values")
    page.unfold("Hull", "Shape")


def damage(page: Page) -> None:
    """Faults of all kinds, and what a fin that jams and one that runs on have."""
    session = page.session
    show(page, "Allocate")
    act(page, partial(session.toggle_loss, "back_right"))
    act(page, partial(session.select, "front_right"))
    act(page, partial(session.damage, "front_right", "stuck", 0.1))
    act(page, partial(session.damage, "front_left", "running", (0.3, 1.0, 0.2)))
    bring(page, "List")
    page.unfold("Damage", "Which")


def out_of_reach(page: Page) -> None:
    """More is asked for than there is."""
    act(page, partial(page.session.set_target, 0, 200.0))


def compared(page: Page) -> None:
    """All methods on one question, and then another question."""
    show(page, "Comparison")
    comparison = page.view.jobs.comparison
    act(page, partial(comparison.start, page.session.state))
    page.until(lambda: not comparison.run.running)
    act(page, partial(page.session.set_target, 0, 1.0))


def improved(page: Page) -> None:
    """What a search has found."""
    show(page, "Improve")
    page.page.get_by_role("button", name="Search", exact=True).click()
    page.until(lambda: page.view.jobs.improver.answer is not None, 240.0)


def two_robots(page: Page) -> None:
    """Two robots, with the table of both."""
    show(page, TWO_ROBOTS)
    two = page.session.two_robots
    act(page, partial(two.choose, "right", "Shipped: octo"))
    page.until(lambda: page.page.locator(".versus .better-sign").count() >= 4)


def jets(page: Page) -> None:
    """Jets that count."""
    act(page, partial(page.session.open_layout, load_layout("bluerov2_heavy")))
    act(page, partial(page.session.set_jets, True))
    page.until(lambda: page.view.jobs.jet_comparison.answer is not None)
    page.catch_up()


def null_space(page: Page) -> None:
    """A way along the null space."""
    act(page, partial(page.session.open_layout, load_layout("turtle_hybrid")))
    show(page, "Null space")
    act(page, partial(page.session.shift, 0, 0.3))


def swim(page: Page) -> None:
    """A robot that swims, with one fin broken."""
    show(page, "Simulate")
    swimming = page.view.jobs.swimming
    act(page, lambda: swimming.start(page.session.swim.plan(page.session.state)))
    page.until(lambda: swimming.time > 0.5)
    act(page, partial(swimming.toggle, "front_left"))
    page.until(lambda: bool(swimming.swimmer and swimming.swimmer.visible_moment.lost))
    act(page, partial(swimming.set_running, False))


def log(page: Page, drawer: str) -> None:
    """A log that is judged."""
    show(page, "Log")
    page.page.locator("[data-press=sample]").first.evaluate("button => button.click()")
    reading = page.view.jobs.log
    page.until(lambda: reading.shown is not None and not reading.busy, 240.0)
    show(page, drawer)


def granted(page: Page, folder: Path) -> None:
    """What was taken for granted of a file, after its questions."""
    asked(page, folder)
    page.page.locator(".fl-inquiry").get_by_role("button", name="Open").click()
    page.until(lambda: page.session.state.source is not None)
    show(page, "Design")
    bring(page, "List")


def asked(page: Page, folder: Path) -> None:
    """Questions about a file."""
    file = folder / URDF_NAME
    file.write_text(PLAIN_URDF)
    act(page, partial(page.view.page.opening.open, file.name, file.read_bytes()))
    page.page.locator(".fl-inquiry [role=dialog]").wait_for()


def dialog(page: Page, ask: Callable[[Page], object]) -> None:
    """A dialog of the page."""
    act(page, partial(ask, page))
    page.page.get_by_role("dialog").wait_for()


def listed(page: Page, name: str) -> None:
    """The list of lessons, or of the tour's stops, or the menu of a narrow bar that has both."""
    menu = page.page.locator(".fl-more > button")
    if menu.is_visible():
        menu.click()
    page.page.get_by_text(name, exact=True).locator("visible=true").first.click()


def commands(page: Page) -> None:
    """The list of all commands."""
    page.key("Control+k")
    page.page.get_by_placeholder("Search commands").wait_for()


def noted(page: Page) -> None:
    """A note that says what is wrong."""
    act(page, lambda: page.view.page.notify("Not possible", "x: expected a number, got '1/3'"))
    page.page.locator(".mantine-Notification-root").first.wait_for()


def displayed(page: Page) -> None:
    """What is displayed, folded out, with an attainable set."""
    show(page, "Reach")
    act(page, partial(page.session.set_display, "drawn", "forces"))
    page.unfold("Display", "Arrow length")
    page.until(lambda: not page.view.jobs.analyst.busy)


def presented(page: Page) -> None:
    """The presenting view."""
    act(page, partial(page.session.set_display, "presents", True))
    page.page.locator(".fl-present").wait_for()


def solved(page: Page) -> None:
    """A lesson whose exercise is done."""
    act(page, partial(page.session.guide.open, "lost-fin"))
    act(page, partial(page.session.toggle_loss, "front_left"))
    page.until(lambda: page.session.guide.solved)
    page.catch_up()


def opened_stop(page: Page, name: str) -> None:
    """A stop of the tour, or a lesson."""
    act(page, partial(page.session.guide.open, name))
    page.page.locator(".fl-tour").wait_for()


def screens(folder: Path) -> dict[str, Callable[[Page], object]]:
    """Every screen by name, and what shows it on a page that was started over; files that are
    dropped lie in a folder."""
    found: dict[str, Callable[[Page], object]] = {}
    for task in TASKS:
        for name in DRAWERS[task] or (task,):
            found[name] = partial(show, name=name)
    for robot in ("ucat", "bluerov2", "catamaran", "torpedo"):
        found[f"an actuator of {robot}"] = partial(select, robot=robot)
    for stop in (*TOUR, *LESSONS):
        found[f"stop {stop.name}"] = partial(opened_stop, name=stop.name)
    found |= {
        "body": body,
        "damage": damage,
        "out of reach": out_of_reach,
        "methods compared": compared,
        "improved": improved,
        "two robots": two_robots,
        "jets": jets,
        "along the null space": null_space,
        "a swim": swim,
        "a log": partial(log, drawer="Log over time"),
        "replays": partial(log, drawer="Replays"),
        "granted": partial(granted, folder=folder),
        "asked": partial(asked, folder=folder),
        "new": partial(dialog, ask=lambda page: page.view.page.new()),
        "share": partial(dialog, ask=lambda page: page.view.designs.share()),
        "share both": share_both,
        "lessons": partial(listed, name="Lessons"),
        "tour": partial(listed, name="Tour"),
        "commands": commands,
        "a note": noted,
        "display": displayed,
        "presented": presented,
        "a lesson that is done": solved,
    }
    return found


def share_both(page: Page) -> None:
    """The link of two robots."""
    two_robots(page)
    dialog(page, lambda page: page.view.designs.share_pair())


SCREEN_NAMES = tuple(screens(Path()))


def leave(page: Page) -> None:
    """Closes what a screen has opened over the page."""
    for _ in range(2):
        page.page.keyboard.press("Escape")
    page.page.evaluate("document.querySelectorAll('[popover]').forEach(e => e.hidePopover())")
    page.page.evaluate(CLOSE_SCRIPT)

    def reset() -> None:
        page.session.guide.end()
        page.view.scenery.end_swim()

    act(page, reset)


def dark(page: Page, is_dark: bool) -> None:
    """The dark theme, or the light one."""
    act(page, partial(page.session.set_display, "dark", is_dark))
    scheme = "dark" if is_dark else "light"
    page.page.wait_for_function(SCHEME_SCRIPT, arg=scheme)


def looked_at(page: Any, name: str) -> None:
    """axe-core finds nothing grave on what a page shows, light and dark."""
    assert findings(page) == [], f"{name}, light"
    dark(page, True)
    assert findings(page, ["color-contrast"]) == [], f"{name}, dark"
    dark(page, False)


@pytest.mark.parametrize(("name", "size"), crossed(SCREEN_NAMES, SIZES, every=EVERY))
def test_axe_finds_nothing_on_a_screen(
    resized: Any, name: str, size: tuple[int, int], tmp_path: Path
) -> None:
    page = resized
    page.page.set_viewport_size(dict(zip(("width", "height"), size, strict=True)))
    try:
        screens(tmp_path)[name](page)
        page.until(lambda: not page.view.busy)
        looked_at(page, name)
    finally:
        leave(page)


@pytest.mark.parametrize("size", sampled(SIZES, every=3))
def test_axe_finds_nothing_on_the_start_page(
    browser: Any, served: Any, size: tuple[int, int]
) -> None:
    for scheme in ("light", "dark"):
        context = browser.new_context(
            viewport=dict(zip(("width", "height"), size, strict=True)), color_scheme=scheme
        )
        tab = context.new_page()
        tab.set_default_timeout(120_000)
        tab.goto(served.url.partition("?")[0], wait_until="commit")
        tab.locator("#fl-start").wait_for()
        assert findings(Newcomer(tab)) == [], scheme
        context.close()


@pytest.mark.parametrize("size", sampled(SIZES, every=3))
def test_axe_finds_nothing_on_both_sides_of_a_page_that_is_followed(
    resized: Any, browser: Any, served: Any, size: tuple[int, int]
) -> None:
    page = resized
    viewport = dict(zip(("width", "height"), size, strict=True))
    dialog(page, lambda page: page.view.designs.share())
    page.press("Let others follow")
    card = page.page.get_by_role("dialog")
    page.until(lambda: "follow=" in card.locator("input").input_value())
    looked_at(page, "the link to follow")
    link = card.locator("input").input_value()
    card.get_by_role("button", name="Close").click()
    page.page.set_viewport_size(viewport)
    context = browser.new_context(viewport=viewport)
    place = f"{link}&fixedDpr=0.1"
    served_there = SimpleNamespace(url=place, app=served.app, server=served.server)
    pupil = Page(context.new_page(), served_there)
    pupil.page.locator(".fl-follow").wait_for()
    page.page.locator(".fl-lecture").wait_for()
    try:
        assert findings(pupil) == [], "who follows"
        looked_at(page, "who is followed")
    finally:
        context.close()
        page.page.locator(".fl-lecture").get_by_role("button", name="Stop").click()
        page.page.locator(".fl-lecture").wait_for(state="detached")
