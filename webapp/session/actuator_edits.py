"""Changes of one actuator, each of which returns another one, and of its twin in a mirror pair."""

from typing import Any

import numpy as np

from finlab.actuators.kinds import KINDS
from finlab.errors import FinlabError
from finlab.layout import Actuator, Layout
from webapp.session.state import Links, chosen


def with_value(part: Actuator, key: str, value: Any) -> Actuator:
    """See `Actuator.with_value`; numbers of a pair are of one type."""
    if isinstance(value, (tuple, list)):
        value = tuple(float(end) if isinstance(end, int) else end for end in value)
    return part.with_value(key, value)


def modelled(part: Actuator, kind: str) -> Actuator:
    """The actuator with another kind of model, see `Actuator.with_model`; as it is where its kind has no such
    one. FinlabError: there is no such model, or it needs a file."""
    if not part.MODELS or kind == part.model_type:
        return part
    if kind == "table":
        raise FinlabError(f"a table for {part.name} comes from a file; drop its CSV, or fit measurements")
    chosen(kind, "model", [model for own in KINDS.values() for model in own.MODELS])
    return part.with_model(kind) if kind in part.MODELS else part


def partner(links: Links, name: str) -> str | None:
    """The actuator that `name` is linked to, if any."""
    for pair in links:
        if name in pair:
            return pair[1 - pair.index(name)]
    return None


def unlinked(links: Links, name: str) -> Links:
    """The links without the pair of an actuator."""
    return tuple(pair for pair in links if name not in pair)


def followed(before: Layout, layout: Layout, links: Links, name: str) -> Layout:
    """The layout after the twin of `name`, if any, took its mirrored place; axes that pointed the other way
    than the image's `before` stay so."""
    twin = partner(links, name)
    if twin is None or twin not in layout.names:
        return layout
    wanted, old = layout.part(name).image(), layout.part(twin)
    count = len(old.AXES)
    past = np.sum(np.array(before.part(name).image().frame) * before.part(twin).frame, axis=1)
    frame = np.array(wanted.frame) * np.where(past < 0.0, -1.0, 1.0)[:, None]
    return layout.with_part(old.turned(frame[:count], wanted.position))
