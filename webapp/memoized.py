"""Functions whose last result is kept: a page asks for the same markup whenever it is written."""

import operator
from collections.abc import Callable
from typing import Any


class Memoized:
    """A function whose last result is kept while its arguments are the same objects."""

    def __init__(self, function: Callable[..., Any]) -> None:
        """Wraps a function that has not been called yet."""
        self._function = function
        self._arguments: tuple[Any, ...] | None = None
        self._result: Any = None

    def __call__(self, *arguments: Any) -> Any:
        """The result for these arguments, from the last call where they are the same objects."""
        if self._arguments is None or not all(map(operator.is_, arguments, self._arguments)):
            self._result = self._function(*arguments)
            self._arguments = arguments
        return self._result
