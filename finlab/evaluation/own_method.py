"""A method of your own, a Python function, wherever an experiment takes the name of a method.

The function is handed what its parameters ask for by name: `targets` (N, 6) [N, N m] in the body frame,
`layout` (a `finlab.Layout`), `sigma` (6,), what the allocator divides errors by, and `previous`, the command
(n, 3) of the tick before or None. It returns commands (N, n, 3), as `finlab.Allocation` has them.
"""

import inspect
import os
import runpy
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from finlab.allocation.method import Method
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.errors import AllocationError, DataError

KNOWN = ("targets", "layout", "sigma", "previous")
"""Parameters that a function may have."""
TOLERANCE = 1e-6
"""By how much a command may leave its limits, as a share of what they span and of one of its unit."""


def own_method(name: str) -> type[Method]:
    """The method of a function, given as `module:function` or `file.py:function`.

    Raises:
        DataError: there is no such function, or one of its parameters is none of `KNOWN`.
    """
    function = _function(name)
    try:
        wanted = inspect.signature(function).parameters
    except ValueError:
        raise DataError(f"{name}: its parameters are not known; wrap it in a function") from None
    if unknown := [p.name for p in wanted.values() if p.default is p.empty and p.name not in KNOWN]:
        raise DataError(f"{name}: expected parameters among {', '.join(KNOWN)}, got {unknown[0]!r}")
    given = {"name": name.rpartition("/")[2], "function": staticmethod(function), "wanted": tuple(wanted)}
    return type("OwnMethod", (_OwnMethod,), given)


class _OwnMethod(Method):
    """A function as a method; the rest of a method's errors are its own."""

    every_policy = False
    function: ClassVar[Callable[..., Any]]
    wanted: ClassVar[tuple[str, ...]]

    def solve(self, targets: Array, *, previous: Array | None = None, **asked: Any) -> Solution:
        """See `Method`.

        Raises:
            AllocationError: the function raised, or what it gave are no commands within the limits.
        """
        known = {"targets": targets, "layout": self.layout, "sigma": self.scale, "previous": previous}
        try:
            given = self.function(**{key: known[key] for key in self.wanted if key in known})
            command = np.asarray(given, dtype=np.float64)
        except Exception as error:  # a stranger's function may fail in any way
            words = f"{type(error).__name__}: {error}"
            raise AllocationError(f"{self.name}: layout {self.layout.name!r:.60}: {words:.300}") from error
        shape = (len(targets), self.layout.n, 3)
        if command.shape != shape or not np.isfinite(command).all():
            raise AllocationError(
                f"{self.name}: expected finite commands of shape {shape}, got shape {command.shape}"
            )
        within = self.plant.feasible(command)
        away = np.abs(command - within)
        away[..., 2] = np.where(self.plant.full_turn, 0.0, away[..., 2])  # these may be any angle
        if (away > TOLERANCE * np.maximum(self.plant.width, 1.0)).any():
            part = self.layout.names[int(away.max(axis=(0, 2)).argmax())]
            raise AllocationError(
                f"{self.name}: a command of {part!r:.60} is {away.max():.3g} out of its limits"
            )
        return Solution(within)


def _function(name: str) -> Callable[..., Any]:
    place, _, attribute = name.rpartition(":")
    try:
        if place.endswith(".py"):
            sys.path.insert(0, str(Path(place).resolve().parent))
            found = runpy.run_path(place).get(attribute)
        else:
            sys.path.insert(0, os.getcwd())
            found = getattr(import_module(place), attribute, None)
    except Exception as error:  # a stranger's file may fail in any way
        raise DataError(f"{place}: cannot be loaded: {type(error).__name__}: {error}") from None
    if not callable(found):
        raise DataError(f"{place}: holds no function {attribute!r}")
    function: Callable[..., Any] = found
    return function
