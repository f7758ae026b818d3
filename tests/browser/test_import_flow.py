"""What a file of others leaves open is asked in a dialog, and what was taken stays in a list; a
sample log shows its robot and its moment."""

from pathlib import Path
from typing import Any

from tests.exchange.test_questions import MATRIX, PLAIN_URDF

DIALOG = ".fl-inquiry [role=dialog]"
"""The dialog with questions about a file."""
GRANTED = ".fl-granted"
"""The list of what was taken for granted."""


def choice(page: Any, words: str) -> Any:
    """A choice of the dialog by its words."""
    return page.page.locator(".fl-inquiry .choice", has_text=words)


def test_a_plain_urdf_is_asked_about_and_opened(page: Any, tmp_path: Path) -> None:
    session = page.session
    before = session.state
    file = tmp_path / "sub.urdf"
    file.write_text(PLAIN_URDF)
    page.upload("Open", file)
    dialog = page.page.locator(DIALOG)
    dialog.wait_for()
    page.page.keyboard.press("Escape")
    dialog.wait_for(state="detached")
    assert session.state is before, "Escape leaves all as it is"
    page.upload("Open", file)
    dialog.wait_for()
    assert choice(page, "thruster_left").first.locator("input").is_checked()
    assert not choice(page, "arm").first.locator("input").is_checked()
    choice(page, "tail_fin").nth(1).locator("input").uncheck()
    dialog.get_by_label("force astern [N]").fill("-12,5")
    dialog.get_by_label("force ahead [N]").fill("0x")
    dialog.get_by_role("button", name="Open").click()
    page.until(lambda: any("expected a number, got '0x'" in note for note in page.notes()))
    assert dialog.is_visible(), "the dialog waits for an answer that will do"
    dialog.get_by_label("force ahead [N]").fill("20")
    page.page.keyboard.press("Enter")
    page.until(lambda: session.state.layout.names == ("prop2", "thruster_left"))
    assert session.state.layout.actuators[0].force == (-12.5, 20.0)
    page.until(lambda: "3 of 4 settled" in page.text(GRANTED))
    assert page.problems == []


def test_a_row_leads_to_its_box_and_ticks_off(page: Any, tmp_path: Path) -> None:
    session = page.session
    file = tmp_path / "tam.yaml"
    file.write_text(MATRIX)
    page.upload("Open", file)
    dialog = page.page.locator(DIALOG)
    dialog.wait_for()
    choice(page, "z down").locator("input").check()
    dialog.get_by_role("button", name="Open").click()
    page.until(lambda: session.state.layout.n == 3 and session.desk.task == "Design")
    page.until(lambda: "2 of 4 settled" in page.text(GRANTED))
    text = page.text(GRANTED)
    assert "Position of all" in text and "position_m" not in text and "--" not in text
    page.page.locator(f"{GRANTED} .to", has_text="Position").click()
    page.until(lambda: len(session.selection) == 3)
    page.page.locator(".fl-pointed", has_text="Position").wait_for()
    page.page.locator(f"{GRANTED} li", has_text="power").locator(".tick").click()
    page.until(lambda: "3 of 4 settled" in page.text(GRANTED))
    page.press("Undo")
    page.until(lambda: "2 of 4 settled" in page.text(GRANTED))
    page.page.locator(f"{GRANTED} .to", has_text="Which frame?").click()
    dialog.wait_for()
    assert choice(page, "z down").locator("input").is_checked()
    page.page.keyboard.press("Escape")
    page.page.reload()
    page.ready()
    page.until(lambda: "2 of 4 settled" in page.text(GRANTED))


def test_a_sample_log_shows_its_robot_and_its_moment(page: Any) -> None:
    session = page.session
    page.tab("Log")
    page.page.get_by_role("button", name="PX4 (.ulg)").click()
    page.page.locator(".fl-timeline svg:visible").first.wait_for()
    page.until(
        lambda: session.state.layout.name == "dive" and abs(session.state.target[5] - 18.0) < 0.01
    )
    page.until(lambda: "of the log, dive" in page.page.locator("body").inner_text())
    page.page.get_by_role("button", name="Stop here").or_(
        page.page.get_by_role("button", name="Open the improved robot")
    ).first.wait_for()
    log = page.view.jobs.log
    page.until(lambda: not log.busy)
    page.press("Open the improved robot")
    page.until(lambda: session.state.layout.name == "dive improved")
    page.page.get_by_role("button", name="Show the log's robot").click()
    page.until(lambda: session.state.layout.name == "dive")
    assert page.problems == []
