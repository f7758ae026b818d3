"""Design a robot with real keys: from nothing to six fins around a hull, by list, gizmo and numbers."""

from pathlib import Path
from typing import Any

import pytest
import trimesh

PAIRS = (
    ("front_left", "0.19", "13 cm", "0", "1/3*210"),
    ("middle_left", "0", "15 cm", "3 cm", "90"),
    ("back_left <b>", "-19 cm", ".13", "0", "110"),
)
"""Name of the left fin of each pair, where it stands (x, y, z), and its shaft, as one may type it."""


def hull_file(folder: Path) -> Path:
    """A hull that was drawn elsewhere, in mm."""
    shape = trimesh.creation.icosphere(subdivisions=2)
    shape.vertices *= 300.0, 110.0, 80.0
    shape.export(folder / "hull.stl")
    return folder / "hull.stl"


def describe(page: Any, fin: int, texts: tuple[str, ...]) -> None:
    """A row of the list, cell by cell, with Tab between them."""
    keys, cell = page.page.keyboard, page.page.locator(f"[data-edit=fin-name][data-key='{fin}']")
    cell.dblclick()
    for word, text in zip(("name of", "x of", "y of", "z of", "shaft of"), texts, strict=True):
        page.page.locator(f"input.fl-editor[aria-label^='{word}']").wait_for()
        keys.type(text, delay=10)
        keys.press("Enter" if word == "shaft of" else "Tab")
    page.until(lambda: page.page.locator(".fl-editor").count() == 0)


def test_a_robot_from_nothing_to_another_browser(
    page: Any, browser: Any, served: Any, tmp_path: Path
) -> None:
    session = page.session
    page.tab("Design")
    page.press("New")
    page.until(lambda: session.state.layout.name == "New robot" and session.selected == "left")
    page.page.locator(".fin-list [data-press=robot]").click()
    page.page.get_by_text("Not said: mass").wait_for()
    page.unfold("Hull", "Unit of file")
    page.upload("Import a hull (STL, OBJ, GLB)", hull_file(tmp_path))
    page.until(lambda: any("another unit" in note for note in page.notes()))
    page.choose("Unit of file", "mm")
    before = page.vertices("/robot/hull")
    page.upload("Import a hull (STL, OBJ, GLB)", tmp_path / "hull.stl")
    page.until(lambda: session.history.undo_name == "Import hull")
    page.until(lambda: page.vertices("/robot/hull") != before)
    page.press("All")
    page.until(lambda: session.state.layout.body.mass_kg is not None)
    page.page.get_by_text("It is neutral.").or_(page.page.get_by_text("it is neutral")).first.wait_for()
    page.write("robot-name", "Manta <b>")
    page.write("robot-about", "A flat one.\nSix fins.", end="Control+Enter")
    page.until(lambda: session.state.layout.description == "A flat one.\nSix fins.")
    for pair, texts in enumerate(PAIRS):
        if pair:
            page.press("Add a fin")
            page.until(lambda pair=pair: session.state.layout.n_fins == 2 * pair + 1)
        describe(page, 2 * pair, texts)
        page.press("Mirror")
        page.until(lambda pair=pair: session.state.layout.n_fins == 2 * pair + 2)
    page.until(lambda: not page.view.busy)
    layout = session.state.layout
    assert [fin.name for fin in layout.fins[::2]] == [name for name, *_ in PAIRS]
    for left, right in zip(layout.fins[::2], layout.fins[1::2], strict=True):
        x, y, z = right.position
        assert left.position == pytest.approx((x, -y, z))
    assert page.page.locator(".fin-list b, .fl-robot b").count() == 0, "a name is text, never markup"

    page.press("Share")
    page.page.locator(".fl-share input").wait_for()
    link = page.page.locator(".fl-share input").input_value()
    page.page.keyboard.press("Escape")
    page.until(lambda: page.page.locator(".fl-share").count() == 0)
    there = browser.new_context(viewport={"width": 900, "height": 600})
    tab, known = there.new_page(), set(served.app.views)
    tab.goto(link.replace("?", "?fixedDpr=0.3&"))

    def others() -> list[Any]:
        return [view.session for key, view in served.app.views.items() if key not in known]

    page.until(lambda: others() != [] and others()[0].state.layout.names == layout.names)
    assert tab.evaluate("location.hash") == "" and others()[0].history.undo_name == "Open Manta <b>"
    there.close()

    page.download("Save", tmp_path / "robot.zip")
    page.choose("Layout", "A")
    page.until(lambda: session.state.layout.name == "A")
    page.page.locator(".recent", has_text="Manta").first.click()
    page.until(lambda: session.state.layout.name == "Manta <b>")
    page.page.evaluate("location.hash = '#design=yNonsense'")
    page.until(lambda: any("the link holds no whole design" in note for note in page.notes()))
    assert session.state.layout.name == "Manta <b>"
    assert page.problems == []


def test_the_list_selects_marks_and_edits(page: Any) -> None:
    page.tab("Design")
    keys, session = page.page.keyboard, page.session
    row = page.page.locator(".fin-list tr[data-fin=back_left]")
    row.locator(".name").click()
    page.until(lambda: session.selected == "back_left")
    page.page.locator(".fin-list tr[data-fin=front_left] .swatch").click(modifiers=["Control"])
    page.until(lambda: session.selection == ("front_left", "back_left"))
    row.locator("[data-edit=fin-x]").dblclick()
    page.page.locator("input.fl-editor").wait_for()
    keys.type("-12 cmm", delay=15)
    keys.press("Enter")
    page.page.locator(".fl-editor-note", has_text="'-12 cmm' is not a number").wait_for()
    keys.press("Backspace")
    keys.press("Enter")
    page.until(lambda: session.state.layout.fins[2].position[0] == pytest.approx(-0.12))
    state = session.state
    page.page.locator(".fin-list [data-edit=fin-shaft]").first.dblclick()
    keys.type("77", delay=15)
    keys.press("Escape")
    page.until(lambda: page.page.locator(".fl-editor").count() == 0)
    page.catch_up()
    assert session.state == state
    page.page.locator("tr[data-fin=front_right] [data-press=hidden]").click()
    page.visible("/robot/fins/0", False)
    page.page.locator("tr[data-fin=front_left] [data-press=locked]").click()
    page.until(lambda: session.state.locked != ())
    page.page.locator(".fin-list tr[data-fin=front_left] .swatch").click()
    page.page.locator(".fl.head", has_text="Locked").wait_for()
    page.press("Delete")
    page.until(lambda: any("front_left is locked; unlock it" in note for note in page.notes()))
    assert session.state.layout.n_fins == 4


def test_limits_and_model_count_for_all_selected_fins(page: Any) -> None:
    page.tab("Design")
    session = page.session
    page.page.locator(".fin-list tr[data-fin=front_right] .swatch").click()
    page.page.locator(".fin-list tr[data-fin=back_left] .swatch").click(modifiers=["Shift"])
    page.page.locator(".fl.head", has_text="3 fins").wait_for()
    page.type("A [rad]", "30 deg", place=1)
    most = [pytest.approx(0.5236, abs=1e-4)] * 3
    page.until(lambda: [fin.limits.amplitude[1] for fin in session.state.layout.fins[:3]] == most)
    page.choose("Model", "lighthill")
    page.until(lambda: [fin.model.type for fin in session.state.layout.fins] == ["lighthill"] * 3 + ["drag"])
    page.type("Width [m]", "12 cm")
    page.page.locator("svg.plot:visible", has_text="A 0.52 rad").wait_for()
    page.until(lambda: session.history.undo_name == "Width of 3 fins")
    page.type("Width [m]", "-1")
    page.page.locator(".fl.note:visible .missing").wait_for()


def test_the_gizmo_moves_a_linked_pair(page: Any) -> None:
    session = page.session
    page.page.mouse.click(*page.pixel("/robot/fins/0/turn/shaft", (-0.02, 0, 0)))
    page.until(lambda: session.selected == "front_right")
    page.tab("Design")
    page.press("Mirror")
    page.until(lambda: session.state.links == (("front_right", "front_left"),))
    page.until(lambda: session.selected == "front_left")
    page.look_from_above()
    before = session.state.layout
    page.drag(page.pixel("/robot/fins/1", (0.168, 0, 0)), page.pixel("/robot/fins/1", (0.228, 0, 0)))
    page.until(lambda: session.state.layout != before and page.view.scenery.robot.dragged is None)
    page.until(lambda: not page.view.busy)
    right, left = session.state.layout.fins[:2]
    assert left.position[0] == pytest.approx(before.fins[1].position[0] + 0.06, abs=0.02)
    assert right.position == pytest.approx((left.position[0], -left.position[1], left.position[2]))
    page.visible("/robot/ghost")
    page.key("Control+z")
    page.until(lambda: session.state.layout == before)


def test_a_ghost_shows_where_a_held_fin_will_stick(page: Any) -> None:
    page.key("n")
    page.tab("Design")
    page.row("Stick to hull").first.click()
    page.until(lambda: page.session.display.stick)
    page.look_from_above()
    start, end = page.pixel("/robot/fins/0", (0.168, 0, 0)), page.pixel("/robot/fins/0", (0.23, 0, 0))
    with page.held(start, end):
        page.visible("/robot/landing")
    page.visible("/robot/landing", False)
    page.until(lambda: page.session.history.undo_name == "Move front_right")
    stands = page.view.scenery.robot._fins[0].pose()[0]
    assert stands == pytest.approx(page.session.state.layout.fins[0].position, abs=1e-6)


def test_reach_draws_sets_and_compares_layouts(page: Any) -> None:
    page.tab("Reach")
    page.choose("Draw the set of", "forces")
    page.visible("/robot/attainable/now")
    page.until(lambda: "axes independent" in page.text(".score"))
    whole, card = page.vertices("/robot/attainable/now"), page.text(".score")
    page.key("n")
    page.key("x")
    page.until(lambda: page.session.state.failed == ("front_right",))
    page.until(lambda: page.vertices("/robot/attainable/now") != whole and page.text(".score") != card)
    page.visible("/robot/attainable/whole")
    page.choose("Beside", "pair")
    page.until(lambda: not page.view.analyst.busy and "pair" in page.text(".score"))
    page.press("Pin this layout")
    page.until(lambda: page.session.beside == "pinned")
    page.choose("Draw the set of", "none")
    page.visible("/robot/attainable/now", False)


def test_a_search_is_watched_stopped_and_accepted(page: Any) -> None:
    page.tab("Improve")
    session = page.session
    before = session.state.layout
    page.choose("Goal", "power for a mission")
    page.press("Add the present wrench")
    page.until(lambda: session.draft.mission != "")
    page.page.get_by_role("button", name="4", exact=True).locator("visible=true").last.click()
    page.until(lambda: session.draft.held == (before.names[3],))
    page.type("Reach ± [m]", "0.03", place=0)
    page.until(lambda: session.draft.way("all")[0] == 0.03)
    page.press("Search")
    page.until(lambda: page.view.improver.progress is not None or page.view.improver.findings is not None)
    if page.view.improver.findings is None:
        page.view.improver.cancel()  # as the button does; it may be gone before it can be pressed
    page.until(lambda: page.view.improver.findings is not None)
    found = page.view.improver.findings
    accept = page.page.get_by_role("button", name="Accept")
    page.until(lambda: accept.count() == int(found.improved))
    if found.improved:
        page.press("Accept")
        page.until(lambda: session.state.layout == found.layout and page.view.improver.findings is None)
        page.press("Undo")
        page.until(lambda: session.state.layout == before)
