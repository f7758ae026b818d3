"""The figures of the app, in a real browser: `tools/bench-app [walk] [--seed N] ...`.

Each is printed with the machine and its load. Not a test, but it ends with 1 where something is wrong.
"""

import argparse
import contextlib
import os
import platform
import sys
import traceback
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from tests.browser.conftest import CHROMIUM, FLAGS, MISSING, Served, serving


def machine() -> str:
    """What it runs on, and how busy that is."""
    return f"Python {platform.python_version()}, {platform.machine()}, {os.cpu_count()} cores, {load()}"


def load() -> str:
    """How busy the machine was in the last minute."""
    return f"load {os.getloadavg()[0]:.1f}"


@contextlib.contextmanager
def browser() -> Iterator[Any]:
    """One Chromium."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        options: dict[str, Any] = {"executable_path": CHROMIUM, "headless": True, "chromium_sandbox": False}
        chromium = playwright.chromium.launch(args=FLAGS, **options)
        yield chromium
        chromium.close()


@contextlib.contextmanager
def opened(**options: Any) -> Iterator[tuple[Any, Served]]:
    """A page of an app of its own."""
    from tests.browser.page import Page
    from tests.browser.slow_drawing import slow_drawing

    with serving() as served, browser() as chromium:
        served.url = served.url.replace("0.3", "0.1")  # nobody looks at the view
        context = chromium.new_context(viewport={"width": 1400, "height": 860}, **options)
        context.add_init_script(slow_drawing(250))
        yield Page(context.new_page(), served), served


def walk(options: argparse.Namespace) -> bool:
    """Random typing and clicking over every control, against a model."""
    from tests.browser.walk.compare import unknown
    from tests.browser.walk.walk import Walk

    with opened(accept_downloads=True) as (page, _):
        walker, left_out = Walk(page, options.seed), set()
        for k in range(options.actions):
            try:
                walker.act()
            except AssertionError as error:
                print(f"walk: {error}", flush=True)
                print("".join(traceback.format_exception(error.__cause__)), flush=True)
                return False
            left_out |= set(unknown(walker))
            if (k + 1) % 100 == 0:
                print(f"walk: {k + 1} actions, no mismatch", flush=True)
        print(f"walk: {options.actions} actions, seed {options.seed}, no mismatch: {dict(walker.done)}")
        print(f"walk: rows of the page that it does not know: {', '.join(sorted(left_out)) or 'none'}")
    return not left_out


def quick(options: argparse.Namespace) -> bool:
    """From a key to the answer, from a change at the server to the arrows, and the first page."""
    from statistics import median

    from tests.browser.page import Page
    from tests.browser.quickness import (
        FIRST_HEARD,
        change_to_arrows,
        command,
        first_page,
        key_to_answer,
        said,
    )
    from webapp.tasks.solver import Solver

    with serving(Solver()) as served, browser() as chromium:
        context = chromium.new_context(viewport={"width": 1400, "height": 860})
        context.add_init_script(FIRST_HEARD)
        page = Page(context.new_page(), served)
        runs = [key_to_answer(page, options.keys) for _ in range(options.runs)]
    for times in runs:
        print(f"quick: key to answer on the page, {len(times)} keys: {said(times)} ms, {load()}", flush=True)
    p95 = median(float(np.percentile(times, 95)) for times in runs)
    print(f"quick: key to answer, median of {len(runs)} runs' p95: {p95:.0f} ms (goal 60 on a quiet machine)")
    changes = [change_to_arrows(200, options.seed) for _ in range(options.runs)]
    for times, computing in changes:
        about = f"{said(times, 1)} ms, computing {computing:.1f} ms, {load()}"
        print(f"quick: change at the server to arrows: {about}")
    arrows = median(float(np.percentile(times, 95)) for times, _ in changes)
    print(f"quick: change to arrows, median of {len(changes)} runs' p95: {arrows:.1f} ms (goal 20)")
    with command() as address:
        firsts = []
        for _ in range(options.runs):
            with browser() as chromium:
                firsts.append(first_page(chromium, address))
    listed = ", ".join(f"{seconds:.1f}" for seconds in firsts)
    print(f"quick: first page, browser cold: {listed} s, median {median(firsts):.1f} (goal 4), {load()}")
    return p95 <= 60.0 and arrows <= 20.0 and median(firsts) <= 4.0


def axe(_options: argparse.Namespace) -> bool:
    """What axe-core finds on every task, light and dark."""
    from tests.browser.accessibility import findings
    from webapp.session.looking import DRAWERS, TASKS

    found = []
    with opened() as (page, _):
        for dark in (False, True):
            if dark:
                page.unfold("Display", "Dark")
                page.row("Dark").first.click()
                page.page.wait_for_selector("html[data-mantine-color-scheme=dark]")
                page.tab("Display")
            for name in [name for task in TASKS for name in (DRAWERS[task] or (task,))]:
                page.tab(name)
                lines = findings(page)
                found += lines
                said = "; ".join(lines) or "no serious finding"
                print(f"axe: {name}, {'dark' if dark else 'light'}: {said}", flush=True)
    return not found


def looks(options: argparse.Namespace) -> bool:
    """All pictures of the page against the stored ones, or (`--store`) in their place."""
    from pathlib import Path

    from tests.browser.looks import STATES, comparable, differing, note, pictures, small, store, stored
    from tests.browser.page import Page

    count, other = 0, []
    with serving() as served, browser() as chromium:
        if not options.store and not comparable(chromium.version):
            print("looks: the stored pictures are of another Chromium or font; --store makes new ones")
            return False
        served.url = served.url.replace("0.3", "1")
        page = Page(chromium.new_page(viewport={"width": 1400, "height": 860}), served)
        for look, picture in pictures(page, options.states or STATES):
            count += 1
            if options.full:
                picture.save(Path(options.full) / f"{look.path.stem}.png")
            if options.store:
                store(look, picture)
                note(chromium.version)
            elif not look.path.is_file():
                other.append(look.path.stem)
                print(
                    f"looks: {look.path.stem} is not stored (--store)",
                    flush=True,
                )
            elif tiles := differing(small(picture), stored(look)):
                other.append(look.path.stem)
                print(f"looks: {look.path.stem} looks different in {len(tiles)} tiles", flush=True)
        print(f"looks: {count} pictures, {'stored' if options.store else f'{len(other)} look different'}")
    return not other


def soak(options: argparse.Namespace) -> bool:
    """Eight browsers at once: each shows its own answer, and memory stays flat."""
    from tests.browser.soak import soak

    return soak(options.changes)


PARTS: dict[str, Callable[[argparse.Namespace], bool]] = {
    "walk": walk,
    "quick": quick,
    "axe": axe,
    "looks": looks,
    "soak": soak,
}
"""What can be printed, by name; each says whether all was well."""


def main() -> int:
    """Print what is wanted, or everything."""
    parser = argparse.ArgumentParser(prog="tools/bench-app", description=__doc__)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help="what to print; all without")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keys", type=int, default=60, help="of a run of quick")
    parser.add_argument("--runs", type=int, default=3, help="of quick")
    parser.add_argument("--actions", type=int, default=2000, help="of the walk")
    parser.add_argument("--changes", type=int, default=10_000, help="of soak")
    parser.add_argument("--store", action="store_true", help="looks: make them anew")
    parser.add_argument("--states", nargs="*", help="looks: only these states")
    parser.add_argument("--full", help="looks: a folder that gets the pictures in full size, too")
    options = parser.parse_args()
    if CHROMIUM is None:
        print(MISSING)
        return 1
    well = True
    for name in options.parts or PARTS:
        print(f"== {name}: {machine()}", flush=True)
        well = PARTS[name](options) and well
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
