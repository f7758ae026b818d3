"""At every width all is within reach: the start page, the bar or its menu, and the status."""

import re
from typing import Any

from finlab.layout import load_layout
from tests.browser.test_frame import SCHEME_SCRIPT, findings
from webapp.session.lessons import LESSONS
from webapp.start_page import ROBOTS

SIZES = ((1400, 860), (1024, 700), (933, 573), (390, 844))
"""Widths and heights of the window [px]: a laptop, a tablet, a laptop at 150 %, a phone."""
WORDS = ("New", "Open", "Save", "Share", "Undo", "Redo")
"""What the bar has, or its menu."""
SHIFT_SCRIPT = """() => new Promise((done) => new PerformanceObserver((list) => {
  const start = document.querySelector('#fl-start');
  const ofStart = list.getEntries().filter(({ sources }) => sources.some(({ node }) => start.contains(node)));
  done(ofStart.reduce((sum, entry) => sum + entry.value, 0));
}).observe({ type: 'layout-shift', buffered: true }) ?? setTimeout(() => done(0), 300))"""
"""Script: how far what the start page shows has moved by itself; the app behind it still comes."""


class Newcomer:
    """A page that was opened without a link, for what `findings` asks of one."""

    def __init__(self, tab: Any) -> None:
        """Takes its tab."""
        self.page = tab

    def rest(self, milliseconds: int) -> None:
        """Lets time pass."""
        self.page.wait_for_timeout(milliseconds)


def test_a_newcomer_sees_three_doors_and_six_robots(browser: Any, served: Any) -> None:
    context = browser.new_context(
        viewport={"width": 500, "height": 420}, color_scheme="dark", reduced_motion="reduce"
    )
    tab = context.new_page()
    tab.set_default_timeout(120_000)
    tab.goto(served.url.partition("?")[0], wait_until="commit")
    tab.locator("#fl-start").wait_for()
    for door in ("Design mine", "Show me", "Open a file or log"):
        assert tab.get_by_text(door, exact=True).is_visible()
    assert tab.locator("#fl-start .robots img").count() == len(ROBOTS)
    assert tab.evaluate(SHIFT_SCRIPT) < 0.01
    for width, height in SIZES:
        tab.set_viewport_size({"width": width, "height": height})
        assert tab.evaluate("document.querySelector('#fl-start').scrollWidth") == width
    assert findings(Newcomer(tab)) == [], "dark"
    tab.evaluate("document.querySelector('#fl-start').classList.remove('dark')")
    assert findings(Newcomer(tab), ["color-contrast"]) == [], "light"
    back = tab.locator("#fl-start .back")
    assert not back.is_visible(), "there is no work yet"
    tab.locator("[data-start='robot catamaran']").click()
    tab.locator("#fl-start").wait_for(state="hidden")
    tab.wait_for_function(SCHEME_SCRIPT, arg="dark")
    session = served.app.views[max(served.app.views)].session
    assert session.state.layout.name == "catamaran"
    assert session.display.dark, "as the system has it"
    tab.reload()
    tab.locator(".fl-status .err").wait_for(state="attached")
    assert not tab.locator("#fl-start").is_visible(), "there is work now"
    tab.evaluate("finlabStart.open()")
    back.click()  # a phone has no Escape
    tab.locator("#fl-start").wait_for(state="hidden")
    assert session.state.layout.name == "catamaran"
    context.close()


def test_bar_and_status_have_all_at_every_width(resized: Any) -> None:
    page = resized
    tab = page.page
    menu = tab.locator(".fl-more > button")
    for width, height in SIZES:
        tab.set_viewport_size({"width": width, "height": height})
        page.rest(200)
        status = page.text(".fl-status")
        assert "dual" in status and " ms" in status, f"method and time at {width} px"
        assert tab.evaluate("document.documentElement.scrollWidth") == width
        if menu.is_visible():
            box = menu.bounding_box()
            assert box["x"] + box["width"] <= width
            menu.click()
        for word in WORDS:
            # Undo and Redo say what they do where there is a step.
            named = re.compile(f"^{word}(:|$)")
            tab.get_by_role("button", name=named).locator("visible=true").first.wait_for()
        for word in ("Lessons", "Tour", "Commands"):
            tab.get_by_text(word, exact=True).locator("visible=true").first.wait_for()
        if menu.is_visible():
            tab.get_by_text("Method: dual").wait_for()
            if width == SIZES[-1][0]:
                assert findings(page) == [], f"the menu at {width} px"
            tab.keyboard.press("Escape")
            tab.locator("#fl-menu").wait_for(state="hidden")
            if width == SIZES[-1][0]:
                menu.click()
                tab.get_by_role("button", name="Share", exact=True).locator("visible=true").click()
                card = tab.get_by_role("dialog")
                box = card.bounding_box()
                assert box["x"] >= 0.0 and box["x"] + box["width"] <= width, "all of the card"
                card.get_by_role("button", name="Close").click()


def test_a_lesson_is_opened_from_the_menu_of_a_phone_and_closed_by_a_key(resized: Any) -> None:
    page = resized
    tab = page.page
    tab.set_viewport_size({"width": 390, "height": 844})
    page.rest(200)
    tab.locator(".fl-more > button").click()
    tab.get_by_text("Lessons", exact=True).locator("visible=true").click()
    tab.locator(f"#fl-menu [data-key={LESSONS[5].name}]").click()
    page.until(lambda: page.session.guide.stop == LESSONS[5])
    assert not tab.locator("#fl-menu").is_visible()
    page.key("Escape")
    page.until(lambda: page.session.guide.stop is None)
    assert page.problems == []


def test_a_phone_reaches_list_and_drawer(resized: Any) -> None:
    page = resized
    tab = page.page
    tab.set_viewport_size({"width": 390, "height": 844})
    page.tab("Design")
    for word, shown in (("List", "left"), ("Reach", "drawer"), ("Improve", "drawer")):
        tab.locator(".fl-strip").get_by_role("button", name=word, exact=True).click()
        region = tab.locator(f".mantine-Paper-root[data-fl~={shown}]").first
        page.rest(300)
        box = region.bounding_box()
        assert box["height"] > 200.0 and box["y"] + box["height"] <= 844.5, word
        at = {"x": box["x"] + 195.0, "y": box["y"] + 0.6 * box["height"]}
        name = "({x, y}) => document.elementFromPoint(x, y).closest('[data-fl~=region]').dataset.fl"
        assert shown in tab.evaluate(name, at), f"nothing lies over what {word} brings"
    tab.locator(".fl-strip").get_by_role("button", name="Values", exact=True).click()
    page.rest(300)
    assert tab.locator(".mantine-Paper-root[data-fl~=drawer]").first.bounding_box()["height"] < 50.0
    page.page.get_by_role("button", name="Fold the drawer").click()
    page.page.get_by_role("button", name="Open the drawer").wait_for()
    tab.locator(".fl-strip").get_by_role("button", name="List", exact=True).click()
    tab.get_by_role("button", name="Fold the drawer").wait_for()
    list_region = tab.locator(".mantine-Paper-root[data-fl~=left]").first
    page.until(lambda: list_region.bounding_box()["height"] > 200.0)
    assert page.problems == []


def swipe(page: Any, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Moves a finger over the page, from a point to another [px]."""
    touch = page.page.context.new_cdp_session(page.page)

    def tell(kind: str, *points: dict[str, float]) -> None:
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": list(points)})

    steps = 10
    for step in range(steps + 1):
        x, y = (a + (b - a) * step / steps for a, b in zip(start, end, strict=True))
        tell("touchMove" if step else "touchStart", {"x": x, "y": y})
        page.rest(20)
    tell("touchEnd")
    touch.detach()


def test_a_finger_drags_a_slider_or_goes_across_it(resized: Any) -> None:
    page = resized
    tab = page.page
    tab.set_viewport_size({"width": 390, "height": 844})
    page.tab("Allocate")
    tab.evaluate("document.documentElement.dataset.flSheet = ''")  # another test may have a list
    thumb = tab.get_by_role("slider", name="Fz [N]")
    thumb.scroll_into_view_if_needed()
    page.rest(300)

    def middle() -> tuple[float, float]:
        box = thumb.bounding_box()
        return box["x"] + box["width"] / 2.0, box["y"] + box["height"] / 2.0

    before = page.session.state.target
    x, y = middle()
    swipe(page, (x, y), (x + 30.0, y))
    page.until(
        lambda: page.session.state.target[2] > 1.0,
        told=lambda: f"from {x:.0f}, {y:.0f}: {page.session.state.target}",
    )
    assert page.session.state.target[:2] == before[:2]
    page.rest(500)
    dragged = page.session.state.target
    x, y = middle()
    swipe(page, (x, y), (x + 2.0, y - 120.0))
    page.rest(500)
    assert page.session.state.target == dragged, "a finger that scrolls asks for nothing"
    assert page.problems == []


def test_a_stop_begins_at_its_top_on_a_phone_and_brings_what_it_speaks_of(resized: Any) -> None:
    page = resized
    tab = page.page
    tab.set_viewport_size({"width": 390, "height": 844})
    page.tab("Allocate")
    scrolled = "[...document.querySelectorAll('[data-fl~=region][data-fl~=left]')][0].scrollTop"
    sheet = "document.documentElement.dataset.flSheet"
    for stop in LESSONS[3:8]:
        page.view.do(lambda stop=stop: page.session.guide.open(stop.name))
        tab.locator(".fl-tour", has_text=stop.title).wait_for()
        page.until(lambda stop=stop: tab.evaluate(sheet) == ("" if stop.inspects else "drawer"))
        page.until(lambda: tab.evaluate(scrolled) == 0)
        card = tab.locator(".fl-tour .row").bounding_box()
        strip = tab.locator(".fl-strip").bounding_box()
        panel = tab.locator("[data-fl~=region][data-fl~=left]").first.bounding_box()
        assert card["y"] + card["height"] <= panel["y"] + panel["height"] + 1.0, "Next is in sight"
        assert strip["height"] > 0.0
        tab.evaluate(f"{scrolled} = 400")
    assert page.problems == []


def test_a_lesson_on_a_low_window_has_its_title_its_praise_and_next(resized: Any) -> None:
    page = resized
    tab = page.page
    tab.set_viewport_size({"width": 933, "height": 573})
    page.rest(200)
    region = tab.locator(".mantine-Paper-root[data-fl~=region][data-fl~=left]")
    tab.locator(".fl-more > button").click()
    tab.get_by_text("Lessons", exact=True).locator("visible=true").click()
    tab.locator(f"#fl-menu [data-key={LESSONS[0].name}]").click()
    tab.get_by_text(LESSONS[0].exercise).wait_for()
    region.evaluate("(region) => region.scrollTo(0, 500)")
    page.press("Next")
    title = tab.get_by_text(f"Lesson 2 of {len(LESSONS)}")
    page.until(lambda: title.is_visible() and top(title) >= top(region))
    page.press("▶ Play")
    praise = tab.get_by_text(LESSONS[1].praise)
    praise.wait_for()
    next_button = tab.get_by_role("button", name="Next", exact=True).locator("visible=true")
    box = region.bounding_box()
    assert top(praise) < top(next_button) < box["y"] + box["height"] - 30.0
    page.key("Escape")
    page.until(lambda: page.session.guide.stop is None)
    assert page.problems == []


def test_the_list_of_methods_ends_in_the_window(resized: Any) -> None:
    page = resized
    tab = page.page
    tab.set_viewport_size({"width": 933, "height": 573})
    page.rest(200)
    tab.locator("[data-fl~=method] + div input").first.click()
    longest = tab.get_by_role("option").filter(has_text="linearized step by step")
    longest.wait_for()
    box = longest.bounding_box()
    assert box["x"] >= 0.0 and box["x"] + box["width"] <= 933.0
    assert tab.locator("canvas[data-engine]").bounding_box()["x"] == 0.0, "nothing is scrolled"
    tab.keyboard.press("Escape")
    longest.wait_for(state="hidden")
    assert page.problems == []


def top(element: Any) -> float:
    """Where an element begins [px]."""
    return float(element.bounding_box()["y"])


def test_nothing_in_the_bar_moves_by_itself(resized: Any) -> None:
    page = resized
    tab = page.page
    session = page.session

    def lefts() -> dict[str, float]:
        """Where the parts of the bar begin [px]."""
        found = {}
        for word in ("Undo", "Redo"):
            named = re.compile(f"^{word}(:|$)")
            button = tab.get_by_role("button", name=named).locator("visible=true").first
            found[word] = button.bounding_box()["x"]
        found["tasks"] = tab.locator(".fl-tasks").bounding_box()["x"]
        found["method"] = tab.locator("[data-fl~=method] + div").bounding_box()["x"]
        return found

    for width, height in SIZES[:3]:
        tab.set_viewport_size({"width": width, "height": height})
        page.rest(200)
        before = lefts()
        session.rename_robot("A robot with quite a long name")  # and so a step with one
        page.view.do(lambda: None)
        tab.get_by_role("button", name=re.compile("^Undo: Rename the robot")).first.wait_for()
        assert lefts() == before, f"a step with a long name, at {width} px"
        page.view.do(lambda: session.open_layout(load_layout("bluerov2")))
        page.until(lambda: tab.locator("[data-fl~=method]").count() == 1 and not page.view.busy)
        page.catch_up()
        page.rest(200)
        assert lefts() == before, f"a robot without fins, at {width} px"
        for label in ("Least", "Method"):
            shown = tab.locator("[data-fl~=region][data-fl~=top] label", has_text=label).first
            assert shown.bounding_box()["width"] > 20.0, f"{label} is seen at {width} px"
        page.start_over()
    assert page.problems == []
