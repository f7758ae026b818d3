"""All places in plain values, and which of them were read."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.errors import LayoutError

MOST, MAX_NODES = 300, 30_000
"""Most characters of a list of keys, and most values that are looked at."""
Path = tuple[str, ...]


class Node(NamedTuple):
    """A value in plain values."""

    path: Path
    """The keys that lead to it."""
    value: Any
    scopes: tuple[tuple[Path, Mapping[str, Any]], ...]
    """The mappings around it and their paths, the innermost first; a mapping itself is the first."""

    @property
    def key(self) -> str:
        """Its last key, without places in lists."""
        return next((key for key in reversed(self.path) if not key.startswith("[")), "")

    @property
    def words(self) -> str:
        """Its keys as a sentence has them."""
        return (".".join(self.path).replace(".[", "[") or "the file")[:100]


def nodes(data: Any) -> Iterator[Node]:
    """Yields all mappings, lists and values in plain values, outer ones first, but no numbers in lists.
    Raises LayoutError: there are too many."""
    waiting: list[Node] = [Node((), data, ())]
    count = 0
    while waiting:
        path, value, scopes = node = waiting.pop()
        count += len(value) if isinstance(value, Mapping | list) else 0
        if count > MAX_NODES:
            raise LayoutError(f"has more than {MAX_NODES:,} entries, too many to be read")
        inner: Iterable[tuple[str, Any]] = ()
        if isinstance(value, Mapping):
            scopes, inner = ((path, value), *scopes), value.items()
            node = Node(path, value, scopes)
        elif isinstance(value, list):
            inner = ((f"[{i}]", each) for i, each in enumerate(value) if isinstance(each, Mapping | list))
        yield node
        waiting += [Node((*path, key), each, scopes) for key, each in [*inner][::-1]]


def unread(data: Any, used: set[Path]) -> str:
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
    return array if array.size and (np.abs(array) < 1e9).all() else None
