"""What the page does beside viser's own habits: gizmos where they belong, a camera that leaves Ctrl alone."""

from typing import Any

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
    page.tab("Design")
    page.until(lambda: all(fin._move.active_axes) and not grips[0].visible)
    page.key("g")
    page.until(lambda: grips[0].visible and not any(fin._move.active_axes))
    page.key("g")
    page.until(lambda: all(fin._move.active_axes))
    page.tab("Allocate")
    page.until(lambda: not any(fin._move.active_axes))


def test_one_note_at_a_time_and_undo_says_what(page: Any) -> None:
    for _ in range(3):
        page.key("Control+Shift+z")
    page.until(lambda: page.notes() != [])
    page.rest(600)
    assert len(page.notes()) == 1
    page.press("Dive")
    page.page.get_by_role("button", name="Undo: Preset Dive").wait_for()
    page.press("Undo")
    page.page.get_by_role("button", name="Redo: Preset Dive").wait_for()
    page.key("Control+y")
    page.page.get_by_role("button", name="Undo: Preset Dive").wait_for()
