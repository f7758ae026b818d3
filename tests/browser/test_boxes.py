"""What is typed into a box counts with Enter."""

from typing import Any


def test_what_is_typed_counts_with_enter(page: Any) -> None:
    session = page.session
    page.type("Fx [N]", "0.55")
    page.until(lambda: session.state.target[0] == 0.55)
    page.key("n")
    page.tab("Design")
    page.type("Position [m]", "0.19", 0)
    page.until(lambda: session.state.layout.fins[0].position[0] == 0.19)
    assert page.problems == []
