"""Design a robot with real keys: from nothing to six fins around a hull, by gizmo and numbers."""

import math
from pathlib import Path
from typing import Any

import pytest
import trimesh

PAIRS = (
    ("front_left", "0.19", "0.13", "0", "70"),
    ("middle_left", "0", "0.15", "0.03", "90"),
    ("back_left <b>", "-0.19", ".13", "0", "110"),
)
"""Name of the left fin of each pair, where it stands (x, y, z) [m], and its shaft [deg]."""


def hull_file(folder: Path) -> Path:
    """A hull that was drawn elsewhere, in mm."""
    shape = trimesh.creation.icosphere(subdivisions=2)
    shape.vertices *= 300.0, 110.0, 80.0
    shape.export(folder / "hull.stl")
    return folder / "hull.stl"


def describe(page: Any, texts: tuple[str, ...]) -> None:
    """What the inspector has of the selected fin: name, place, shaft."""
    session = page.session
    name, x, y, z, shaft = texts
    page.page.locator(".fl.head b", has_text="1").or_(
        page.page.locator(".fl.head b")
    ).first.wait_for()
    page.type("Name", name)
    page.until(lambda: session.selected == name)
    for place, text in enumerate((x, y, z)):
        page.type("Position [m]", text, place)
    where = pytest.approx([float(x), float(y), float(z)])
    page.until(lambda: session.state.layout.fins[-1].position == where)
    page.type("Shaft [°]", shaft)


def test_a_robot_from_nothing_to_another_browser(
    page: Any, browser: Any, served: Any, tmp_path: Path
) -> None:
    session = page.session
    page.tab("Design")
    page.press("New")
    page.page.locator(".fl-ask button", has_text="Fin").click()
    page.until(lambda: session.state.layout.name == "New robot" and session.selected == "left")
    page.page.locator(".fin-list [data-press=robot]").click()
    page.page.get_by_text("Not said: mass").wait_for()
    page.unfold("Hull", "Centre of gravity")
    page.upload("Import a hull (STL, OBJ, GLB)", hull_file(tmp_path))
    before = page.vertices("/robot/hull")
    page.page.locator(".fl-ask button", has_text="mm: ").click()
    page.until(lambda: session.history.undo_name == "Import hull")
    assert session.state.layout.body.hull.scale == 0.001
    page.until(lambda: page.vertices("/robot/hull") != before)
    page.press("Estimate")
    page.until(lambda: session.state.layout.body.mass_kg is not None)
    page.page.get_by_text("It is neutral.").or_(
        page.page.get_by_text("it is neutral")
    ).first.wait_for()
    page.type("Name", "Manta <b>")
    page.page.locator("textarea:visible").first.fill("A flat one.\nSix fins.")
    page.row("Name").first.focus()
    page.until(lambda: session.state.layout.description == "A flat one.\nSix fins.")
    for pair, texts in enumerate(PAIRS):
        if pair == 0:
            page.page.locator(".fin-list tr[data-fin=left] .name").click()
            page.until(lambda: session.selected == "left")
        else:
            page.press("Fin")
            page.until(lambda pair=pair: session.state.layout.n_fins == 2 * pair + 1)
        describe(page, texts)
        page.press("Mirror")
        page.until(lambda pair=pair: session.state.layout.n_fins == 2 * pair + 2)
    page.until(lambda: not page.view.busy)
    layout = session.state.layout
    assert [fin.name for fin in layout.fins[::2]] == [name for name, *_ in PAIRS]
    for left, right in zip(layout.fins[::2], layout.fins[1::2], strict=True):
        x, y, z = right.position
        assert left.position == pytest.approx((x, -y, z))
    assert page.page.locator(".fin-list b, .fl-robot b").count() == 0, (
        "a name is text, never markup"
    )

    page.press("Share")
    page.page.locator(".fl-ask input").wait_for()
    link = page.page.locator(".fl-ask input").input_value()
    page.page.keyboard.press("Escape")
    page.until(lambda: page.page.locator(".fl-ask").count() == 0)
    there = browser.new_context(viewport={"width": 900, "height": 600})
    tab = there.new_page()
    known = set(served.app.views)
    tab.goto(link.replace("?", "?fixedDpr=0.1&"))

    def others() -> list[Any]:
        return [view.session for key, view in served.app.views.items() if key not in known]

    page.until(lambda: others() != [] and others()[0].state.layout.names == layout.names)
    assert tab.evaluate("location.hash") == "" and others()[0].history.undo_name == "Open Manta <b>"
    there.close()

    page.download("Save", tmp_path / "robot.zip")
    page.page.evaluate("location.hash = '#design=yNonsense'")
    page.until(lambda: any("the link holds no whole design" in note for note in page.notes()))
    assert session.state.layout.name == "Manta <b>"
    assert page.problems == []


def test_the_list_selects(page: Any) -> None:
    page.tab("Design")
    session = page.session
    row = page.page.locator(".fin-list tr[data-fin=back_left]")
    row.locator(".name").click()
    page.until(lambda: session.selected == "back_left")
    page.page.locator(".fin-list tr[data-fin=front_left] .swatch").click(modifiers=["Control"])
    page.until(lambda: session.selection == ("front_left", "back_left"))
    page.page.locator(".fin-list tr[data-fin=front_right] .name").hover()
    page.page.mouse.down()
    page.page.evaluate(
        "document.querySelectorAll('.fin-list').forEach(list => list.outerHTML += '')"
    )
    page.page.mouse.up()  # on a list that was rendered again meanwhile
    page.until(lambda: session.selected == "front_right")


def test_limits_and_model_count_for_all_selected_fins(page: Any) -> None:
    page.tab("Design")
    session = page.session
    page.page.locator(".fin-list tr[data-fin=front_right] .swatch").click()
    for name in ("front_left", "back_left"):
        page.page.locator(f".fin-list tr[data-fin={name}] .swatch").click(modifiers=["Control"])
    page.page.locator(".fl.head", has_text="3 actuators").wait_for()
    page.type("A [°]", "30", place=1)
    most = [math.radians(30.0)] * 3
    page.until(lambda: [fin.limits.amplitude[1] for fin in session.state.layout.fins[:3]] == most)
    page.choose("Model", "lighthill")
    page.until(
        lambda: (
            [fin.model.type for fin in session.state.layout.fins] == ["lighthill"] * 3 + ["drag"]
        )
    )
    page.type("Width [m]", "0.12")
    page.page.locator("svg.plot:visible", has_text="A 30°").first.wait_for()
    page.until(lambda: session.history.undo_name == "Width of 3 actuators")
    page.type("Width [m]", "-1")
    page.until(lambda: any("must lie within" in note for note in page.notes()))


def test_the_gizmo_moves_a_linked_pair(page: Any) -> None:
    session = page.session
    page.page.mouse.click(*page.pixel("/robot/fins/0/turn/shaft", (-0.02, 0, 0)))
    page.until(lambda: session.selected == "front_right")
    page.tab("Design")
    page.press("Mirror")
    page.until(lambda: session.state.layout.mirror_pairs == (("front_right", "front_left"),))
    page.until(lambda: session.selected == "front_left")
    page.look_from_above()
    before = session.state.layout
    page.drag(
        page.pixel("/robot/fins/1", (0.168, 0, 0)), page.pixel("/robot/fins/1", (0.228, 0, 0))
    )
    page.until(lambda: session.state.layout != before and page.view.scenery.robot.dragged is None)
    page.until(lambda: not page.view.busy)
    right, left = session.state.layout.fins[:2]
    assert left.position[0] == pytest.approx(before.fins[1].position[0] + 0.06, abs=0.02)
    assert right.position == pytest.approx((left.position[0], -left.position[1], left.position[2]))
    page.key("Control+z")
    page.until(lambda: session.state.layout == before)


def test_reach_draws_sets_and_compares_layouts(page: Any) -> None:
    page.tab("Reach")
    page.choose("Draw the set of", "forces")
    page.visible("/robot/attainable/now")
    page.until(lambda: "independent directions" in page.text(".score"))
    whole = page.vertices("/robot/attainable/now")
    card = page.text(".score")
    page.key("n")
    page.key("x")
    page.until(lambda: page.session.state.lost == ("front_right",))
    page.until(
        lambda: page.vertices("/robot/attainable/now") != whole and page.text(".score") != card
    )
    page.visible("/robot/attainable/whole")
    page.choose("Draw the set of", "none")
    page.visible("/robot/attainable/now", False)


def test_a_search_is_watched_stopped_and_accepted(page: Any) -> None:
    page.tab("Improve")
    session = page.session
    before = session.state.layout
    page.choose("Goal", "power for a mission")
    page.page.get_by_role("button", name="4", exact=True).locator("visible=true").last.click()
    page.until(lambda: session.draft.fixed == (before.names[3],))
    page.type("Reach ± [m]", "0.03", place=0)
    improver = page.view.jobs.improver
    page.until(lambda: session.draft.range_of(session.state.layout)[0] == 0.03)
    page.press("Search")
    page.until(lambda: improver.progress is not None or improver.answer is not None)
    if improver.answer is None:
        improver.stop()  # as the button does; it may be gone before it can be pressed
    page.until(lambda: improver.answer is not None)
    found = improver.answer
    accept = page.page.get_by_role("button", name="Accept")
    page.until(lambda: accept.count() == int(found.improved))
    if found.improved:
        page.press("Accept")
        page.until(lambda: session.state.layout == found.layout and improver.answer is None)
        page.press("Undo")
        page.until(lambda: session.state.layout == before)


def test_what_would_be_lost_is_asked_about_and_typed_values_are_steps(page: Any) -> None:
    page.tab("Design")
    session = page.session
    card = page.page.locator(".fl-ask")
    for key, mass in (("Escape", 19.0), ("Enter", None)):
        page.press("Forget")
        card.wait_for()
        page.page.keyboard.press(key)
        page.until(
            lambda mass=mass: card.count() == 0 and session.state.layout.body.mass_kg == mass
        )
    page.shows("Mass [kg]", "")
    page.key("Control+z")
    page.shows("Mass [kg]", "19")
    page.key("n")
    place = session.state.layout.position[0].tolist()
    for axis, value in enumerate(("0.3", "0.2")):
        page.type("Position [m]", value, axis)
    page.until(lambda: session.state.layout.position[0].tolist() == [0.3, 0.2, place[2]])
    page.key("Control+z")
    page.until(lambda: session.state.layout.position[0].tolist() == [0.3, *place[1:]])
    page.tab("Simulate")
    drops = "window.finlabDrops === {}"
    page.press("Start")
    page.page.wait_for_function(drops.format("true"))
    page.press("End")
    page.page.wait_for_function(drops.format("false"))
    page.press("New")
    page.page.locator(".fl-ask").get_by_role("button", name="Rudder", exact=True).click()
    page.until(
        lambda: session.desk.task == "Design" and session.state.layout.flow_driven == ("left",)
    )
    page.type("Speed through the water [m/s]", "1.5")
    page.until(lambda: session.state.speed == 1.5 and "give nothing" not in page.text(".score"))
    page.row("Layout").first.click()
    page.page.keyboard.type("octo")  # in place of what is chosen there
    page.page.keyboard.press("Enter")
    page.until(lambda: session.state.layout.name == "octo")
    assert page.problems == []
