"""Mirror pairs that stay mirror pairs: when one fin moves, its twin does."""

import math
from dataclasses import replace

from finlab.layout import Fin, Layout
from finlab.layout.angles import wrapped

Links = tuple[tuple[str, str], ...]
"""Pairs of names; a fin is in at most one of them."""

CLOSE_M, CLOSE_RAD = 0.005, math.radians(1.0)
"""How far [m], [rad] a fin may be from another one's mirror image to count as it."""


def image(fin: Fin) -> Fin:
    """The fin on the other side of the xz plane, under the same name.

    y and the shaft's azimuth change sign.
    """
    x, y, z = fin.position
    return replace(fin, position=(x, -y, z), mounting_angle=float(wrapped(-fin.shaft_azimuth)))


def partner(links: Links, name: str) -> str | None:
    """The fin that `name` is linked to, if any."""
    for pair in links:
        if name in pair:
            return pair[1 - pair.index(name)]
    return None


def linked(links: Links, a: str, b: str) -> Links:
    """The links with one more pair."""
    return (*unlinked(unlinked(links, a), b), (a, b))


def unlinked(links: Links, name: str) -> Links:
    """The links without the pair of a fin."""
    return tuple(pair for pair in links if name not in pair)


def kept(links: Links, layout: Layout) -> Links:
    """The links whose fins both exist."""
    return tuple(pair for pair in links if set(pair) <= set(layout.names))


def followed(layout: Layout, links: Links, name: str) -> Layout:
    """The layout after the twin of `name`, if it has one, has taken its mirrored place."""
    twin = partner(links, name)
    if twin is None or twin not in layout.names:
        return layout
    wanted = image(layout.fins[layout.index(name)])
    return layout.replace_actuator(twin, position=wanted.position, mounting_angle=wanted.shaft_azimuth)


def existing_image(layout: Layout, name: str) -> str | None:
    """The fin that already stands where the mirror image of `name` would."""
    wanted = image(layout.fins[layout.index(name)])
    for fin in layout.fins:
        turn = abs(float(wrapped(fin.shaft_azimuth - wanted.shaft_azimuth)))
        if fin.name != name and math.dist(fin.position, wanted.position) < CLOSE_M and turn < CLOSE_RAD:
            return fin.name
    return None
