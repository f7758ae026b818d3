"""Watch a robot swim, with a fin that breaks, announced or not."""

from pathlib import Path
from typing import Any

import pytest

from finlab.sim import load_log

BOTTOMS = "all => all.map(one => one.getBoundingClientRect().bottom)"


def test_a_robot_swims_and_one_fin_breaks(page: Any) -> None:
    page.tab("Simulate")
    swimming = page.view.jobs.swimming
    assert "Once a swim is started" in page.text(".fl-unswum")
    page.choose("Path", "circle")
    page.until(lambda: page.session.swim.path == "circle")
    page.choose("Method", "analytic")
    page.until(lambda: "Method analytic, as in the bar" in page.page.inner_text("body"))
    page.press("Start")
    page.until(lambda: swimming.swimmer is not None)
    page.visible("/swim/floor")
    page.visible("/floor", False)
    start = page.pixel("/robot")
    page.until(lambda: page.pixel("/robot") != start)  # it moves on the screen
    page.until(lambda: page.page.locator(".fl-timeline .plot").count() == 6)
    ends = page.page.locator(".fl-timeline .plot").evaluate_all(BOTTOMS)
    assert max(ends) <= page.page.viewport_size["height"], f"the last plots end at {ends}"
    page.page.get_by_role("button", name="2", exact=True).locator("visible=true").first.click()
    page.until(lambda: swimming.swimmer.shown.failed == ("front_left",))
    page.until(lambda: "3 of 4 fins" in page.text(".fl-status"))
    page.page.get_by_role("button", name="2 ✕", exact=True).locator("visible=true").first.wait_for()
    page.press("Pause")
    page.until(lambda: not swimming.running and not swimming.busy)
    held = swimming.time
    page.press("Step")
    page.until(lambda: swimming.time > held)
    assert swimming.time == pytest.approx(held + 0.1)
    page.press("End")
    page.until(lambda: not swimming.active)
    page.visible("/floor")
    assert page.problems == []


def test_a_fin_lost_in_a_current_is_found(page: Any, tmp_path: Path) -> None:
    page.tab("Simulate")
    swimming = page.view.jobs.swimming
    page.choose("Scenario", "lost-in-current")
    page.until(lambda: not page.session.swim.announced)
    page.until(lambda: "In a current of 0.07 m/s a fin is lost half-way" in page.page.inner_text("body"))
    page.choose("Method", "analytic")
    page.until(lambda: page.session.state.method == "analytic")
    page.type("Speed", "8")
    page.press("Start")
    page.until(lambda: swimming.swimmer is not None)
    page.until(lambda: swimming.swimmer.shown.lost == ("front_right",))
    page.until(lambda: swimming.swimmer.shown.failed == ("front_right",))
    page.until(lambda: "The monitor found front_right lost" in page.page.inner_text("body"))
    page.press("Pause")
    page.until(lambda: not swimming.running and not swimming.busy)
    assert swimming.swimmer.shown.found[0][1] < 5.0

    held = swimming.time
    assert load_log(page.download("Log (NPZ)", tmp_path / "swim.npz")).n_ticks == round(held / 0.1)
    page.press("Go on")
    page.until(lambda: swimming.time > held)
    page.press("End")
    page.until(lambda: not swimming.active)
    assert page.problems == []
