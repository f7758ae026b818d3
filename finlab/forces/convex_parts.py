"""Convex parts of what fins can push where the arcs of some are wider than half a turn.

The forces within such an arc are no convex set: from one of its ends the other lies across the gap, and a
descent that stops there does not see it. Each half of the arc is convex, and the cheapest forces of all
combinations of halves are the cheapest of all.
"""

from itertools import product

import numpy as np

from finlab.arrays import Array
from finlab.forces.envelopes import Envelopes

MOST_SPLIT = 4
"""Most arcs that are split, the widest first: each doubles the parts."""
MOST_STARTS = 300
"""Most starts of one search, in all parts together, which bounds its time and memory."""


def arcs_to_search(fins: Envelopes, n_seeds: int) -> tuple[Array, Array] | None:
    """Returns arcs in each of which a search from all seeds is worth it, or None where those of the fins do.

    Args:
        fins: what each can do.
        n_seeds: seeds of a search; the more, the fewer arcs are split.

    Returns:
        Middles and halves (P, n) [rad]: first the fins' own arcs, then all combinations of halves of those
        that are wider than half a turn.
    """
    wide = (fins.half > 0.5 * np.pi) & (fins.half < np.pi)
    most = min(MOST_SPLIT, int(np.log2(max(MOST_STARTS / n_seeds - 1.0, 1.0))))
    split = [i for i in np.argsort(-fins.half).tolist() if wide[i]][:most]
    if not split:
        return None
    sides = 0.5 * np.array(list(product((-1.0, 1.0), repeat=len(split))))
    middle, half = (np.tile(values, (1 + len(sides), 1)) for values in (fins.middle, fins.half))
    middle[1:, split] += sides * fins.half[split]
    half[1:, split] *= 0.5
    return middle, half
