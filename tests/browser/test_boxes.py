"""What is typed into a box is taken whole, with Enter or when the box is left."""

from typing import Any


def test_what_is_typed_is_taken_once_and_whole(page: Any) -> None:
    session = page.session
    page.type("Fx [N]", "0.55")
    page.until(lambda: session.state.target[0] == 0.55)
    page.key("n")
    page.tab("Design")
    page.type("Position [m]", "0.19", 0)
    page.until(lambda: session.state.layout.fins[0].position[0] == 0.19)
    steps = len(session.history.past)
    page.row("Position [m]").nth(2).click()
    page.page.keyboard.press("Control+a")
    page.page.keyboard.type("-0.125", delay=30)
    page.rest(300)
    assert len(session.history.past) == steps, "half a number is nobody's"
    page.page.keyboard.press("Tab")
    page.until(lambda: session.state.layout.fins[0].position[2] == -0.125)
    assert len(session.history.past) == steps + 1 and page.problems == []
