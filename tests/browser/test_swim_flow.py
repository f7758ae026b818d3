"""Watch a robot swim, beside another method, with a fin that breaks half-way, with or without a word."""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image


def test_swims_loses_a_fin_and_goes_on(page: Any) -> None:
    page.tab("Simulate")
    for label, entry in (("Path", "circle"), ("Swim with", "analytic"), ("Beside", "qp")):
        page.choose(label, entry)
        page.until(lambda entry=entry: entry in vars(page.session.swim).values())
    page.press("Start")
    page.until(lambda: len(page.view.swimming.swimmers) == 2)
    page.node("/swim/robot1")
    page.visible("/swim/robot1")
    page.visible("/robot", False)
    start = page.pixel("/swim/robot0")
    page.type("Speed", "4")
    page.until(lambda: page.view.swimming.time > 4.0)
    page.type("Speed", "0.5")  # slowly, so that a busy page sees the rest before it has arrived
    page.until(lambda: page.pixel("/swim/robot0") != start)  # it moves on the screen
    page.until(lambda: page.page.locator(".uplot:visible").count() == 6)
    page.page.get_by_role("button", name="2", exact=True).locator("visible=true").first.click()
    page.until(lambda: page.view.swimming.swimmers[0].shown.failed == ("front_left",))
    page.until(lambda: "3 of 4 fins" in page.text(".fl-status"))
    shown = lambda: page.view.swimming.swimmers[0].shown  # noqa: E731
    page.until(lambda: shown().motion[1, 0] == 0.0)
    page.until(lambda: np.linalg.norm(shown().force[1]) < 0.4)  # what is left is its drag
    page.page.get_by_role("button", name="2 ✕", exact=True).locator("visible=true").first.wait_for()
    before = page.view.swimming.time
    page.until(lambda: page.view.swimming.time > before + 1.0)
    page.until(lambda: "running at" in page.text(".fl-status"))
    page.press("Pause")
    page.until(lambda: not page.view.swimming.running and not page.view.swimming.busy)
    held = page.view.swimming.time
    page.press("Step")
    page.until(lambda: page.view.swimming.time > held)
    assert page.view.swimming.time == pytest.approx(held + 0.1)
    page.press("Go on")
    page.until(lambda: page.view.swimming.running)
    page.press("End")
    page.until(lambda: not page.view.swimming.active)
    page.visible("/robot")
    assert page.problems == []


def test_a_fin_breaks_without_a_word_and_the_robot_finds_out(page: Any) -> None:
    page.tab("Simulate")
    for label, entry in (("Path", "circle"), ("Swim with", "analytic")):
        page.choose(label, entry)
        page.until(lambda entry=entry: entry in vars(page.session.swim).values())
    page.row("Announced").first.click()
    page.until(lambda: not page.session.swim.announced)
    page.type("Speed", "4")
    page.press("Start")
    page.until(lambda: len(page.view.swimming.swimmers) == 1)
    page.until(lambda: page.view.swimming.time > 14.0)
    page.type("Speed", "0.5")  # slowly, so that it can be seen that nobody knows yet
    page.page.get_by_role("button", name="2", exact=True).locator("visible=true").first.click()
    shown = lambda: page.view.swimming.swimmers[0].shown  # noqa: E731
    page.until(lambda: shown().lost == ("front_left",))
    page.until(lambda: "3 of 4 fins" in page.text(".fl-status"))
    page.until(lambda: shown().failed == ("front_left",))
    page.until(lambda: "The monitor found front_left lost" in page.page.inner_text("body"))
    ((name, seconds),) = shown().found
    assert name == "front_left" and 0.0 < seconds < 8.0
    doubts = shown().record[:, -4:]
    assert doubts[-1, 1] > 0.99 and doubts[-1, [0, 2, 3]].max() < 0.5
    before = page.view.swimming.time
    page.type("Speed", "4")
    page.until(lambda: page.view.swimming.time > before + 8.0)
    record = shown().record
    assert record[record[:, 0] > before + 5.0, 1].max() < 0.3, "it is back on its path"
    page.press("End")
    page.until(lambda: not page.view.swimming.active)
    assert page.problems == []


def test_a_robot_loses_a_fin_in_a_current_and_carries_on(page: Any, tmp_path: Path) -> None:
    page.tab("Simulate")
    page.choose("Scenario", "lost-in-current")
    page.until(lambda: page.session.swim.current_cm_s == 7.1 and not page.session.swim.announced)
    page.until(lambda: "current 7.1 cm/s towards −45°; 1 fin lost half-way" in page.page.inner_text("body"))
    page.choose("Swim with", "analytic")
    page.until(lambda: page.session.swim.method == "analytic")
    page.type("Speed", "8")
    page.press("Start")
    swimming = page.view.swimming
    page.until(lambda: len(swimming.swimmers) == 1)
    page.until(lambda: page.page.locator(".uplot:visible").count() == 6)
    page.until(lambda: swimming.swimmers[0].shown.lost == ("front_right",))
    page.until(lambda: swimming.swimmers[0].shown.failed == ("front_right",))
    page.until(lambda: "The monitor found front_right lost" in page.page.inner_text("body"))
    broken = 45.0
    page.until(lambda: swimming.time > broken + 20.0)
    page.press("Pause")
    page.until(lambda: not swimming.running and not swimming.busy)
    shown = swimming.swimmers[0].shown
    assert shown.found[0][1] < 5.0
    late = shown.record[shown.record[:, 0] > broken + 5.0]
    assert late[:, 1].max() < 0.3, "it carries on along its path"

    page.press("Keep this swim")
    page.until(lambda: swimming.kept is not None)
    page.visible("/swim/robot2")
    held = swimming.time
    page.type("At [s]", "30")
    page.until(lambda: swimming.at == 30.0)
    page.until(lambda: "looking back" in page.text(".fl-status") and "4 of 4 fins" in page.text(".fl-status"))
    record = swimming.swimmers[0].recorded().log
    there = record.position[np.searchsorted(record.time, 30.0)]
    place = page.page.evaluate(
        "() => { const p = window.__viserMutable.nodeRefFromName['/swim/robot0'].position;"
        " return [p.x, p.y, p.z]; }"
    )
    assert place == pytest.approx(there.tolist(), abs=0.01)
    with page.page.expect_download() as download:
        page.press("Table (CSV)")
    download.value.save_as(tmp_path / "swim.zip")
    with zipfile.ZipFile(tmp_path / "swim.zip") as archive:
        header, *rows = archive.read(archive.namelist()[0]).decode().splitlines()
    assert header.startswith("t [s],x [m]") and len(rows) == round(held / 0.1)

    with page.page.expect_download() as download:
        page.press("Film (GIF)")
        page.until(lambda: page.view.swim_files.share > 0.0)
    download.value.save_as(tmp_path / "swim.gif")
    assert Image.open(tmp_path / "swim.gif").n_frames == 150

    page.press("Go on")
    page.until(lambda: swimming.at is None and swimming.time > held)
    page.type("Current [cm/s]", "0")
    page.until(lambda: np.linalg.norm(swimming.swimmers[0].shown.flow) < 0.06)  # while it swims
    page.press("End")
    page.until(lambda: not swimming.active)
    page.press("Forget it")
    page.until(lambda: swimming.kept is None)
    assert page.problems == []
