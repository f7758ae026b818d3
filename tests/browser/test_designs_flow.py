"""A design from nothing, described, saved, shared by a link that another browser opens, and found again."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.browser.test_inspector_flow import typed


def write(page: Any, kind: str, text: str, end: str = "Enter") -> None:
    """Real keys into a name that is edited where it stands."""
    page.page.locator(f"[data-edit={kind}]:visible").first.click()
    page.page.locator(".fl-editor").wait_for()
    page.page.keyboard.type(text, delay=10)
    page.page.keyboard.press(end)
    page.until(lambda: page.page.locator(".fl-editor").count() == 0)


def test_a_robot_from_nothing_goes_to_another_browser_by_a_link(
    page: Any, new_page: Callable[..., Any], browser: Any, served: Any, tmp_path: Path
) -> None:
    page.tab("Design")
    page.press("New")
    page.until(lambda: page.session.state.layout.name == "New robot" and page.session.selected == "left")
    page.press("Mirror")
    page.until(lambda: page.session.state.layout.n_fins == 2)
    page.page.locator(".fin-list [data-press=robot]").click()
    write(page, "robot-name", "Manta <b>")
    page.until(lambda: page.session.state.layout.name == "Manta <b>")
    write(page, "robot-about", "A flat one.\nTwo fins.", end="Control+Enter")
    page.until(lambda: page.session.state.layout.description == "A flat one.\nTwo fins.")
    page.press("All")
    page.until(lambda: page.session.history.undo_name == "Estimate mass and damping from the hull")
    page.page.locator(".fl.head:visible", has_text="It is neutral.").wait_for()
    typed(page, "Mass [kg]", "18.5")
    page.until(lambda: page.session.state.layout.body.mass_kg == 18.5)

    page.press("Share")
    page.page.locator(".fl-share input").wait_for()
    link = page.page.locator(".fl-share input").input_value()
    assert "#design=" in link and len(link) < 2_000
    page.page.get_by_role("button", name="Copy the link").click()
    page.page.keyboard.press("Escape")
    page.until(lambda: page.page.locator(".fl-share").count() == 0)

    there = browser.new_context(viewport={"width": 900, "height": 600})
    tab = there.new_page()
    before = set(served.app.views)
    tab.goto(link.replace("?", "?fixedDpr=0.3&"))

    def others() -> list[Any]:
        return [view.session for key, view in served.app.views.items() if key not in before]

    page.until(lambda: others() != [] and others()[0].state.layout == page.session.state.layout)
    assert tab.evaluate("location.hash") == "" and others()[0].history.undo_name == "Open Manta <b>"
    assert tab.locator("b b").count() == 0, "a name is text, never markup"
    there.close()

    with page.page.expect_download() as download:
        write(page, "save-as", "Manta 2")
    assert download.value.suggested_filename == "Manta_2.yaml"
    page.choose("Layout", "A")
    page.until(lambda: page.session.state.layout.name == "A")
    page.page.locator(".recent", has_text="Manta 2").click()
    page.until(lambda: page.session.state.layout.name == "Manta 2")


def test_a_wrong_link_is_told_and_changes_nothing(page: Any) -> None:
    page.tab("Design")
    before = page.session.state
    page.page.evaluate("location.hash = '#design=yNonsense'")
    page.until(lambda: any("the link holds no whole design" in note for note in page.notes()))
    assert page.session.state == before and page.page.evaluate("location.hash") == ""
