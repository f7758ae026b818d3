"""Eight browsers at once: `python -m tests.browser.soak [seconds]`, with the shipped checkpoint.

Not a test: it measures the machine as much as the app. It fails where pages get in each other's way, and
prints how long they wait and whether the server grows. Without a graphics card eight 3D views are too much
for any machine, so a page draws only so often, as one in the background would; all else of it is real.
"""

import sys
import time
from typing import Any

import numpy as np

from tests.browser.conftest import CHROMIUM, FLAGS, Served
from tests.browser.page import Page
from tests.webapp.bench import memory

BROWSERS = 8
SIZE = {"width": 820, "height": 420}
PATIENCE = 4.0
"""How much longer than for a test a page is waited for."""
SLOW_DRAWING = """
const soon = window.requestAnimationFrame.bind(window);
window.requestAnimationFrame = draw => window.setTimeout(() => soon(draw), 500);
"""
"""At most two frames a second."""


def nodes(app: Any) -> int:
    """Scene nodes and widgets of all pages."""
    return sum(
        len(view.client.scene._handle_from_node_name) + len(view.client.gui._gui_input_handle_from_uuid)
        for view in app.views.values()
    )


def changed(pages: list[Page], k: int) -> float:
    """Ask something else on every page, and wait [s] until each shows its own answer."""
    values = [round(0.1 * (1 + (k * 7 + i * 3) % 11) + 0.01 * i, 2) for i in range(len(pages))]
    start = time.perf_counter()
    for page, value in zip(pages, values, strict=True):
        page.row("Fy [N]").last.fill(f"{value:g}")
    for page, value in zip(pages, values, strict=True):
        page.until(lambda page=page, value=value: page.session.state.target[1] == value, seconds=60)
        page.until(lambda page=page, value=value: f"+{value:.2f}" in page.text(".bars"), seconds=60)
    took = time.perf_counter() - start
    assert [page.session.state.target[1] for page in pages] == values, "pages are apart"
    return took


def main(seconds: float) -> None:
    """Print the figures."""
    from playwright.sync_api import sync_playwright

    from finlab.assets import shipped_layouts
    from finlab.layout import load_layout
    from webapp.app import App
    from webapp.session import Display
    from webapp.session.state import State
    from webapp.session.targets import FIRST
    from webapp.tasks.solver import Solver
    from webapp.viser_internals import start_server, stop_server

    server, solver = start_server(), Solver()
    ucat = load_layout(shipped_layouts()["ucat"])
    solver.reply(State(ucat, target=FIRST))
    app = App(server, solver, ucat, Display(shadows=False, frozen=True))
    served = Served(f"http://127.0.0.1:{server.get_port()}/?fixedDpr=0.1", app, server)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=CHROMIUM, headless=True, chromium_sandbox=False, args=FLAGS
        )
        pages = []
        start = time.perf_counter()
        for _ in range(BROWSERS):  # a context is a browser profile of its own, with its own storage
            context = browser.new_context(viewport=SIZE)
            context.add_init_script(SLOW_DRAWING)
            pages.append(Page(context.new_page(), served, patience=PATIENCE))
            print(f"browser {len(pages)} is there after {time.perf_counter() - start:.0f} s", flush=True)
        changed(pages, 0)
        before, megabytes = nodes(app), memory()
        times: list[float] = []
        end = time.perf_counter() + seconds
        while time.perf_counter() < end:
            times.append(changed(pages, 1 + len(times)))
        p50, p95 = np.percentile(times, [50, 95])
        print(f"{BROWSERS} browsers, {len(times)} rounds: all pages show their own answer")
        print(f"after {p50:.1f} s in the median, {p95:.1f} s at 95 %")
        print(f"memory of the server: {megabytes:.0f} MB before, {memory():.0f} MB after")
        print(f"nodes and widgets: {before} before, {nodes(app)} after")
        print(f"errors on the pages: {sum(len(page.problems) for page in pages)}")
        browser.close()
    app.stop()
    stop_server(server)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)
