"""What the page does beside viser's own habits: gizmos where they belong, a camera that leaves Ctrl alone."""

from typing import Any

WIDTH = "() => document.querySelector('[role=tablist]').getBoundingClientRect().width"
CAMERA = "() => window.__viserMutable.camera.position.toArray()"


def test_with_ctrl_the_camera_stays(page: Any) -> None:
    page.page.evaluate("document.activeElement?.blur()")
    before = page.page.evaluate(CAMERA)
    page.page.keyboard.down("Control")
    page.page.keyboard.down("d")
    page.rest(500)
    page.page.keyboard.up("d")
    page.page.keyboard.up("Control")
    assert page.page.evaluate(CAMERA) == before
    page.page.keyboard.down("d")
    page.until(lambda: page.page.evaluate(CAMERA) != before)
    page.page.keyboard.up("d")


def test_one_set_of_handles_at_a_time(page: Any) -> None:
    page.key("n")
    page.until(lambda: page.session.selected == "front_right")
    fin = page.view.scenery.robot._fins[0]
    grips = page.view.scenery.robot.grips._gizmos
    page.until(lambda: not any(fin._move.active_axes), 10)
    page.tab("Layout")
    page.until(lambda: all(fin._move.active_axes) and not grips[0].visible)
    page.key("g")
    page.until(lambda: grips[0].visible and not any(fin._move.active_axes))
    page.key("g")
    page.until(lambda: all(fin._move.active_axes))
    page.tab("Wrench")
    page.until(lambda: not any(fin._move.active_axes))


def test_a_panel_that_had_to_shrink_grows_again_and_covers_nothing(new_page: Any) -> None:
    page = new_page()
    page.page.set_viewport_size({"width": 1400, "height": 700})
    page.rest(800)
    wide = page.page.evaluate(WIDTH)
    page.page.set_viewport_size({"width": 500, "height": 700})
    page.rest(800)
    status = page.page.locator(".fl-status").bounding_box()
    undo = page.page.get_by_role("button", name="Undo", exact=True).bounding_box()
    assert status["y"] + status["height"] <= undo["y"], "the status line covers no button"
    page.page.set_viewport_size({"width": 1400, "height": 700})
    page.until(lambda: abs(page.page.evaluate(WIDTH) - wide) < 5)
    tabs = page.page.locator("[role=tablist]").bounding_box()
    row = page.page.get_by_role("button", name="Cruise", exact=True).bounding_box()
    page.page.mouse.move(row["x"] + 20, row["y"] + 8)
    hint = page.page.locator(".mantine-Tooltip-tooltip").first
    hint.wait_for()
    box = hint.bounding_box()
    assert box["x"] + box["width"] <= tabs["x"], "a hint stands beside the panel"
    page.page.context.close()


def test_one_note_at_a_time_and_undo_says_what(page: Any) -> None:
    for _ in range(3):
        page.press("Redo")
    page.until(lambda: page.notes() != [])
    page.rest(600)
    assert len(page.notes()) == 1
    page.press("Dive")
    page.until(lambda: "Undo: Preset Dive" in page.text(".fl.steps"))
    page.press("Undo")
    page.until(lambda: "Redo: Preset Dive" in page.text(".fl.steps"))
