"""Pairs of actuators whose loss is fatal: which second loss takes which axis away."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

from numpy.typing import ArrayLike

from finlab.analysis.authority import commanded_axes, reachable_axes
from finlab.axes import MotionAxis
from finlab.display import Block, Column, table_of
from finlab.layout import Layout

MAX_PAIRED = 64
"""Most working actuators whose pairs are looked at: 2,016 of them."""
PAIRS_AT_ONCE = 256
"""Pairs that are computed at once: bounds the memory."""
MAX_ROWS = 40
"""Most pairs in a table; there are more in what is returned."""


@dataclass(frozen=True)
class SecondLoss:
    """Two losses that take axes away together, which neither takes alone."""

    first: str
    """Name of one actuator, the earlier one of the layout."""
    second: str
    """Name of the other."""
    lost: tuple[MotionAxis, ...]
    """Axes of those that the robot commands that are reachable alone with either one lost, and with
    both no more."""


PAIR_COLUMNS = (
    Column("without", lambda pair: pair.first, is_text=True),
    Column("and without", lambda pair: pair.second, is_text=True),
    Column("loses", lambda pair: ", ".join(pair.lost), is_text=True),
)
"""Columns of the table of pairs; a row is a `SecondLoss`."""


def second_losses(
    layout: Layout, lost: Collection[str] = (), flow: ArrayLike | None = None
) -> tuple[SecondLoss, ...]:
    """Returns the pairs of working actuators whose loss takes an axis away that neither takes
    alone; none for more than `MAX_PAIRED` of them.

    Args:
        layout: the layout.
        lost: actuators that are lost already.
        flow: velocity (6,) of the body relative to the water [m/s, rad/s], body frame; None at
            rest.

    Raises:
        LayoutError: there is no actuator of a name in `lost`.
    """
    layout.indices(tuple(lost), "lost")
    working = [name for name in layout.names if name not in lost]
    if not 2 < len(working) <= MAX_PAIRED:
        return ()
    after_one = dict(
        zip(working, reachable_axes(layout, [(*lost, name) for name in working], flow), strict=True)
    )
    commanded = commanded_axes(layout)
    found = []
    for pair, reachable in _after_pairs(layout, working, lost, flow):
        first, second = pair
        taken = tuple(
            axis
            for axis in commanded
            if axis in after_one[first] and axis in after_one[second] and axis not in reachable
        )
        if taken:
            found.append(SecondLoss(first, second, taken))
    return tuple(found)


def _after_pairs(
    layout: Layout, working: Sequence[str], lost: Collection[str], flow: ArrayLike | None
) -> Iterator[tuple[tuple[str, str], tuple[MotionAxis, ...]]]:
    """Yields pairs of working actuators, each with the axes that are reachable without them."""
    pairs = [*combinations(working, 2)]
    for start in range(0, len(pairs), PAIRS_AT_ONCE):
        chunk = pairs[start : start + PAIRS_AT_ONCE]
        failures = [(*lost, *pair) for pair in chunk]
        yield from zip(chunk, reachable_axes(layout, failures, flow), strict=True)


def pair_blocks(pairs: Sequence[SecondLoss], n_working: int) -> list[Block]:
    """Returns a sentence and a table of fatal pairs.

    Args:
        pairs: of `second_losses`.
        n_working: how many actuators work.
    """
    if n_working > MAX_PAIRED:
        return [f"Pairs of losses are looked at for up to {MAX_PAIRED} actuators."]
    n_pairs = n_working * (n_working - 1) // 2
    if not pairs:
        return [f"None of {n_pairs} pairs of losses takes an axis away that either alone leaves."]
    counts = f"{len(pairs)} of {n_pairs}"
    title = f"Pairs of losses that take an axis away which either alone leaves, {counts}:"
    blocks: list[Block] = [table_of(PAIR_COLUMNS, pairs[:MAX_ROWS], title)]
    if len(pairs) > MAX_ROWS:
        blocks.append(f"{len(pairs) - MAX_ROWS} more; `finlab layout show --json` has all.")
    return blocks
