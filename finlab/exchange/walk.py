"""All places in plain values, and which of them were read."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import Array

MOST = 300
"""Most characters of a list of keys."""


class Node(NamedTuple):
    """A value, the keys that lead to it, and the mappings around it, the innermost first."""

    path: tuple[str, ...]
    value: Any
    scopes: tuple[Mapping[str, Any], ...]

    @property
    def key(self) -> str:
        """Its last key, without places in lists."""
        return next((key for key in reversed(self.path) if not key.startswith("[")), "")

    @property
    def words(self) -> str:
        """Its keys as a sentence has them."""
        return (".".join(self.path).replace(".[", "[") or "the file")[:100]


def nodes(data: Any) -> Iterator[Node]:
    """Yields all mappings, lists and values in plain values, outer ones first; numbers in lists stay there."""
    waiting = [Node((), data, ())]
    while waiting:
        node = waiting.pop()
        yield node
        if isinstance(node.value, Mapping):
            inner = [
                Node((*node.path, key), each, (node.value, *node.scopes)) for key, each in node.value.items()
            ]
            waiting += reversed(inner)
        elif isinstance(node.value, list):
            inner = [
                Node((*node.path, f"[{i}]"), each, node.scopes)
                for i, each in enumerate(node.value)
                if isinstance(each, Mapping | list)
            ]
            waiting += reversed(inner)


def unread(data: Any, used: set[tuple[str, ...]]) -> str:
    """Returns the keys of values that lie below none that were used, with commas between."""
    keys = [
        node.words
        for node in nodes(data)
        if not isinstance(node.value, Mapping)
        and not (node.path and node.path[-1].startswith("["))
        and not any(node.path[:i] in used for i in range(len(node.path) + 1))
    ]
    text = ", ".join(keys)
    return text if len(text) <= MOST else text[:MOST].rpartition(",")[0] + ", ..."


def numbers_in(values: Any) -> Array | None:
    """Returns numbers, or text that stands for them, as an array; None where some are none."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return None
    return array if array.size and np.isfinite(array).all() else None
