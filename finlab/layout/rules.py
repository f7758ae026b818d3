"""The small checks that every part of a layout is made of.

Each takes a value that may be anything (a file or a page sent it), the key it stands under, and returns it
in its final type or raises a `LayoutError` that names the key, the value and the expectation.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from finlab.errors import LayoutError

MAX_NAME_LENGTH = 64
MAX_DESCRIPTION_LENGTH = 4000


@contextmanager
def under(key: str = "", source: str = "") -> Iterator[None]:
    """Puts `key` before the keys of layout errors raised inside, and `source`, their file, before that."""
    try:
        yield
    except LayoutError as error:
        raise error.under(key, source) from None


def shown(value: Any) -> str:
    """Returns a short text of `value` for an error message, whatever its size."""
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "..."


def number(value: Any, key: str, low: float = -np.inf, high: float = np.inf, positive: bool = False) -> float:
    """Returns `value` as a finite float within `[low, high]`, above zero if `positive`.

    Raises:
        LayoutError: it is not a number (text, true and false are not), not finite, or out of bounds.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise LayoutError(f"expected a number, got {shown(value)}", key)
    try:
        result = float(value)
    except OverflowError:
        raise LayoutError("expected a number of ordinary size, got a huge integer", key) from None
    if not np.isfinite(result):
        raise LayoutError(f"expected a finite number, got {result}", key)
    if positive and result <= 0.0:
        raise LayoutError(f"must be above 0, got {result:g}", key)
    if not low <= result <= high:
        raise LayoutError(f"must lie within {low:g} .. {high:g}, got {result:g}", key)
    return result


def numbers(
    value: Any, key: str, count: int, low: float = -np.inf, high: float = np.inf
) -> tuple[float, ...]:
    """Returns `value` as a tuple of exactly `count` finite floats within `[low, high]`."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (str, bytes)) or not isinstance(value, Sequence):
        raise LayoutError(f"expected a list of {count} numbers, got {shown(value)}", key)
    if len(value) != count:
        raise LayoutError(f"expected a list of {count} numbers, got {len(value)}", key)
    return tuple(number(item, f"{key}[{i}]", low, high) for i, item in enumerate(value))


def interval(value: Any, key: str, low: float, high: float) -> tuple[float, float]:
    """Returns `value` as (minimum, maximum) within `[low, high]`; the two may be equal."""
    ends = numbers(value, key, 2, low, high)
    if ends[0] > ends[1]:
        raise LayoutError(f"minimum {ends[0]:g} is above maximum {ends[1]:g}; swap them", key)
    return ends[0], ends[1]


def text(value: Any, key: str, max_length: int, allow_empty: bool = False, one_line: bool = True) -> str:
    """Returns `value` if it is printable text of at most `max_length` characters, with no outer spaces."""
    if not isinstance(value, str):
        raise LayoutError(f"expected text, got {shown(value)}; put it in quotes if it is meant as text", key)
    if not value.strip() and not allow_empty:
        raise LayoutError("must not be empty", key)
    if len(value) > max_length:
        raise LayoutError(f"must have at most {max_length} characters, got {len(value)}", key)
    if not all(c.isprintable() or (c in "\n\t" and not one_line) for c in value):
        raise LayoutError(f"must hold printable characters only, got {shown(value)}", key)
    if one_line and value != value.strip():
        raise LayoutError(f"must not begin or end with a space, got {shown(value)}", key)
    return value


def mapping(value: Any, key: str, allowed: Sequence[str], required: Sequence[str] = ()) -> Mapping[str, Any]:
    """Returns `value` if it is a mapping that has the `required` keys and none beyond `allowed`."""
    if not isinstance(value, Mapping):
        raise LayoutError(f"expected keys and values ({', '.join(allowed)}), got {shown(value)}", key)
    for name in value:
        if name not in allowed:
            inner = name if isinstance(name, str) and len(name) <= 40 else shown(name)
            known = ", ".join(allowed)
            raise LayoutError(f"unknown key, expected one of {known}", f"{key}.{inner}" if key else inner)
    for name in required:
        if name not in value:
            raise LayoutError("required key is missing", f"{key}.{name}" if key else name)
    return value
