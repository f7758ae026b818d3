"""Two tabs are apart; a reload and a dropped connection find the work again; the token."""

from collections.abc import Callable
from typing import Any

from finlab.layout import load_layout
from tests.browser.conftest import Served
from tests.browser.page import Page
from webapp.app import App
from webapp.guard import Guard
from webapp.session import Display
from webapp.tasks.solver import Solver
from webapp.viser_internals import start_server, stop_server


def test_reload_and_reconnect_restore_and_tabs_are_apart(
    page: Any, new_page: Callable[..., Any], served: Any
) -> None:
    page.type("Fy [N]", "0.5")
    page.until(lambda: page.session.state.target[1] == 0.5)
    page.tab("Improve")
    page.choose("Goal", "worst single failure")
    page.until(lambda: page.session.draft.goal == "worst single failure")
    page.tab("Simulate")
    page.choose("Path", "square")
    page.until(lambda: page.session.swim.path == "square")
    page.page.reload()
    page.ready()
    assert page.view.session is page.session
    page.shows("Path", "square")
    page.tab("Improve")
    page.shows("Goal", "worst single failure")
    page.tab("Allocate")
    page.shows("Fy [N]", "0.5")
    before = page.view
    served.server._websock_server.disconnect_all_clients()
    page.until(lambda: before not in served.app.views.values())
    back = served.app.views
    page.until(lambda: any(view.session is page.session for view in back.values()))
    page.ready()
    assert page.page.get_by_role("button", name="Undo").count() == 1, "no widget twice"
    other = new_page(page.page.context)  # the same browser profile, so the same storage
    assert other.session is not page.session and other.session.state.target[1] == 0.0
    other.page.close()
    page.page.bring_to_front()


def test_a_token_opens(browser: Any) -> None:
    guard, layout = Guard("127.0.0.1", "a-secret-token"), load_layout("ucat")

    server = start_server(guard, 0)
    app = App(server, Solver(), layout, Display(shadows=False, frozen=True))
    first = Served(f"http://127.0.0.1:{server.get_port()}/?token={guard.token}", app, server)
    port = first.server.get_port()
    context = browser.new_context(viewport={"width": 900, "height": 600})
    stranger = context.new_page()
    stranger.goto(f"http://127.0.0.1:{port}/")
    assert "token" in stranger.inner_text("body") and stranger.locator("canvas").count() == 0
    stranger.close()
    page = Page(context.new_page(), first)
    assert "token" not in page.page.url
    context.close()
    first.app.stop()
    stop_server(first.server)
