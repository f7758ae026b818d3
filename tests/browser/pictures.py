"""Takes the pictures of docs/: `python -m tests.browser.pictures docs`, with the shipped checkpoint.

Names behind the folder choose some; `walk` takes one of each step of a designer's walk instead.

Not a test: run it after the app's looks have changed, and look at every picture.
"""

import io
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from PIL import Image, ImageOps

from tests.browser.conftest import CHROMIUM, FLAGS, Served
from tests.browser.designer_walk import walk
from tests.browser.page import Page
from tests.fit.cell import columns_of, commands, measured, soft, write

WALK = "walk"
"""What asks for the pictures of the walk."""
SIZE = {"width": 1400, "height": 860}


def save(page: Page, path: Path) -> None:
    """A screenshot without the notes; one bit less per colour is not seen and makes it a third smaller."""
    page.close_notes()
    page.page.mouse.move(700, 320)  # over the view, so that no hint covers anything
    page.page.wait_for_timeout(1500)
    page.until(lambda: page.page.locator("[role=tooltip]:visible").count() == 0)
    picture = Image.open(io.BytesIO(page.page.screenshot(timeout=0))).convert("RGB")
    ImageOps.posterize(picture, 7).save(path, optimize=True)
    print(path, path.stat().st_size // 1000, "kB", flush=True)


def _scroll(page: Page, drawer: bool = False) -> None:
    """To the end of what stands at the right, or lies in the drawer."""
    page.page.mouse.move(*((300, SIZE["height"] - 100) if drawer else (SIZE["width"] - 200, 500)))
    page.page.mouse.wheel(0, 5000)
    page.page.wait_for_timeout(500)


def _drag_drawer(page: Page, height: float) -> None:
    """Make the drawer as tall [px] by its handle."""
    handle = page.page.locator(".fl-handle").bounding_box()
    x, y = SIZE["width"] / 3, handle["y"] + handle["height"] / 2
    page.drag((x, y), (x, SIZE["height"] - height))


def _first(page: Page) -> None:
    page.tab("Display")
    page.row("Shadows").first.click()
    page.tab("Display")
    page.page.wait_for_timeout(6000)  # shadows take their time without a graphics card


def _failure(page: Page) -> None:
    page.press("2")
    page.until(lambda: page.session.state.failed != () and not page.view.busy)


def _tour(page: Page) -> None:
    page.press("Tour")
    page.press("Next")
    page.until(lambda: page.session.stop == 1 and not page.view.busy)


def _damage(page: Page) -> None:
    page.tab("Damage a fin")
    page.choose("Which fin", "front_right")
    page.type("Strength [%]", "60")
    page.row("Stuck").first.click()
    page.until(lambda: page.session.state.stuck != ())
    page.type("Stuck at [°]", "60")
    page.until(lambda: page.session.state.stuck[0][1] > 1.0 and not page.view.busy)
    page.page.mouse.move(SIZE["width"] - 200, 500)
    page.page.mouse.wheel(0, 120)
    page.page.wait_for_timeout(500)


def _palette(page: Page) -> None:
    page.key("Control+k")
    page.page.wait_for_timeout(1000)


def _steer(page: Page) -> None:
    page.unfold("Steer by hand", "Stick for")
    page.tab("Sweep")
    page.choose("Sweep", "heave")
    page.press("Play the sweep")
    page.until(lambda: page.session.state.target[2] > 8.0)
    page.press("Stop the sweep")
    page.press("Turn")
    page.row("Spring back").first.click()
    _scroll(page)
    box = page.page.locator("svg.pad:visible").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.drag((x, y), (x - 30, y - 45))
    page.until(lambda: not page.view.busy)


def _layout(page: Page) -> None:
    page.key("n")
    page.tab("Design")


def _fit(page: Page) -> None:
    law = soft(k=4.0, p=1.4, x0=0.9, q=4.0, e=0.15, phi_e=1.0, d=0.12)
    command = commands(300, seed=5)
    force = measured(law, command)
    force[(17, 100), 1:] += 3.0
    _layout(page)
    with TemporaryDirectory() as folder:
        cell = write(Path(folder) / "cell.csv", columns_of(command, force))
        page.upload("Fit from measurements (CSV)", cell)
        page.until(lambda: page.view.fitting.findings is not None and not page.view.busy)
    page.press("On all like it")
    page.until(lambda: not page.view.busy)
    page.page.mouse.move(SIZE["width"] - 200, 500)
    page.page.mouse.wheel(0, 130)


def _hull(page: Page) -> None:
    page.tab("Design")  # with no fin selected: then the inspector is about the robot
    page.unfold("Hull", "Unit of file")
    _scroll(page)


def _modes(page: Page) -> None:
    page.tab("Candidates")
    page.until(lambda: not page.view.busy and not page.view.answering.searching)
    page.page.locator("table.modes tr.pick").nth(1).click()
    page.until(lambda: page.session.mode == 1)


def _proposals(page: Page) -> None:
    page.tab("Candidates")
    page.choose("Method", "mdn")
    page.until(lambda: page.session.state.method == "mdn" and not page.view.busy)
    page.tab("What the network proposes")
    page.tab("Display")
    page.row("Mixture").first.click()
    page.tab("Display")
    page.until(lambda: page.session.display.mixture and not page.view.answering.searching)
    _drag_drawer(page, 420.0)
    _scroll(page, drawer=True)


def _limits(page: Page) -> None:
    page.tab("Reach")
    page.press("forces")
    page.key("x")
    page.until(lambda: page.session.state.failed != () and not page.view.analyst.busy)


def _improve(page: Page) -> None:
    page.tab("Improve")
    page.press("Search")
    page.until(lambda: page.view.improver.progress is not None and page.view.improver.progress.round > 5)
    page.press("Cancel")
    page.until(lambda: page.view.improver.findings is not None)
    page.page.wait_for_timeout(500)


def _compare(page: Page) -> None:
    page.tab("Comparison")
    page.press("Compare the methods")
    page.until(lambda: page.view.comparison.state is not None and not page.view.comparison.running)
    page.press("sqp")


def _swim(page: Page) -> None:
    page.tab("Simulate")
    page.choose("Scenario", "lost-in-current")
    page.type("Speed", "8")
    page.tab("More")
    for controller in ("waypoint", "tracking"):
        page.choose("Controller", controller)
        page.until(lambda controller=controller: page.session.swim.controller == controller)
        page.press("Start")
        page.until(lambda: 0.0 < page.view.swimming.time < 20.0)
        page.until(lambda: page.view.swimming.time > 66.0)
        if controller == "waypoint":
            page.press("Keep this swim")
            page.until(lambda: page.view.swimming.kept is not None)
    page.press("Pause")
    page.tab("More")
    page.type("At [s]", "56")
    page.until(lambda: page.view.swimming.at is not None)
    page.page.wait_for_timeout(25000)  # plots come late where there is no graphics card


def _view(page: Page) -> None:
    page.unfold("Display", "Fin graph")
    page.row("Fin graph").first.click()


def _dark(page: Page) -> None:
    page.unfold("Display", "Dark")
    page.row("Dark").first.click()
    page.tab("Display")


SCENES: dict[str, Callable[[Page], object]] = {
    "app": _first,
    "app-failure": _failure,
    "app-tour": _tour,
    "app-layout": _layout,
    "app-hull": _hull,
    "app-fit": _fit,
    "app-modes": _modes,
    "app-proposals": _proposals,
    "app-limits": _limits,
    "app-improve": _improve,
    "app-compare": _compare,
    "app-swim": _swim,
    "app-files": lambda page: page.tab("Export"),
    "app-view": _view,
    "app-dark": _dark,
    "app-damage": _damage,
    "app-steer": _steer,
    "app-palette": _palette,
}
"""Picture and what to do before it, from first sight; those that open folders come after the others."""


def main(folder: Path, wanted: list[str], dark: bool = False) -> None:
    """Take the pictures, all or those named, in the light or the dark theme."""
    from playwright.sync_api import sync_playwright

    from finlab.assets import shipped_layouts
    from finlab.layout import load_layout
    from webapp.app import App
    from webapp.session import Display
    from webapp.session.state import State
    from webapp.session.targets import FIRST
    from webapp.tasks.solver import Solver
    from webapp.viser_internals import start_server, stop_server

    server = start_server()
    ucat, solver = load_layout(shipped_layouts()["ucat"]), Solver()
    solver.reply(State(ucat, target=FIRST))  # as `serve` does, so that the first page finds a warm solver
    app = App(server, solver, ucat, Display(shadows=False, dark=dark))
    with sync_playwright() as playwright:
        browser: Any = playwright.chromium.launch(
            executable_path=CHROMIUM, headless=True, chromium_sandbox=False, args=FLAGS
        )
        served = Served(f"http://127.0.0.1:{server.get_port()}/", app, server)
        page = Page(browser.new_page(viewport=SIZE), served, patience=6.0)
        for name, prepare in SCENES.items():
            if not wanted or name in wanted:
                page.start_over()
                page.page.evaluate("document.documentElement.style.removeProperty('--fl-drawer')")
                prepare(page)
                save(page, folder / f"{name}.png")
        if WALK in wanted:
            page.start_over()
            with TemporaryDirectory() as files:
                for number, step in enumerate(walk(page, Path(files)), 1):
                    save(page, folder / f"{WALK}-{number}-{step}.png")
        browser.close()
    app.stop()
    stop_server(server)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
