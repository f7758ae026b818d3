"""The frame: each task has its regions, nothing lies over anything else, keys do what is said."""

from importlib.resources import files
from itertools import combinations
from pathlib import Path
from typing import Any

import PIL.Image
import pytest

from finlab.layout import load_layout
from webapp.session.looking import DRAWERS, TASKS

WINDOW_SIZES = ((1400, 860), (900, 700))
"""Widths and heights of the window [px]: a laptop, and a small one."""
NAMING_MS = 120
"""Until new parts have their names."""
NO_TRANSITION_SCRIPT = "() => !document.getAnimations().some((one) => one instanceof CSSTransition)"
"""Script: whether no transition runs."""
REGIONS_SCRIPT = """() => {
  const shown = (e) => e && getComputedStyle(e).visibility === 'visible' && e.getClientRects().length > 0;
  const found = {};
  for (const name of ['top', 'left', 'right', 'drawer']) {
    const box = document.querySelector(`.fl-${name}`).closest('.mantine-Paper-root');
    if (shown(box)) found[name] = box.getBoundingClientRect().toJSON();
  }
  found.canvas = document.querySelector('canvas[data-engine]').getBoundingClientRect().toJSON();
  return found;
}"""
"""Script: name of a region that is shown -> its box."""
OVERLAYS_SCRIPT = """() => Object.fromEntries(['canvas[data-engine]', '.fl-camera', '.fl-corner'].map((name) =>
  [name, document.querySelector(name).getBoundingClientRect().toJSON()]))"""
"""Script: boxes of the view, of the buttons of its camera and of its corner."""
SMALL_TYPE_SCRIPT = """() => {
  const found = new Set(), walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let text; (text = walk.nextNode()); ) {
    const box = text.parentElement, style = getComputedStyle(box);
    if (!text.data.trim() || style.visibility !== 'visible' || !box.getClientRects().length) continue;
    if (box.closest('style, script, svg, .fl-chrome')) continue;
    if (parseFloat(style.fontSize) < 13) found.add(`${text.data.trim()}: ${style.fontSize}`);
  }
  return [...found];
}"""
"""Script: texts that are shown smaller than they should be."""
WIDE_CONTENT_SCRIPT = """() => {
  const found = [];
  for (const name of ['top', 'left', 'right', 'drawer']) {
    const box = document.querySelector(`.fl-${name}`).closest('.mantine-Paper-root');
    if (box.scrollWidth > box.clientWidth + 1)
      found.push(`${name}: ${box.scrollWidth} of ${box.clientWidth} px`);
  }
  return found;
}"""
"""Script: what is wider than the region in which it is."""
CAMERA_SCRIPT = "() => window.__viserMutable.camera.position.toArray()"
"""Script: where the camera is."""


def settle(page: Any) -> None:
    """Wait until the page has laid itself out, new parts have their names, and colors have faded
    in."""
    page.rest(NAMING_MS)
    page.page.wait_for_function(NO_TRANSITION_SCRIPT)


def overlaps(boxes: dict[str, dict[str, float]]) -> list[str]:
    """Pairs of boxes that share more than a pixel."""
    found = []
    for (one, a), (other, b) in combinations(boxes.items(), 2):
        across = min(a["right"], b["right"]) - max(a["left"], b["left"])
        down = min(a["bottom"], b["bottom"]) - max(a["top"], b["top"])
        if across > 1 and down > 1:
            found.append(f"{one} and {other} share {across:.0f} x {down:.0f} px")
    return found


@pytest.mark.parametrize("size", WINDOW_SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def test_nothing_lies_over_anything_else(resized: Any, size: tuple[int, int]) -> None:
    page = resized
    width, height = size
    page.page.set_viewport_size({"width": width, "height": height})
    page.session.rename_robot("A robot with quite a long name")  # and so a step with one
    for task in TASKS:
        for name in DRAWERS[task] or (task,):
            page.tab(name)
            settle(page)
            boxes = page.page.evaluate(REGIONS_SCRIPT)
            assert overlaps(boxes) == [], f"{name} at {width} x {height}"
            assert {"top", "right", "canvas"} <= set(boxes), name
            canvas = boxes["canvas"]
            assert canvas["width"] >= 480 and canvas["height"] >= 240, "the robot can be seen"
            for box in boxes.values():
                assert box["left"] >= 0 and box["right"] <= width and box["bottom"] <= height
            assert page.page.evaluate(SMALL_TYPE_SCRIPT) == [], f"type of 13 px at least, in {name}"
            assert page.page.evaluate(WIDE_CONTENT_SCRIPT) == [], (
                f"nothing is cut off in {name} at {width} x {height}"
            )
            if size == (900, 700):  # a small view has its words beside it
                assert overlaps(page.page.evaluate(OVERLAYS_SCRIPT)) == [], name
    assert page.problems == []


def test_a_phone_watches(resized: Any) -> None:
    page = resized
    page.page.set_viewport_size({"width": 390, "height": 844})
    page.session.open_layout(load_layout("turtle_hybrid"))
    page.session.set_target(0, 60.0)
    page.view.do(lambda: None)
    for task in TASKS:
        page.tab(task)
        settle(page)
        boxes = {
            name: box
            for name, box in page.page.evaluate(REGIONS_SCRIPT).items()
            if box["height"] > 0.0
        }
        assert overlaps(boxes) == [] and boxes["canvas"]["height"] > 200, task
        assert ("left" in boxes) == (task == "Log"), "what is said of a log is read there"
        assert page.page.evaluate("document.documentElement.scrollWidth") == 390, (
            "nothing is beside the page"
        )
        for box in (*boxes.values(), page.page.locator(".fl-status").bounding_box()):
            assert (
                box["x"] >= 0 and box["x"] + box["width"] <= 390 and box["y"] + box["height"] <= 844
            )
    page.tab("Allocate")
    page.until(lambda: "Out of reach" in page.text(".fl-status .pill"))
    page.type("Fx [N]", "1.2")
    page.until(lambda: page.text(".fl-status .pill") == "Exact")
    page.page.get_by_role("button", name="Fold the drawer").click()
    page.until(lambda: page.page.evaluate(REGIONS_SCRIPT)["canvas"]["height"] > 500)
    page.page.get_by_role("button", name="Open the drawer").click()


def test_the_view_is_saved_as_it_is_seen(page: Any, tmp_path: Path) -> None:
    page.page.locator(".fl-camera button", has_text="3D").click()
    with PIL.Image.open(page.download("Picture", tmp_path / "view.png")) as picture:
        seen = picture.convert("RGB")
    assert seen.width == 2 * round(page.page.evaluate(REGIONS_SCRIPT)["canvas"]["width"])
    colors = {color for _, color in seen.getcolors(seen.width * seen.height)}
    assert len(colors) > 500, "water, hull and fins, not an empty canvas"


def test_the_drawer_is_folded(page: Any) -> None:
    def height() -> float:
        return float(page.page.evaluate(REGIONS_SCRIPT)["drawer"]["height"])

    before = height()
    page.page.get_by_role("button", name="Fold the drawer").click()
    page.until(lambda: height() < 40)
    page.page.get_by_role("button", name="Open the drawer").click()
    page.until(lambda: height() == pytest.approx(before, abs=3))


def test_keys_do_what_the_list_of_commands_says(page: Any) -> None:
    session = page.session
    page.key("Alt+1")
    page.until(lambda: session.desk.task == "Design")
    for key, n_fins in (
        ("n", 4),
        ("Control+d", 5),
        ("Control+z", 4),
        ("Control+y", 5),
        ("Control+z", 4),
    ):
        page.key(key)
        page.until(lambda n_fins=n_fins: session.state.layout.n_fins == n_fins)
    page.page.get_by_role("button", name="Redo: Duplicate").first.wait_for()
    page.key("n")
    page.until(lambda: session.selected is not None)
    page.key("x")
    page.until(lambda: session.state.lost == (session.selected,))
    page.key("Delete")
    page.until(lambda: session.state.layout.n_fins == 3)
    for _ in range(3):
        page.key("Control+Shift+z")
    page.until(
        lambda: len(page.notes()) == 1, told=lambda: f"{len(page.notes())} notes, expected one"
    )
    page.key("Escape")
    page.until(lambda: session.selected is None)
    page.key("Control+j")
    page.until(lambda: session.drawer is None)
    page.key("Control+j")
    page.until(lambda: session.drawer is not None)


def test_the_camera_frames_turns_and_leaves_ctrl_alone(page: Any) -> None:
    def off() -> float:
        canvas = page.page.evaluate(REGIONS_SCRIPT)["canvas"]
        x, y = page.pixel("/robot/fins/2")
        return float(
            abs(x - canvas["x"] - canvas["width"] / 2) + abs(y - canvas["y"] - canvas["height"] / 2)
        )

    page.session.select("back_left")
    page.key("f")
    page.until(lambda: off() < 6.0)
    page.page.get_by_role("button", name="Side").click()
    page.until(lambda: off() > 30.0)
    before = page.page.evaluate(CAMERA_SCRIPT)
    page.page.keyboard.down("Control")
    page.page.keyboard.down("d")
    page.rest(400)
    page.page.keyboard.up("d")
    page.page.keyboard.up("Control")
    assert page.page.evaluate(CAMERA_SCRIPT) == before
    page.page.locator("[role=slider]:visible").first.focus()
    asked = page.session.state.target
    page.page.keyboard.press("ArrowRight", delay=300)
    page.until(lambda: page.session.state.target != asked)
    assert page.page.evaluate(CAMERA_SCRIPT) == before, "an arrow key on a slider is the slider's"
    page.page.evaluate("document.activeElement.blur()")
    page.page.keyboard.down("d")
    page.until(lambda: page.page.evaluate(CAMERA_SCRIPT) != before)
    page.page.keyboard.up("d")


def test_only_what_changes_is_drawn(page: Any) -> None:
    """viser itself draws once a second in any case."""

    def drawn() -> int:
        return int(page.page.evaluate("window.finlabFrames.count"))

    view = page.view
    page.until(
        lambda: not (view.busy or view.jobs.analyst.busy or view.jobs.ranging.busy)
    )  # all has come
    page.catch_up()

    def rests() -> bool:
        before = drawn()
        page.rest(1500)
        return drawn() == before

    # The last frame of what has come may be the one that viser draws a second later.
    page.until(rests, 30.0, lambda: "a page that nobody touches goes on drawing frames")
    before = drawn()
    blade = "() => window.__viserMutable.nodeRefFromName['/robot/fins/0/turn/blade'].quaternion.x"
    still = page.page.evaluate(blade)
    page.key("h")
    page.until(lambda: page.page.evaluate(blade) != still and drawn() > before)
    page.key("h")
    page.until(lambda: page.page.evaluate(blade) == pytest.approx(still, abs=1e-6))


def test_what_is_typed_counts_with_enter(page: Any) -> None:
    session = page.session
    page.type("Fx [N]", "0.55")
    page.until(lambda: session.state.target[0] == 0.55)
    page.key("n")
    page.tab("Design")
    page.type("Position [m]", "0.19", 0)
    page.until(lambda: session.state.layout.fins[0].position[0] == 0.19)
    assert page.problems == []


AXE = files("axe_playwright_python").joinpath("axe.min.js").read_text("utf-8")
"""axe-core itself, as its wrapper for Python ships it."""
AXE_SCRIPT = """rules => axe.run(
  document, { resultTypes: ['violations'], preload: false, ...(rules && { runOnly: rules }) })"""
"""Script: what axe-core finds against accessibility, by some of its rules or by all."""
SCHEME_SCRIPT = "scheme => document.documentElement.dataset.mantineColorScheme === scheme"
"""Script: whether the page has a colour scheme, light or dark."""
GRAVE = ("moderate", "serious", "critical")
"""Impacts that are mended before anything lands."""


def findings(page: Any, rules: list[str] | None = None) -> list[str]:
    """What it finds that is grave on what is seen now, one line for each kind; by some rules, or by
    all."""
    tab = page.page
    settle(page)
    if not tab.evaluate("() => typeof axe === 'object'"):
        tab.evaluate(AXE)
    found = []
    for violation in tab.evaluate(AXE_SCRIPT, rules)["violations"]:
        if violation["impact"] in GRAVE:
            nodes = violation["nodes"]
            first = nodes[0]["html"][:160].replace("\n", " ")
            found.append(
                f"{violation['id']}, {len(nodes)} times: {violation['help']}, as in {first}"
            )
    return found


def test_no_serious_finding_light_or_dark(page: Any) -> None:
    page.tab("Design")
    assert findings(page) == [], "nothing selected"
    page.key("n")
    for task in TASKS:
        for name in DRAWERS[task] or (task,):
            page.tab(name)
            assert findings(page) == [], name
    page.key("Control+k")
    page.page.get_by_placeholder("Search commands").wait_for()
    assert findings(page) == [], "commands"
    page.page.keyboard.press("Escape")
    page.session.set_display("dark", True)  # where nothing but colours is another
    page.key("Alt+1")
    page.page.wait_for_function(SCHEME_SCRIPT, arg="dark")
    for task in TASKS:
        for name in DRAWERS[task] or (task,):
            page.tab(name)
            assert findings(page, ["color-contrast"]) == [], f"{name}, dark"
    page.tab("Comparison")
    page.press("Compare the methods")
    page.until(lambda: not page.view.jobs.comparison.run.running)
    assert findings(page, ["color-contrast"]) == [], "methods compared, dark"


def test_boxes_have_names_and_one_without_is_found(page: Any) -> None:
    page.tab("Design")
    page.key("n")
    page.row("Position [m]").last.wait_for()
    boxes = page.row("Position [m]")
    wanted = [f"Position [m], {k + 1} of 3" for k in range(3)]
    page.until(lambda: [box.get_attribute("aria-label") for box in boxes.all()] == wanted)
    page.page.evaluate(
        "() => document.body.append(Object.assign(document.createElement('input'), { id: 'it' }))"
    )
    assert any(line.startswith("label, 1 times") for line in findings(page, ["label"]))
    page.page.evaluate("() => document.getElementById('it').remove()")
