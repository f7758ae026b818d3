"""A noisy file of measurements becomes a fin, goes through a link and a file, and is taken back."""

from pathlib import Path
from typing import Any

from tests.fit.cell import columns_of, commands, measured, soft, write


def test_a_noisy_file_becomes_a_fin(page: Any, tmp_path: Path) -> None:
    command, session = commands(120), page.session
    cell = write(tmp_path / "cell.csv", columns_of(command, measured(soft(k=4.0, d=0.1), command)))
    page.tab("Design")
    page.key("n")
    before = session.state
    page.until(lambda: "drag" in page.page.locator(".fl:has-text('stiff blade')").first.inner_text())
    page.upload("Fit from measurements (CSV)", cell)
    page.until(lambda: session.state.layout.fins[0].model.type == "table" and not page.view.busy)
    page.page.get_by_text("May be trusted within what was measured.").wait_for()
    page.page.get_by_text("table, fitted to 120 samples").wait_for()
    assert page.view.shown.layout.fins[0].model.type == "table" and page.view.shown.err_norm < 1e-3
    page.press("On all like it")
    page.until(lambda: [fin.model.type for fin in session.state.layout.fins] == ["table"] * 4)
    page.page.get_by_text("Exact by the model, expected within").first.wait_for()

    page.press("Share")
    page.until(lambda: any("share the ZIP" in note for note in page.notes()))

    page.download("Save", tmp_path / "robot.zip")
    page.press("Undo")
    page.press("Undo")
    page.until(lambda: session.state == before)
    page.upload("Open", tmp_path / "robot.zip")
    page.until(lambda: [fin.model.type for fin in session.state.layout.fins] == ["table"] * 4)


def test_a_wrong_file_is_told_where_and_changes_nothing(page: Any, tmp_path: Path) -> None:
    page.key("n")
    page.tab("Design")
    before = page.session.state
    (tmp_path / "cell.csv").write_text("A,f,phi,Fx,Fy,Fz\n0.3,1.0,0.0,0,oops,0\n")
    page.upload("Fit from measurements (CSV)", tmp_path / "cell.csv")
    sentence = "cell.csv: line 2, column Fy, holds 'oops', which is not a number"
    page.until(lambda: any(sentence in note for note in page.notes()))
    page.page.locator(".fl .missing", has_text=sentence).wait_for()
    with (tmp_path / "huge.csv").open("wb") as file:
        file.truncate(160_000_000)  # sparse: it takes no room
    page.upload("Fit from measurements (CSV)", tmp_path / "huge.csv")
    page.until(lambda: any("huge.csv: has 160,000,000 bytes" in note for note in page.notes()))
    assert page.session.state == before and not page.view.jobs.fitting.busy
