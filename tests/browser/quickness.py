"""How quick the app is: from a key to its answer, at the server, and until a first page can be used."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

FIRST_HEARD = """
window.addEventListener('keydown', () => {
  window.finlabKey = [performance.now(), document.querySelector('.bars span.asked')?.textContent];
}, { capture: true });
"""
"""Runs before anything of the page's own, which keeps keys to itself."""
WATCH = """() => {
  const bars = (kind) => document.querySelector(`.bars span.${kind}`)?.textContent;
  window.finlabTimes = [];
  const painted = new MessageChannel();
  painted.port1.onmessage = (event) => window.finlabTimes.push(performance.now() - event.data);
  window.finlabWatch ??= new MutationObserver(() => {
    const [start, before] = window.finlabKey ?? [0];
    if (!start || bars('asked') === before || bars('given') !== bars('asked')) return;
    window.finlabKey = null;
    requestAnimationFrame(() => painted.port2.postMessage(start));
  });
  window.finlabWatch.observe(document.body, { childList: true, subtree: true, characterData: true });
}"""
"""Notes the time [ms] from a key until a frame with another wrench asked, and delivered, has been drawn."""
READY = """() => document.querySelector('.fl-tasks button') && document.querySelector('.fl-status .err')
  && window.__viserMutable?.nodeRefFromName['/robot/fins/0/turn/blade'] && performance.now()"""
"""Time [ms] since the address was entered, once the panels, the robot and a first answer are there."""
APART_MS = 250
"""Between two keys: what one brings is over before the next."""


def key_to_answer(page: Any, keys: int) -> list[float]:
    """Times [ms] from an arrow key in the box for Fx to the answer on the page, which has `FIRST_HEARD`."""
    page.page.evaluate(WATCH)
    box = page.row("Fx [N]").last
    box.click()
    for k in range(keys):
        page.page.keyboard.press("ArrowUp" if k % 40 < 20 else "ArrowDown")
        page.until(lambda k=k: page.page.evaluate("() => finlabTimes.length") > k, 20)
        page.rest(APART_MS)
    times: list[float] = page.page.evaluate("() => finlabTimes")
    return times


def change_to_arrows(changes: int, seed: int) -> tuple[list[float], float]:
    """Times [ms] from a change of the wrench to the new page handed to viser, on a server of its own; and how
    much the processor computes for each, all threads together [ms]."""
    from tests.webapp.bench import Bench
    from webapp.tasks.solver import Solver

    rng = np.random.default_rng(seed)
    bench = Bench(Solver(), 1)
    bench.settle()
    bench.respond(10, rng)
    computing = time.process_time()
    times = bench.respond(changes, rng)
    computing = 1000.0 * (time.process_time() - computing) / len(times)
    bench.close()
    return times, computing


@contextmanager
def command() -> Any:
    """The app as `make app` starts it; its address."""
    with tempfile.TemporaryDirectory() as home:
        asked = [sys.executable, "-m", "finlab", "app", "--port", "0"]
        known = os.environ | {"XDG_CACHE_HOME": home}
        process = subprocess.Popen(asked, stdout=subprocess.PIPE, text=True, env=known, cwd=Path.cwd())
        try:
            assert process.stdout is not None
            words = next(line for line in process.stdout if "http://" in line).split()
            yield next(word for word in words if word.startswith("http://"))
        finally:
            process.terminate()
            process.wait(20)


def first_page(browser: Any, address: str) -> float:
    """Time [s] from the address entered in a browser that never saw the app until it can be used; the
    welcome card is there and the first click is heard."""
    context = browser.new_context(viewport={"width": 1400, "height": 860})
    tab = context.new_page()
    tab.set_default_timeout(120_000)
    tab.goto(address)
    ready = 1e-3 * float(tab.wait_for_function(READY, polling=20).json_value())
    tab.get_by_role("button", name="Close", exact=True).first.click()
    context.close()
    return ready


def said(times: Sequence[float], digits: int = 0) -> str:
    """Median and 95 % of some times."""
    p50, p95 = np.percentile(times, [50, 95])
    return f"p50 {p50:.{digits}f}, p95 {p95:.{digits}f}"
