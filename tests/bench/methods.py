"""Methods that go wrong, each in its own way."""

import time
from typing import Any

import numpy as np

import finlab


def rests(layout: finlab.Layout, targets: np.ndarray) -> np.ndarray:
    """The least of everything; what it prints is no answer."""
    print("an answer?", targets)
    return np.tile(layout.lower, (len(targets), 1, 1))


def turns_on(targets: np.ndarray, layout: finlab.Layout, previous: np.ndarray | None) -> np.ndarray:
    """From tick to tick 0.1 rad more, past the seam."""
    first = np.array(layout.lower) if previous is None else previous
    return np.tile(first + [0.0, 0.0, 0.1], (len(targets), 1, 1))


def raises(targets: np.ndarray) -> np.ndarray:
    raise RuntimeError("no idea")


def is_slow(layout: finlab.Layout, targets: np.ndarray) -> np.ndarray:
    time.sleep(0.06)
    return rests(layout, targets)


def is_empty(targets: np.ndarray) -> list[Any]:
    return []


def says_nan(layout: finlab.Layout, targets: np.ndarray) -> np.ndarray:
    return np.nan * rests(layout, targets)


def leaves_limits(robot: dict[str, Any], targets: np.ndarray) -> list[Any]:
    return [[[0.61, 1.0, 0.0] for _ in robot["fins"]] for _ in targets]


def wants_more(targets: np.ndarray, weather: str) -> np.ndarray:
    return targets
