"""The figures of the app, in a real browser: `tools/bench-app [walk] [--seed N] ...`.

Each is printed with the machine and its load. Not a test, but it ends with 1 where something is wrong.
"""

import argparse
import contextlib
import os
import platform
import sys
from collections.abc import Callable, Iterator
from typing import Any

from tests.browser.conftest import CHROMIUM, FLAGS, MISSING, Served, serving


def machine() -> str:
    """What it runs on, and how busy that is."""
    load = ", ".join(f"{value:.1f}" for value in os.getloadavg())
    cores = os.cpu_count()
    return f"Python {platform.python_version()}, {platform.machine()}, {cores} cores, load {load}"


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
def opened(width: int = 1400, height: int = 860, **options: Any) -> Iterator[tuple[Any, Served]]:
    """A page of an app of its own."""
    from tests.browser.page import Page

    with serving() as served, browser() as chromium:
        context = chromium.new_context(viewport={"width": width, "height": height}, **options)
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
                return False
            left_out |= set(unknown(walker))
            if (k + 1) % 100 == 0:
                print(f"walk: {k + 1} actions, no mismatch", flush=True)
        print(f"walk: {options.actions} actions, seed {options.seed}, no mismatch: {dict(walker.done)}")
        print(f"walk: rows of the page that it does not know: {', '.join(sorted(left_out)) or 'none'}")
    return not left_out


PARTS: dict[str, Callable[[argparse.Namespace], bool]] = {"walk": walk}
"""What can be printed, by name; each says whether all was well."""


def main() -> int:
    """Print what is wanted, or everything."""
    parser = argparse.ArgumentParser(prog="tools/bench-app", description=__doc__)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help="what to print; all without")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--actions", type=int, default=2000, help="of the walk")
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
