"""What makes a result plain data: two of them are equal if all their parts are, arrays included."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np


class PlainData:
    """Base of frozen dataclasses with arrays. NaN equals NaN; fields with `compare=False` do not count."""

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        names = [field.name for field in fields(self) if field.compare]  # type: ignore[arg-type]
        return all(equal(getattr(self, name), getattr(other, name)) for name in names)

    __hash__ = None  # type: ignore[assignment]


def equal(a: Any, b: Any) -> bool:
    """Whether two values are equal: arrays element by element, tuples part by part, NaN to NaN."""
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        if not (isinstance(a, np.ndarray) and isinstance(b, np.ndarray)):
            return False
        return np.array_equal(a, b, equal_nan=a.dtype.kind == b.dtype.kind == "f")
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(equal(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, float) and isinstance(b, float):
        return a == b or (a != a and b != b)
    return bool(a == b)
