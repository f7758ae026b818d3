"""Watch a robot swim, beside another method, with a fin that breaks half-way."""

from typing import Any

import pytest


def test_swims_loses_a_fin_and_goes_on(page: Any) -> None:
    page.tab("Swim")
    for label, entry in (("Path", "circle"), ("Method", "analytic"), ("Beside", "qp")):
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
    page.until(lambda: page.page.locator(".uplot:visible").count() == 3)
    page.page.get_by_role("button", name="2", exact=True).locator("visible=true").first.click()
    page.until(lambda: page.view.swimming.swimmers[0].shown.failed == ("front_left",))
    page.until(lambda: "3 of 4 fins" in page.text(".fl-status"))
    page.until(lambda: not page.view.swimming.swimmers[0].shown.force[1].any())
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
