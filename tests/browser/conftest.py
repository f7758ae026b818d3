"""A real browser for the flows. Without Chromium they are skipped, loudly; on CI that is a
failure."""

import os
import shutil
import tempfile
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = next(
    (p for p in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if p), None
)
"""Path of the browser; None where there is none."""
CHROMIUM_MISSING = (
    "NO CHROMIUM: the browser tests were skipped, so nothing checked the app's pages. Install one "
    "with `apt-get install chromium` and run them again."
)
"""Why the tests are skipped."""
CHROMIUM_FLAGS = [
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-gpu-compositing",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
]
"""Options of Chromium for WebGL by software, without a graphics card."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip the flows where there is no browser, or let them fail where there must be one."""
    if CHROMIUM is not None:
        return
    here = [item for item in items if Path(__file__).parent in item.path.parents]
    if os.environ.get("CI", "").lower() in ("1", "true"):
        return  # the fixture fails
    if here:
        warnings.warn(CHROMIUM_MISSING, stacklevel=1)
    for item in here:
        item.add_marker(pytest.mark.skip(reason=CHROMIUM_MISSING))


@dataclass
class Served:
    """A running app."""

    url: str
    """Where it answers."""
    app: Any
    """The `App`, to look at its sessions."""
    server: Any
    """The `ViserServer`."""


@pytest.fixture(scope="session")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """The app with the methods that are shipped; sessions are kept in a folder.

    No shadows and still fins, so that software rendering keeps up.
    """
    from finlab.files.worker import prepare
    from finlab.layout import load_layout
    from webapp.app import App
    from webapp.session import Display
    from webapp.start_page import start_page
    from webapp.tasks.solver import Solver
    from webapp.viser_internals import start_server, stop_server

    prepare(["webapp.session.files", "webapp.tasks.fitting"])
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        server = start_server(start_page=start_page())
        app = App(server, Solver(), load_layout("ucat"), Display(shadows=False, frozen=True))
        yield Served(f"http://127.0.0.1:{server.get_port()}/?fixedDpr=0.1", app, server)
        app.stop()
        stop_server(server)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """One Chromium for all flows."""
    if CHROMIUM is None:
        pytest.fail(CHROMIUM_MISSING)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as home:
        chromium = playwright.chromium.launch(
            executable_path=CHROMIUM,
            headless=True,
            chromium_sandbox=False,
            args=CHROMIUM_FLAGS,
            downloads_path=home,
        )
        yield chromium
        chromium.close()


@pytest.fixture(scope="session")
def new_page(browser: Any, served: Served) -> Iterator[Callable[[], Any]]:
    """Opens pages of the app, each in a browser profile of its own."""
    from tests.browser.page import Page

    contexts = []

    def open_page(context: Any = None) -> Page:
        if context is None:
            context = browser.new_context(
                viewport={"width": 1400, "height": 860}, accept_downloads=True
            )
            contexts.append(context)
        return Page(context.new_page(), served)

    yield open_page
    for context in contexts:
        context.close()


@pytest.fixture(scope="session")
def opened(new_page: Callable[[], Any]) -> Any:
    """One page for most flows: opening it takes longer than a flow."""
    return new_page()


@pytest.fixture
def page(opened: Any) -> Any:
    """The page, as at first sight."""
    opened.start_over()
    return opened


@pytest.fixture
def resized(page: Any) -> Iterator[Any]:
    """The page; its window has its first size again afterwards."""
    before = page.page.viewport_size
    yield page
    page.page.set_viewport_size(before)
