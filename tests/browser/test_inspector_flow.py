"""Describe fins with real keys: the list, names, limits, models, several fins at once."""

from typing import Any

import pytest


def test_a_name_and_a_place_are_edited_in_the_list(page: Any) -> None:
    page.tab("Design")
    keys = page.page.keyboard
    row = page.page.locator(".fin-list tr[data-fin=back_left]")
    row.locator("td").last.wait_for()
    row.locator(".name").click()
    page.until(lambda: page.session.selected == "back_left")
    page.page.locator(".fin-list tr[data-fin=front_left] .swatch").click(modifiers=["Control"])
    page.until(lambda: page.session.selection == ("front_left", "back_left"))
    before = page.view.client.camera.position

    row.locator("[data-edit=fin-name]").dblclick()
    page.page.locator("input.fl-editor").wait_for()
    keys.type("wasd <b>stern</b>", delay=15)
    keys.press("Tab")
    page.until(lambda: page.session.state.layout.names[2] == "wasd <b>stern</b>")
    page.page.locator("input.fl-editor[aria-label^='x of']").wait_for()  # Tab goes on to the next cell
    keys.type("-12 cmm", delay=15)
    keys.press("Enter")
    page.page.locator(".fl-editor-note", has_text="'-12 cmm' is not a number").wait_for()
    keys.press("Backspace")
    keys.press("Enter")
    page.until(lambda: page.session.state.layout.fins[2].position[0] == pytest.approx(-0.12))
    page.until(lambda: page.page.locator(".fl-editor").count() == 0)
    assert (page.view.client.camera.position == before).all(), "the camera owns the same letters"
    assert page.page.locator(".fin-list b").count() == 0, "a name is text, never markup"
    page.key("Control+z")
    page.until(lambda: page.session.state.layout.fins[2].position[0] != pytest.approx(-0.12))


def test_escape_leaves_a_cell_as_it_was(page: Any) -> None:
    page.tab("Design")
    before = page.session.state
    page.page.locator(".fin-list [data-edit=fin-shaft]").first.dblclick()
    page.page.keyboard.type("77", delay=15)
    page.page.keyboard.press("Escape")
    page.until(lambda: page.page.locator(".fl-editor").count() == 0)
    page.catch_up()
    assert page.session.state == before


def typed(page: Any, label: str, text: str, place: int = 0) -> None:
    """Real keys into one box of a row."""
    page.row(label).nth(place).click()
    page.page.keyboard.press("Control+a")
    page.page.keyboard.type(text, delay=15)
    page.page.keyboard.press("Enter")
    page.rest(120)


def fins(page: Any) -> tuple[Any, ...]:
    """The fins as the session holds them."""
    return tuple(page.session.state.layout.fins)


def test_limits_and_model_count_for_all_selected_fins(page: Any) -> None:
    page.tab("Design")
    page.page.locator(".fin-list tr[data-fin=front_right] .swatch").click()
    page.page.locator(".fin-list tr[data-fin=back_left] .swatch").click(modifiers=["Shift"])
    page.until(lambda: len(page.session.selection) == 3)
    page.page.locator(".fl.head", has_text="3 fins").wait_for()
    typed(page, "A [rad]", "30 deg", place=1)
    most = [pytest.approx(0.5236, abs=1e-4)] * 3
    page.until(lambda: [fin.limits.amplitude[1] for fin in fins(page)[:3]] == most)
    page.choose("Model", "lighthill")
    page.until(lambda: [fin.model.type for fin in fins(page)] == ["lighthill"] * 3 + ["drag"])
    page.page.locator("label:visible", has_text="Width [m]").wait_for()
    assert page.page.locator("label:visible", has_text="Lever [m]").count() == 0
    typed(page, "Width [m]", "12 cm")
    page.until(lambda: [dict(fin.model.parameters) for fin in fins(page)[:3]] == [{"width": 0.12}] * 3)
    page.page.locator("svg.plot:visible", has_text="A 0.52 rad").wait_for()
    assert page.session.history.undo_name == "Width of 3 fins"
    typed(page, "Width [m]", "-1")
    page.until(lambda: "must be above 0" in "".join(page.page.locator(".fl.note:visible").all_inner_texts()))
    page.until(lambda: not page.view.busy and page.view.shown.layout == page.session.state.layout)


def test_a_locked_and_hidden_fin(page: Any) -> None:
    page.tab("Design")
    page.page.locator("tr[data-fin=front_right] [data-press=hidden]").click()
    page.visible("/robot/fins/0", False)
    page.page.locator("tr[data-fin=front_left] [data-press=locked]").click()
    page.until(lambda: page.session.state.locked == ("front_left",))
    page.page.locator(".fin-list tr[data-fin=front_left] .swatch").click()
    page.page.locator(".fl.head", has_text="Locked").wait_for()
    page.press("Delete")
    page.until(lambda: any("front_left is locked; unlock it" in note for note in page.notes()))
    assert page.session.state.layout.n_fins == 4
    page.press("Up")
    page.until(lambda: len(page.notes()) > 0)
