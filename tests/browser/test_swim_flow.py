"""Watch a robot swim, beside another method, with a fin that breaks half-way."""

from typing import Any


def test_swims_loses_a_fin_and_goes_on(page: Any) -> None:
    page.tab("Swim")
    page.choose("Path", "circle")
    page.choose("Method", "analytic")
    page.choose("Beside", "qp")
    page.press("Start")
    page.until(lambda: len(page.view.swimming.swimmers) == 2, seconds=60)
    page.node("/swim/robot1")
    page.visible("/swim/robot1")
    page.visible("/robot", False)
    start = page.pixel("/swim/robot0")
    page.type("Speed", "4")
    page.until(lambda: page.view.swimming.time > 4.0, seconds=60)
    assert page.pixel("/swim/robot0") != start, "it moves on the screen"
    assert page.page.locator(".uplot:visible").count() == 3
    page.page.get_by_role("button", name="2", exact=True).locator("visible=true").first.click()
    page.until(lambda: page.view.swimming.swimmers[0].shown.failed == ("front_left",))
    page.until(lambda: "3 of 4 fins" in page.text(".fl-status"))
    page.until(lambda: not page.view.swimming.swimmers[0].shown.force[1].any())
    page.page.get_by_role("button", name="2 ✕", exact=True).locator("visible=true").first.wait_for()
    before = page.view.swimming.time
    page.until(lambda: page.view.swimming.time > before + 1.0, seconds=60)
    assert "running at" in page.text(".fl-status")
    page.press("Pause")
    page.until(lambda: not page.view.swimming.running)
    held = page.view.swimming.time
    page.press("Step")
    page.until(lambda: held < page.view.swimming.time < held + 0.9)
    page.press("Go on")
    page.until(lambda: page.view.swimming.running)
    page.press("End")
    page.until(lambda: not page.view.swimming.active)
    page.visible("/robot")
    assert page.problems == []
