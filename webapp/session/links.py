"""Mirror pairs that stay mirror pairs: when one actuator moves, its twin does."""

import numpy as np

from finlab.layout import Layout
from finlab.layout.directions import axis_names, image, part_of, replaced, with_axes

Links = tuple[tuple[str, str], ...]
"""Pairs of names; an actuator is in at most one of them."""


def partner(links: Links, name: str) -> str | None:
    """The actuator that `name` is linked to, if any."""
    for pair in links:
        if name in pair:
            return pair[1 - pair.index(name)]
    return None


def linked(links: Links, a: str, b: str) -> Links:
    """The links with one more pair."""
    return (*unlinked(unlinked(links, a), b), (a, b))


def unlinked(links: Links, name: str) -> Links:
    """The links without the pair of an actuator."""
    return tuple(pair for pair in links if name not in pair)


def followed(before: Layout, layout: Layout, links: Links, name: str) -> Layout:
    """The layout after the twin of `name`, if it has one, has taken its mirrored place.

    Axes that pointed the other way than the image's `before` stay so.
    """
    twin = partner(links, name)
    if twin is None or twin not in layout.names:
        return layout
    wanted, old = image(part_of(layout, name)), part_of(layout, twin)
    count = len(axis_names(old))
    past = np.sum(np.array(image(part_of(before, name)).frame) * part_of(before, twin).frame, axis=1)
    frame = np.array(wanted.frame) * np.where(past < 0.0, -1.0, 1.0)[:, None]
    return replaced(layout, with_axes(old, frame[:count], wanted.position))
