"""The page with the methods and the checkpoint that are shipped, as a user gets it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from finlab.assets import shipped_checkpoints, shipped_layouts
from finlab.cli import main
from finlab.layout import load_layout
from tests.browser.conftest import Served
from tests.browser.page import Page
from webapp.app import App
from webapp.session import Display
from webapp.tasks.solver import Solver
from webapp.viser_internals import start_server, stop_server

pytestmark = pytest.mark.skipif(
    "default" not in shipped_checkpoints(), reason="no trained checkpoint in checkpoints/default"
)


@pytest.fixture(scope="module")
def trained(browser: Any) -> Iterator[Page]:
    """A page of a server with the real solver."""
    server = start_server()
    ucat = load_layout(shipped_layouts()["ucat"])
    app = App(server, Solver(), ucat, Display(shadows=False, speed=0.2))
    context = browser.new_context(viewport={"width": 900, "height": 600})
    served = Served(f"http://127.0.0.1:{server.get_port()}/?fixedDpr=0.5", app, server)
    yield Page(context.new_page(), served)
    context.close()
    app.stop()
    stop_server(server)


def test_search_answers_a_slider_and_a_failure(trained: Page) -> None:
    page = trained
    assert page.view.answering.best.method == "search" and page.view.answering.best.checkpoint is None
    page.until(lambda: "Exact" in page.text(".fl-status") and "least power" in page.text(".fl-status"))
    page.type("Fy [N]", "0.5")
    page.until(lambda: page.session.state.target[1] == 0.5 and not page.view.busy)
    page.until(lambda: "+0.50" in page.text(".bars"))
    assert page.view.answering.best.err_norm < 0.01
    page.press("2")
    page.until(lambda: page.session.state.failed == ("front_left",) and not page.view.busy)
    assert page.view.answering.best.method == "search"
    page.press("2 ✕")
    page.until(lambda: page.session.state.failed == () and not page.view.busy)


def test_power_or_effort_is_kept_least(trained: Page) -> None:
    page = trained
    page.tab("Candidates")
    watts = page.view.answering.best.power
    page.choose("Keep least", "effort")
    page.until(lambda: page.session.state.objective == "effort" and not page.view.busy)
    page.until(lambda: "least effort" in page.text(".fl-status"))
    assert page.view.answering.best.power > watts
    page.until(lambda: "effort" in str(page.page.locator("svg.plot:visible").text_content()))
    page.choose("Keep least", "power")
    page.until(lambda: page.session.state.objective == "power" and not page.view.busy)
    assert page.view.answering.best.power == watts


def test_modes_tell_their_components_and_proposals_are_drawn(trained: Page) -> None:
    page = trained
    assert page.page.locator("svg.plot:visible .samples").count() == 0, "search draws nothing"
    page.choose("Method", "mdn")
    page.until(lambda: page.session.state.method == "mdn" and not page.view.busy)
    page.until(lambda: "from component" in page.text("table.modes"))
    page.until(
        lambda: page.page.locator("table.modes tr.pick").count() == len(page.view.answering.modes.shown) > 0
    )
    names = [mode.name for mode in page.view.answering.modes.shown]
    assert len(set(names)) == len(names)
    assert page.view.answering.reply.proposal is not None
    page.press("Play the refinement")
    page.until(lambda: page.page.locator("table.way tr.pick").count() > 2)
    page.until(lambda: page.view.answering.refinement.at is None)
    page.tab("What the network proposes")
    page.until(lambda: page.page.locator(".discs svg").count() == 4)
    page.choose("Method", "search")
    page.until(lambda: page.session.state.method == "search" and not page.view.busy)
    assert page.problems == []


def test_the_page_gives_the_bundle_that_the_command_writes(trained: Page, tmp_path: Path) -> None:
    page = trained
    page.tab("Export")
    with page.page.expect_download() as download:
        page.press("Export the bundle (ZIP)")
    download.value.save_as(tmp_path / "page.zip")
    assert main(["export", "ucat", "-o", str(tmp_path / "ucat"), "--zip"]) == 0
    assert (tmp_path / "page.zip").read_bytes() == (tmp_path / "ucat.zip").read_bytes()
    assert "finlab export ucat" in page.page.locator("pre.command").last.inner_text()
