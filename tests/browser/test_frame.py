"""The frame: each task has its regions, nothing lies over anything else, keys do what their sheet says."""

from collections.abc import Iterator
from itertools import combinations
from typing import Any

import pytest

from webapp.commands import commands
from webapp.session.looking import DRAWERS, TASKS

SIZES = ((1280, 720), (1400, 860), (1920, 1080), (900, 700), (500, 800))
REGIONS = """() => {
  const shown = (e) => e && getComputedStyle(e).visibility === 'visible' && e.getClientRects().length > 0;
  const found = {};
  for (const name of ['top', 'left', 'right', 'drawer']) {
    const box = document.querySelector(`.fl-${name}`).closest('.mantine-Paper-root');
    if (shown(box)) found[name] = box.getBoundingClientRect().toJSON();
  }
  found.canvas = document.querySelector('canvas[data-engine]').getBoundingClientRect().toJSON();
  return found;
}"""
WORDS = """() => Object.fromEntries(['canvas[data-engine]', '.fl-camera', '.fl-corner'].map((name) =>
  [name, document.querySelector(name).getBoundingClientRect().toJSON()]))"""
SMALL = """() => {
  const found = new Set(), walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let text; (text = walk.nextNode()); ) {
    const box = text.parentElement, style = getComputedStyle(box);
    if (!text.data.trim() || style.visibility !== 'visible' || !box.getClientRects().length) continue;
    if (box.closest('style, script, svg, .fl-chrome')) continue;
    const size = parseFloat(style.fontSize) * box.currentCSSZoom;
    if (size < 13) found.add(`${text.data.trim()}: ${size}`);
  }
  return [...found];
}"""
WIDE = """() => {
  const found = [];
  for (const name of ['top', 'left', 'right', 'drawer']) {
    const box = document.querySelector(`.fl-${name}`).closest('.mantine-Paper-root');
    if (box.scrollWidth > box.clientWidth + 1)
      found.push(`${name}: ${box.scrollWidth} of ${box.clientWidth} px`);
  }
  return found;
}"""


@pytest.fixture
def resized(page: Any) -> Iterator[Any]:
    """The page; its window has its first size again afterwards."""
    before = page.page.viewport_size
    yield page
    page.page.set_viewport_size(before)


def overlaps(boxes: dict[str, dict[str, float]]) -> list[str]:
    """Pairs of boxes that share more than a pixel."""
    found = []
    for (one, a), (other, b) in combinations(boxes.items(), 2):
        across = min(a["right"], b["right"]) - max(a["left"], b["left"])
        down = min(a["bottom"], b["bottom"]) - max(a["top"], b["top"])
        if across > 1 and down > 1:
            found.append(f"{one} and {other} share {across:.0f} x {down:.0f} px")
    return found


@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def test_nothing_lies_over_anything_else(resized: Any, size: tuple[int, int]) -> None:
    page, (width, height) = resized, size
    page.page.set_viewport_size({"width": width, "height": height})
    page.session.rename_robot("A robot with quite a long name")  # and so a step with one
    narrow = width < 720  # one region at a time
    for task in TASKS:
        seen = "drawer" if narrow and DRAWERS[task] else "right"
        for name in DRAWERS[task] or (task,):
            if narrow:
                page.page.locator(f".fl-panes .to-{seen}").click()
            page.tab(name)
            page.rest(300)
            boxes = page.page.evaluate(REGIONS)
            assert overlaps(boxes) == [], f"{name} at {width} x {height}"
            assert {"top", seen, "canvas"} <= set(boxes), name
            if not narrow:
                assert ("drawer" in boxes) == bool(DRAWERS[task]), name
            canvas = boxes["canvas"]
            assert canvas["width"] >= 480 and canvas["height"] >= 240, "the robot can be seen"
            for box in boxes.values():
                assert box["left"] >= 0 and box["right"] <= width and box["bottom"] <= height
            assert page.page.evaluate(SMALL) == [], f"type of 13 px at least, in {name}"
            assert page.page.evaluate(WIDE) == [], f"nothing is cut off in {name} at {width} x {height}"
    assert page.problems == []


@pytest.mark.parametrize("size", [(1280, 720), (900, 700)], ids=lambda size: f"{size[0]}x{size[1]}")
def test_no_words_lie_over_the_robot_in_a_small_view(resized: Any, size: tuple[int, int]) -> None:
    page, (width, height) = resized, size
    page.page.set_viewport_size({"width": width, "height": height})
    for task in TASKS:
        page.tab(task)
        page.rest(300)
        assert overlaps(page.page.evaluate(WORDS)) == [], task
    page.tab("Allocate")
    page.unfold("Display", "Dark")
    shown = page.page.locator("label:visible", has_text="Dark").bounding_box()
    assert shown["y"] > page.page.evaluate(WORDS)["canvas[data-engine]"]["top"], "it folds out over the view"
    page.tab("Display")
    page.until(lambda: page.page.locator("label:visible", has_text="Dark").count() == 0)


def test_what_plays_the_refinement_is_seen_whole_at_once(resized: Any) -> None:
    page = resized
    page.page.set_viewport_size({"width": 1280, "height": 720})
    page.until(lambda: not page.view.busy and len(page.view.answering.modes.shown) > 1)
    box = page.page.get_by_role("button", name="Play the refinement").bounding_box()
    drawer = page.page.evaluate(REGIONS)["drawer"]
    assert drawer["top"] < box["y"] and box["y"] + box["height"] < drawer["bottom"]


def test_the_drawer_is_low_until_a_robot_swims(page: Any) -> None:
    def height() -> float:
        return float(page.page.evaluate(REGIONS)["drawer"]["height"])

    tall = height()
    page.tab("Simulate")
    page.until(lambda: height() < 120)
    assert "Once a swim is started" in page.text(".fl-unswum")
    page.press("Start")
    page.until(lambda: height() > tall)
    page.until(lambda: page.page.locator(".uplot:visible").count() == 6)
    ends = page.page.locator(".uplot:visible").evaluate_all(
        "all => all.map(one => one.getBoundingClientRect().bottom)"
    )
    assert max(ends) <= page.page.viewport_size["height"], f"the last plots end at {ends}"
    page.press("End")
    page.until(lambda: height() < 120)


def test_a_step_that_is_cut_in_the_bar_is_told_whole(page: Any) -> None:
    page.session.rename_robot("A robot with quite a long name")
    page.tab("Design")
    undo = page.page.get_by_role("button", name="Undo: Rename the robot to A robot with quite a long name")
    undo.wait_for()
    assert undo.locator(".mantine-Button-label").evaluate("label => label.scrollWidth > label.clientWidth")
    undo.hover()
    page.until(lambda: (undo.get_attribute("title") or "").endswith("quite a long name\nCtrl+Z"))


@pytest.mark.parametrize("size", [(1400, 860), (1920, 1080)], ids=lambda size: f"{size[0]}x{size[1]}")
def test_the_presenters_view_is_large_and_whole(resized: Any, size: tuple[int, int]) -> None:
    page, (width, height) = resized, size
    page.page.set_viewport_size({"width": width, "height": height})
    arrow = "/robot/wrench/delivered_force"
    thin = page.vertices(arrow)
    page.key("v")
    page.until(lambda: page.session.display.large)
    page.until(lambda: page.vertices(arrow) != thin, told=lambda: "the arrow is as thin as before")
    for task in TASKS:
        page.tab(task)
        page.catch_up()
        page.until(
            lambda: overlaps(page.page.evaluate(REGIONS)) == [],
            told=lambda: str(overlaps(page.page.evaluate(REGIONS))),
        )
        boxes = page.page.evaluate(REGIONS)
        assert boxes["canvas"]["width"] >= 0.6 * width and boxes["canvas"]["height"] >= 0.4 * height
        small = page.page.evaluate(SMALL.replace("< 13", f"< {height / 46}"))
        assert small == [], f"in {task}"
        assert page.page.evaluate(WIDE) == [], f"nothing is cut off in {task} at {width} x {height}"
        told = page.page.locator(".fl-status").bounding_box()
        assert told["x"] >= 0 and told["x"] + told["width"] <= boxes["canvas"]["right"]
    page.key("v")
    page.until(lambda: page.page.evaluate(REGIONS)["top"]["height"] < 60)
    assert page.problems == []


def test_one_region_at_a_time_on_a_narrow_page(resized: Any) -> None:
    page = resized
    page.page.set_viewport_size({"width": 500, "height": 800})
    for button, region in (("Fins", "left"), ("Plots", "drawer"), ("Settings", "right")):
        page.page.locator(".fl-panes").get_by_text(button).click()
        page.rest(200)
        assert set(page.page.evaluate(REGIONS)) == {"top", "canvas", region}


def test_the_drawer_is_dragged_taller_and_stays_so(page: Any) -> None:
    def height() -> float:
        return float(page.page.evaluate(REGIONS)["drawer"]["height"])

    before = height()
    handle = page.page.locator(".fl-handle").bounding_box()
    x, y = handle["x"] + handle["width"] / 2, handle["y"] + 3
    page.drag((x, y), (x, y - 120))
    assert height() == pytest.approx(before + 120, abs=3)
    page.page.reload()
    page.ready()
    page.until(lambda: abs(height() - before - 120) < 3)
    page.page.get_by_role("button", name="Fold the drawer").click()
    page.until(lambda: height() < 40)
    page.page.get_by_role("button", name="Open the drawer").click()
    page.until(lambda: height() > before)
    handle = page.page.locator(".fl-handle").bounding_box()
    page.drag((x, handle["y"] + 3), (x, handle["y"] + 123))
    page.until(lambda: abs(height() - before) < 3)


def test_keys_do_what_their_sheet_says(page: Any) -> None:
    session = page.session
    told = {
        line.split("\t")[0]
        for line in page.page.locator(".fl-sheet dl").evaluate_all(
            "lists => lists.flatMap(list => [...list.children].map(e => e.textContent))"
        )
    }
    table = [command for command in commands(page.view) if command.key]
    assert {command.label for command in table} <= told, "the sheet has every key"
    for number, task in enumerate(TASKS, 1):
        page.key(f"Alt+{number}")
        page.until(lambda task=task: session.task == task)
    page.key("Alt+1")
    page.key("n")
    page.until(lambda: session.selected == "front_right")
    page.key("Control+d")
    page.until(lambda: session.state.layout.n_fins == 5)
    page.key("Control+z")
    page.until(lambda: session.state.layout.n_fins == 4)
    page.key("Control+y")
    page.until(lambda: session.state.layout.n_fins == 5)
    page.key("Control+Shift+z")
    page.until(lambda: page.notes() != [])
    page.key("Control+z")
    page.until(lambda: session.state.layout.n_fins == 4)
    page.key("n")
    page.key("Delete")
    page.until(lambda: session.state.layout.n_fins == 3)
    page.key("Control+z")
    page.key("n")
    page.until(lambda: session.selected is not None)
    page.key("x")
    page.until(lambda: session.state.failed == (session.selected,))
    page.key("x")
    page.until(lambda: session.state.failed == ())
    page.key("Escape")
    page.until(lambda: session.selected is None)
    page.key("i")
    page.until(lambda: session.state.layout.n_fins == 5)
    page.key("Control+j")
    page.until(lambda: session.drawer is None)
    page.key("Control+j")
    page.until(lambda: session.drawer is not None)


def test_the_sheet_of_keys_comes_and_goes(page: Any) -> None:
    sheet = page.page.get_by_role("dialog", name="Keys")
    assert not sheet.is_visible()
    page.key("?")
    sheet.wait_for()
    page.key("n")
    page.key("Escape")
    sheet.wait_for(state="hidden")
    assert page.session.selected is not None, "the first Esc is the sheet's"
    page.page.get_by_role("button", name="Keys").click()
    sheet.wait_for()
    page.page.mouse.click(10, 400)
    sheet.wait_for(state="hidden")


def test_what_is_selected_is_framed(page: Any) -> None:
    def off() -> float:
        canvas = page.page.evaluate(REGIONS)["canvas"]
        x, y = page.pixel("/robot/fins/2")
        return float(abs(x - canvas["x"] - canvas["width"] / 2) + abs(y - canvas["y"] - canvas["height"] / 2))

    page.session.select("back_left")
    page.key("f")
    page.until(lambda: off() < 6.0)
    page.key("Escape")
    page.key("f")
    page.until(lambda: off() > 30.0)


def test_the_list_of_commands_opens_from_the_bar(page: Any) -> None:
    page.press("Commands")
    box = page.page.get_by_placeholder("Search commands")
    box.wait_for()
    page.page.keyboard.type("compare the meth", delay=20)
    page.page.keyboard.press("Enter")
    page.until(lambda: page.session.drawer == "Comparison" and page.view.comparison.state is not None)
    page.until(lambda: not page.view.comparison.running)


def test_the_first_card_goes_away_for_good(new_page: Any) -> None:
    page = new_page(first=True)
    card = page.page.get_by_label("Welcome")
    card.wait_for()
    assert card.get_by_role("listitem").count() == 3
    card.get_by_role("button", name="Move a fin").click()
    page.until(lambda: page.session.task == "Design")
    card.wait_for(state="hidden")
    page.page.reload()
    page.ready()
    page.rest(500)
    assert not card.is_visible()
    page.page.context.close()


def test_panels_are_built_when_they_are_met_and_stay(new_page: Any) -> None:
    page = new_page()
    rows = page.page.locator("label", has_text="Scenario")
    assert rows.count() == 0, "a first page waits for what nobody has asked for"
    page.tab("Simulate")
    page.row("Scenario")
    page.tab("Allocate")
    page.shows("Fx [N]", f"{page.session.state.target[0]:g}")
    assert rows.count() == 1
    page.page.context.close()
