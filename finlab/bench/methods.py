"""Methods under test: those of finlab by name, and Python functions of anybody.

A function is handed what its parameters ask for by name: `targets` (1, 6), `layout` (a `finlab.Layout`),
`robot` (the same as plain values of a layout file), `sigma` (6,), `previous` (n, 3) or None.
It returns commands (1, n, 3).
"""

import inspect
import os
import runpy
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.allocation.policy import CLOSEST, Policy
from finlab.arrays import Array
from finlab.errors import DataError
from finlab.evaluation.method_specs import load_method_spec
from finlab.layout import Layout

KNOWN = ("targets", "layout", "robot", "sigma", "previous")
"""Parameters that a function may have."""


class BenchMethod(NamedTuple):
    """A method under test."""

    name: str
    """What the tables call it."""
    answer: Callable[..., Any]
    """Takes what is in `KNOWN` by name."""


def bench_method(name: str) -> BenchMethod:
    """One of finlab's methods, `module:function` or `file.py:function`.

    Raises:
        AllocationError: no method of finlab has this name.
        DataError: there is no such function, or one of its parameters is none of `KNOWN`.
    """
    if ":" not in name:
        return BenchMethod(name, _method_of_finlab(name))
    function = _function(name)
    try:
        wanted = inspect.signature(function).parameters
    except ValueError:
        raise DataError(f"{name}: its parameters are not known; wrap it in a function") from None
    if unknown := [p.name for p in wanted.values() if p.default is p.empty and p.name not in KNOWN]:
        raise DataError(f"{name}: expected parameters among {', '.join(KNOWN)}, got {unknown[0]!r}")

    def answer(**given: Any) -> Any:
        return function(**{key: value for key, value in given.items() if key in wanted})

    return BenchMethod(name.rpartition("/")[2], answer)


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


def _method_of_finlab(name: str) -> Callable[..., Array]:
    """One of finlab's methods, told what the benchmark divides errors by, where it can weigh axes."""
    method = load_method_spec(name)
    made: dict[Layout, tuple[Allocator, Policy]] = {}

    def answer(layout: Layout, targets: Array, sigma: Array, previous: Array | None, **_: Any) -> Array:
        if layout not in made:
            allocator = method.on(layout)
            weighs = Policy(axis_weights=tuple((allocator.scale / sigma).tolist()))
            made[layout] = allocator, weighs if method.choice.kind.every_policy else CLOSEST
        allocator, policy = made[layout]
        return np.asarray(allocator.allocate(targets[0], policy=policy, previous=previous).command[None])

    return answer
