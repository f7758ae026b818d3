"""Two tabs are apart; a reload and a dropped connection find the work again."""

from collections.abc import Callable
from typing import Any

from webapp.viser_internals import disconnect_all


def test_two_tabs_are_apart(page: Any, new_page: Callable[..., Any]) -> None:
    other = new_page(page.page.context)  # the same browser profile, so the same storage
    page.page.bring_to_front()
    page.type("Fy [N]", "1")
    page.until(lambda: page.session.state.target[1] == 1.0)
    assert other.session is not page.session
    assert other.session.state.target[1] == 0.0
    other.page.close()


def test_reload_and_reconnect_restore(page: Any, served: Any) -> None:
    page.type("Fy [N]", "0.5")
    page.until(lambda: page.session.state.target[1] == 0.5)
    page.page.reload()
    page.ready()
    assert page.view.session is page.session
    page.until(lambda: page.row("Fy [N]").last.input_value() == "0.5")
    before = page.view
    disconnect_all(served.server)
    page.until(lambda: before not in served.app.views.values())
    page.until(lambda: any(view.session is page.session for view in served.app.views.values()))
    page.ready()
    assert page.page.get_by_role("button", name="Undo").count() == 1, "no widget twice"
