"""Eight browsers at once, with real keys and the shipped checkpoint; `tools/bench-app soak` prints it.

Not a test: it measures the machine as much as the app. It fails where pages get in each other's way, and
prints how long they wait and whether the server grows. Without a graphics card eight 3D views are too much
for any machine, so a page draws only so often, as one in the background would; all else of it is real.
"""

import time
from typing import Any

import numpy as np

from tests.browser.conftest import CHROMIUM, FLAGS
from tests.browser.page import Page
from tests.browser.slow_drawing import slow_drawing
from tests.webapp.bench import memory

BROWSERS = 8
BURST = 25
"""Keys on each page between two looks at all of them."""
SIZE = {"width": 820, "height": 420}
FLAT = 0.05
"""Share by which the memory of the server may grow from one look to the last: what its pool keeps."""
PATIENCE = 4.0
"""How much longer than for a test a page is waited for."""
HEAP = "() => performance.memory.usedJSHeapSize / 1e6"
"""Memory of a page's scripts [MB]."""


def nodes(app: Any) -> int:
    """Scene nodes and widgets of all pages."""
    return sum(
        len(view.client.scene._handle_from_node_name) + len(view.client.gui._gui_input_handle_from_uuid)
        for view in app.views.values()
    )


def burst(pages: list[Page], wanted: list[float]) -> float:
    """Press keys on all pages in turn, and wait [s] until each shows the answer to its own `wanted` Fy."""
    boxes = [page.row("Fy [N]").last for page in pages]
    for box in boxes:
        box.click()
    for k in range(BURST):
        for page in pages:
            page.page.keyboard.press("ArrowUp" if k % 5 else "ArrowDown")
    start = time.perf_counter()
    for i, page in enumerate(pages):
        wanted[i] = round(wanted[i] + 0.01 * sum(1 if k % 5 else -1 for k in range(BURST)), 4)
        if wanted[i] > 2.5:
            wanted[i] = round(0.1 + 0.01 * i, 4)
            boxes[i].fill(f"{wanted[i]:g}")
            page.page.keyboard.press("Enter")
    for page, value in zip(pages, wanted, strict=True):
        page.until(lambda page=page, value=value: page.session.state.target[1] == value, seconds=60)
        page.until(lambda page=page, value=value: f"+{value:.2f}" in page.text(".bars"), seconds=60)
    return time.perf_counter() - start


def soak(changes: int) -> bool:
    """Print the figures; whether memory stayed flat and no page saw an error."""
    from playwright.sync_api import sync_playwright

    from tests.browser.conftest import serving
    from webapp.tasks.solver import Solver

    with serving(Solver()) as served, sync_playwright() as playwright:
        served.url = served.url.replace("0.3", "0.1")
        options: dict[str, Any] = {"executable_path": CHROMIUM, "headless": True, "chromium_sandbox": False}
        browser = playwright.chromium.launch(args=FLAGS, **options)
        pages = []
        for _ in range(BROWSERS):  # a context is a browser profile of its own, with its own storage
            context = browser.new_context(viewport=SIZE)
            context.add_init_script(slow_drawing(1000))
            pages.append(Page(context.new_page(), served, patience=PATIENCE))
        wanted = [round(0.1 + 0.01 * i, 4) for i in range(BROWSERS)]
        for page, value in zip(pages, wanted, strict=True):
            page.type("Fy [N]", f"{value:g}")
        times, seen = [], []
        done = 0
        while done < changes:
            times.append(burst(pages, wanted))
            done += BURST * BROWSERS
            if done % 1000 == 0 or done >= changes:
                heaps = [float(page.page.evaluate(HEAP)) for page in pages]
                seen.append((memory(), nodes(served.app)))
                about = (
                    f"server {seen[-1][0]:.0f} MB, {seen[-1][1]} nodes and widgets, pages {max(heaps):.0f} MB"
                )
                print(f"soak: {done} changes, each page its own answer; {about}", flush=True)
        p50, p95 = np.percentile(times, [50, 95])
        errors = sum(len(page.problems) for page in pages)
        print(
            f"soak: all pages show the last answer {p50:.1f} s after the keys in the median, p95 {p95:.1f} s"
        )
        print(f"soak: {errors} errors on the pages")
        browser.close()
    grown = seen[-1][0] / seen[0][0] - 1.0
    print(f"soak: memory of the server grew by {100 * grown:.1f} % from the first to the last look")
    return errors == 0 and grown < FLAT
