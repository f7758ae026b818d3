"""Least and most force of thrusters, by the words of others."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from finlab.errors import LayoutError
from finlab.exchange.exchange import Exchange
from finlab.exchange.labels import FORCES, LEAST, MOST, PAIR, lookup
from finlab.exchange.walk import numbers_in

Ends = tuple[float, float]


def limits_in(values: Mapping[str, Any], n: int, exchange: Exchange) -> list[Ends | None]:
    """Returns least and most [N, or of a command] of each of n thrusters in a mapping; None where unsaid.

    One pair, or one number of each, is for all. A most alone is for both ways.

    Raises:
        LayoutError: a limit is no number, or there are not as many as thrusters.
    """
    key, pair, size = lookup(values, PAIR, FORCES)
    ends = numbers_in(pair)
    if key and pair is not None:
        if ends is None or ends.shape not in ((2,), (n, 2), (2, n)):
            raise LayoutError(f"expected a name, and least and most command, for each of {n} columns", key)
        ends = (ends if ends.shape == (n, 2) or ends.ndim == 1 else ends.T) * size
    else:
        (low_key, low, low_size), (high_key, high, high_size) = (
            lookup(values, words, FORCES) for words in (LEAST, MOST)
        )
        if not high_key or high is None:
            return [None] * n
        most = numbers_in(high)
        least = numbers_in(low) if low_key and low is not None else None if most is None else -most
        if most is None or least is None or most.size not in (1, n) or least.size not in (1, n):
            raise LayoutError(f"expected a number, or one for each of {n} thrusters", f"{low_key} {high_key}")
        if not low_key:
            exchange.note(f"{high_key} says nothing of reverse: as much is taken for it.")
        sides = np.broadcast_arrays(
            least.ravel() * (low_size if low_key else high_size), most.ravel() * high_size
        )
        ends = np.stack(sides, axis=-1)
        ends = ends if len(ends) == n else ends[0]
    low_high = np.broadcast_to(ends, (n, 2))
    return [(float(low), float(high)) for low, high in low_high.tolist()]
