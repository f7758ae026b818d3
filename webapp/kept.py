"""Functions whose last result is kept: a page asks for the same again whenever it is written."""

import operator
from collections.abc import Callable
from typing import Any


class Kept:
    """A function whose last result is kept while its arguments are the same objects."""

    def __init__(self, make: Callable[..., Any]) -> None:
        """Nothing is made yet."""
        self._make = make
        self._of: tuple[Any, ...] | None = None
        self._made: Any = None

    def __call__(self, *of: Any) -> Any:
        """What it made of these, or makes of them now."""
        if self._of is None or not all(map(operator.is_, of, self._of)):
            self._made = self._make(*of)
            self._of = of
        return self._made
