"""Bars of long work."""

import sys
from collections.abc import Iterable
from typing import TypeVar

from tqdm import tqdm

Item = TypeVar("Item")


def progress(items: Iterable[Item], unit: str, title: str | None = None) -> Iterable[Item]:
    """The items one by one, with a bar on stderr that is gone at the end; none where that is no terminal."""
    # disable=None: a bar on a terminal, nothing elsewhere
    return tqdm(items, title, unit=unit, disable=None, leave=False, file=sys.stderr)


def begin(words: str) -> None:
    """Say on a terminal what has begun, until the first bar stands in its place."""
    if sys.stderr.isatty():
        print(f"{words} ...", end="\r", file=sys.stderr, flush=True)
