"""Two tabs are apart; a reload and a dropped connection find the work again."""

from collections.abc import Callable
from typing import Any

from webapp.viser_internals import disconnect_all


def test_two_tabs_are_apart(new_page: Callable[..., Any]) -> None:
    first = new_page()
    second = new_page(first.page.context)  # the same browser profile, so the same storage
    first.type("Fy [N]", "1")
    first.until(lambda: first.session.state.target[1] == 1.0)
    assert second.session is not first.session
    assert second.session.state.target[1] == 0.0


def test_reload_and_reconnect_restore(page: Any, served: Any) -> None:
    page.type("Fy [N]", "0.5")
    page.until(lambda: page.session.state.target[1] == 0.5)
    session = page.session
    page.page.reload()
    page.ready()
    page.until(lambda: any(view.session is session for view in served.app.views.values()))
    page.until(lambda: page.row("Fy [N]").last.input_value() == "0.5")
    disconnect_all(served.server)
    page.until(lambda: not served.app.views)
    page.until(lambda: any(view.session is session for view in served.app.views.values()), seconds=20)
    page.ready()
    assert page.page.get_by_role("button", name="Undo").count() == 1, "no widget twice"
