"""Drop a noisy file of measurements on a fin, get an exact allocation, and take it back."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab import load_allocator, load_layout
from finlab.physics import plant_of
from tests.fit.cell import columns_of, commands, measured, soft, write


def test_a_noisy_file_becomes_a_fin(page: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    command = commands(120)
    cell = write(tmp_path / "cell.csv", columns_of(command, measured(soft(k=4.0, d=0.1), command)))
    page.tab("Design")
    assert page.page.get_by_role("button", name="Fit from measurements (CSV)").count() == 0
    page.key("n")
    before = page.session.state
    page.until(lambda: "drag" in page.page.locator(".fl:has-text('stiff blade')").first.inner_text())
    page.upload("Fit from measurements (CSV)", cell)
    page.until(lambda: page.session.state.layout.fins[0].model.type == "table" and not page.view.busy)
    page.page.get_by_text("May be trusted within what was measured.").wait_for()
    page.page.get_by_text("table, fitted to 120 samples").wait_for()
    assert page.page.locator("svg.plot:visible polygon").count() == 3
    assert page.view.shown.layout.fins[0].model.type == "table" and page.view.shown.err_norm < 1e-3
    page.press("On all like it")
    page.until(lambda: [fin.model.type for fin in page.session.state.layout.fins] == ["table"] * 4)
    page.until(lambda: not page.view.busy and page.view.shown.err_norm < 1e-3)
    page.page.get_by_text("Exact", exact=True).first.wait_for()

    fitted = page.session.state.layout
    page.press("Share")
    page.page.locator(".fl-share p", has_text="rounded, to 0.0015 % of their largest force").wait_for()
    link = page.page.locator(".fl-share input").input_value()
    page.page.keyboard.press("Escape")
    page.page.evaluate("hash => { location.hash = hash; }", link.partition("#")[2])
    page.until(lambda: page.session.history.undo_name == "Open ucat")
    command = np.random.default_rng(0).uniform((0.05, 0.1, -3.1), (0.6, 2.1, 3.1), (100, 4, 3))
    wrench, there = (plant_of(one).wrench(command) for one in (fitted, page.session.state.layout))
    assert 0.0 < np.abs(there - wrench).max() < 2e-4 * np.abs(wrench).max(), "within what the card says"
    page.press("Undo")
    page.until(lambda: page.session.state.layout == fitted)

    page.tab("Export")
    with page.page.expect_download() as download:
        page.press("Save")
    download.value.save_as(tmp_path / "robot.zip")
    page.press("Undo")
    page.press("Undo")
    page.until(lambda: page.session.state == before)
    page.upload("Open", tmp_path / "robot.zip")
    page.until(lambda: [fin.model.type for fin in page.session.state.layout.fins] == ["table"] * 4)
    assert load_allocator().allocate(page.session.state.layout, [0.3, 0, 0.2, 0, 0, 0]).err_norm < 1e-6


def test_a_wrong_file_is_told_where_and_changes_nothing(page: Any, tmp_path: Path) -> None:
    page.key("n")
    page.tab("Design")
    before = page.session.state
    (tmp_path / "cell.csv").write_text("A,f,phi,Fx,Fy,Fz\n0.3,1.0,0.0,0,oops,0\n")
    page.upload("Fit from measurements (CSV)", tmp_path / "cell.csv")
    sentence = "cell.csv: line 2, column Fy, holds 'oops', which is not a number"
    page.until(lambda: any(sentence in note for note in page.notes()))
    page.page.locator(".fl .missing", has_text=sentence).wait_for()
    assert page.session.state == before and load_layout("ucat") == before.layout


def test_a_file_of_gigabytes_is_not_even_begun(
    page: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page.key("n")
    page.tab("Design")
    with (tmp_path / "huge.csv").open("wb") as file:
        file.truncate(160_000_000)  # sparse: it takes no room
    page.upload("Fit from measurements (CSV)", tmp_path / "huge.csv")
    page.until(lambda: any("huge.csv: has 160,000,000 bytes" in note for note in page.notes()))
    assert not page.view.fitting.busy and not page.view.client.gui._current_file_upload_states
