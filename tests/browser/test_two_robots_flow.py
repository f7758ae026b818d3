"""Two robots beside each other in a browser: chosen, asked for one wrench, swapped, accepted,
shared, closed."""

from typing import Any

from finlab.layout import load_layout
from webapp.session.files import BESIDE, FRAGMENT


def pixels_across(page: Any) -> list[float]:
    """How far right on the page the two stand [px], left one first."""
    return [page.pixel(f"/pair/{place}")[0] for place in ("left", "right")]


def power_texts(page: Any) -> list[str]:
    """Power of both by the status line."""
    return [str(text) for text in page.page.locator(".fl-status .power").all_inner_texts()]


def test_two_robots_are_compared_and_one_is_accepted(page: Any) -> None:
    page.tab("Two robots")
    page.node("/pair/right/fins/0/turn/blade")
    page.visible("/robot", False)
    page.choose("Right", "Shipped: bluerov2_heavy")
    page.node("/pair/right/fins/7/turn/blade")
    page.until(lambda: pixels_across(page)[1] - pixels_across(page)[0] > 150.0)
    page.until(lambda: page.page.locator(".versus .better-sign").count() >= 6)
    assert "all 6 axes" in page.text(".versus-said")
    before = power_texts(page)
    assert len(before) == 2

    page.type("Fx", "3")
    page.until(lambda: len(power_texts(page)) == 2 and power_texts(page) != before)
    shown = page.session.two_robots.pair
    assert [standing.state.target[0] for standing in shown.both] == [3.0, 3.0]

    page.press("Swap")
    page.until(lambda: page.session.two_robots.pair.right.is_this)
    page.press("Accept left")
    page.until(lambda: page.session.state.layout == load_layout("bluerov2_heavy"))
    assert page.session.history.undo_name == "Accept bluerov2_heavy"
    page.key("Control+z")
    page.until(lambda: page.session.state.layout == load_layout("ucat"))

    page.press("Close")
    page.visible("/robot")
    page.visible("/pair/left", False)
    assert page.problems == []


def test_a_link_opens_both(page: Any) -> None:
    page.tab("Two robots")
    page.choose("Right", "Shipped: octo")
    page.press("Link")
    link = page.page.locator(".fl-ask input").input_value()
    page.page.locator(".fl-ask button", has_text="Close").click()
    assert FRAGMENT in link and BESIDE in link
    page.start_over()
    fragment = link.partition("#")[2]
    page.page.evaluate("text => { location.hash = text; }", fragment)
    page.until(lambda: page.session.two_robots.pair is not None)
    titles = [standing.title for standing in page.session.two_robots.pair.both]
    assert titles == ["This robot", "Link: octo"]
    page.visible("/pair/left")
    page.visible("/robot", False)
    assert page.problems == []
