"""Takes the pictures of docs/: `python -m tests.browser.pictures docs`, with the shipped checkpoint.

Not a test: run it after the app's looks have changed, and look at every picture.
"""

import io
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from PIL import Image, ImageOps

from tests.browser.conftest import CHROMIUM, FLAGS, Served
from tests.browser.page import Page

SIZE = {"width": 1400, "height": 860}


def save(page: Page, path: Path) -> None:
    """A screenshot without the notes; one bit less per colour is not seen and makes it a third smaller."""
    page.close_notes()
    page.page.mouse.move(200, 60)  # off the buttons, so that no hint covers anything
    page.page.wait_for_timeout(2500)
    picture = Image.open(io.BytesIO(page.page.screenshot())).convert("RGB")
    ImageOps.posterize(picture, 7).save(path, optimize=True)
    print(path, path.stat().st_size // 1000, "kB", flush=True)


def _layout(page: Page) -> None:
    page.key("n")
    page.tab("Layout")


def _modes(page: Page) -> None:
    page.key("x")
    page.tab("Modes")
    page.type("Temperature T", "0.5")
    page.tab("What the network proposes")
    page.until(lambda: not page.view.busy)


def _limits(page: Page) -> None:
    page.key("Control+z")
    page.tab("Limits")
    page.press("forces")
    page.key("f")
    page.until(lambda: not page.view.analyst.busy)


def _compare(page: Page) -> None:
    page.key("Control+z")
    page.press("none")
    page.tab("Compare")
    page.press("Compare the methods")
    page.until(lambda: not page.view.comparison.running)
    page.press("sqp")


def _view(page: Page) -> None:
    page.press("none")
    page.tab("View")


def _failure(page: Page) -> None:
    page.tab("Wrench")
    page.press("2")
    page.until(lambda: not page.view.busy)


def _tour(page: Page) -> None:
    page.press("2 ✕")
    page.press("Tour")
    page.press("Next")
    page.until(lambda: not page.view.busy)


SCENES: dict[str, Callable[[Page], object]] = {
    "app": lambda page: page.page.wait_for_timeout(10_000),  # the first labels take their time
    "app-layout": _layout,
    "app-modes": _modes,
    "app-limits": _limits,
    "app-compare": _compare,
    "app-view": _view,
    "app-files": lambda page: page.tab("Files"),
    "app-failure": _failure,
    "app-tour": _tour,
}
"""Picture and what to do before it; each goes on from the one before."""


def main(folder: Path, wanted: list[str]) -> None:
    """Take the pictures, all or those named."""
    from playwright.sync_api import sync_playwright

    from finlab.assets import shipped_layouts
    from finlab.layout import load_layout
    from webapp.app import App
    from webapp.session import Display
    from webapp.solver import Solver
    from webapp.state import State
    from webapp.targets import FIRST
    from webapp.viser_internals import start_server, stop_server

    server = start_server("127.0.0.1", 0)
    ucat, solver = load_layout(shipped_layouts()["ucat"]), Solver()
    solver.solve(State(ucat, target=FIRST))  # as `serve` does, so that the first page finds a warm solver
    app = App(server, solver, ucat, Display())
    with sync_playwright() as playwright:
        browser: Any = playwright.chromium.launch(
            executable_path=CHROMIUM, headless=True, chromium_sandbox=False, args=FLAGS
        )
        page = Page(
            browser.new_page(viewport=SIZE), Served(f"http://127.0.0.1:{server.get_port()}/", app, server)
        )
        for name, prepare in SCENES.items():
            prepare(page)
            if not wanted or name in wanted:
                save(page, folder / f"{name}.png")
            if name == next(reversed(wanted), None):
                break
        browser.close()
    app.stop()
    stop_server(server)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
