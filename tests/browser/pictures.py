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
    """A screenshot without the notes; two bits less per colour are hardly seen and make it half as large."""
    page.close_notes()
    page.page.mouse.move(200, 60)  # off the buttons, so that no hint covers anything
    page.page.wait_for_timeout(2500)
    picture = Image.open(io.BytesIO(page.page.screenshot(timeout=0))).convert("RGB")
    ImageOps.posterize(picture, 6).save(path, optimize=True)
    print(path, path.stat().st_size // 1000, "kB", flush=True)


def _scroll(page: Page) -> None:
    """To the end of the panel."""
    page.page.mouse.move(SIZE["width"] - 200, 500)
    page.page.mouse.wheel(0, 5000)
    page.page.wait_for_timeout(500)


def _steer(page: Page) -> None:
    page.tab("Steer by hand")
    page.tab("Sweep an axis")
    page.choose("Axis", "sway")
    page.press("Play the sweep")
    page.until(lambda: page.session.state.target[1] > 3.0, seconds=120)
    page.until(lambda: page.session.state.target[1] < 3.0, seconds=120)
    page.press("Stop the sweep")
    _scroll(page)


def _layout(page: Page) -> None:
    page.tab("Steer by hand")
    page.tab("Sweep an axis")
    page.press("Turn")
    page.key("n")
    page.tab("Layout")


def _hull(page: Page) -> None:
    page.tab("Hull")
    _scroll(page)


def _modes(page: Page) -> None:
    page.tab("Hull")
    page.key("x")
    page.tab("Modes")
    page.type("Temperature T", "0.5")
    page.until(lambda: not page.view.busy)
    page.page.locator("svg.plot:visible .samples circle").nth(30).dispatch_event("click")
    page.until(lambda: page.session.sample == 30)


def _density(page: Page) -> None:
    page.press("1")
    page.tab("What the network proposes")
    _scroll(page)


def _limits(page: Page) -> None:
    page.tab("What the network proposes")
    page.key("Control+z")
    page.tab("Limits")
    page.press("forces")
    page.key("f")
    page.until(lambda: not page.view.analyst.busy)


def _improve(page: Page) -> None:
    page.key("Control+z")
    page.choose("Beside", "hexa")
    page.press("Search")
    page.until(lambda: page.view.improver.found is not None, seconds=300)
    page.until(lambda: not page.view.analyst.busy)
    _scroll(page)


def _compare(page: Page) -> None:
    page.press("Leave")
    page.session.compare_with(None)
    page.tab("Wrench")
    page.tab("Limits")
    page.press("none")
    page.tab("Compare")
    page.press("Compare the methods")
    page.until(lambda: not page.view.comparison.running, seconds=120)
    page.press("sqp")


def _swim(page: Page) -> None:
    page.press("none")
    page.tab("Swim")
    page.choose("Beside", "analytic")
    page.press("Start")
    page.until(lambda: page.view.swimming.time > 1.0, seconds=120)
    page.type("Speed", "3")
    page.until(lambda: page.view.swimming.time > 25.0, seconds=300)
    page.page.get_by_role("button", name="2", exact=True).locator("visible=true").first.click()
    page.until(lambda: page.view.swimming.time > 45.0, seconds=300)
    page.press("Pause")


def _view(page: Page) -> None:
    page.press("End")
    page.tab("View")
    page.row("Fin graph").first.click()


def _dark(page: Page) -> None:
    page.row("Dark").first.click()
    page.tab("Wrench")


def _failure(page: Page) -> None:
    page.tab("View")
    page.row("Dark").first.click()
    page.tab("Wrench")
    page.press("2")
    page.until(lambda: not page.view.busy)


def _tour(page: Page) -> None:
    page.press("2 ✕")
    page.press("Tour")
    page.press("Next")
    page.until(lambda: not page.view.busy)


def _palette(page: Page) -> None:
    page.press("End")
    page.key("Control+k")
    page.page.wait_for_timeout(1500)


SCENES: dict[str, Callable[[Page], object]] = {
    "app": lambda page: page.page.wait_for_timeout(10_000),  # the first labels take their time
    "app-steer": _steer,
    "app-layout": _layout,
    "app-hull": _hull,
    "app-modes": _modes,
    "app-density": _density,
    "app-limits": _limits,
    "app-improve": _improve,
    "app-compare": _compare,
    "app-swim": _swim,
    "app-view": _view,
    "app-dark": _dark,
    "app-files": lambda page: page.tab("Files"),
    "app-failure": _failure,
    "app-tour": _tour,
    "app-palette": _palette,
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
    solver.reply(State(ucat, target=FIRST))  # as `serve` does, so that the first page finds a warm solver
    app = App(server, solver, ucat, Display())
    with sync_playwright() as playwright:
        browser: Any = playwright.chromium.launch(
            executable_path=CHROMIUM, headless=True, chromium_sandbox=False, args=FLAGS
        )
        served = Served(f"http://127.0.0.1:{server.get_port()}/", app, server)
        page = Page(browser.new_page(viewport=SIZE), served, patience=6.0)
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
