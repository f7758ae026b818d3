"""Methods as users specify them: a name, or a Python function of their own, wherever an experiment
takes one.

The function is handed what its parameters ask for by name: `targets` (N, 6) [N, N m] in the body
frame, `layout` (a `finlab.Layout`), `sigma` (6,), what the allocator divides errors by, and
`previous`, the command (n, 3) of the tick before or None. It returns commands (N, n, 3), as
`finlab.Allocation` has them.
"""

import inspect
import os
import runpy
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from finlab.allocation import methods
from finlab.allocation.allocator import Allocator
from finlab.allocation.method import Method, MethodQuestion, Reads
from finlab.allocation.solution import Solution
from finlab.errors import AllocationError, DataError
from finlab.layout import Layout
from finlab.physics.objective import Name

SLOW = ("ipopt",)
"""Methods that take a tenth of a second per target, each from several starts; they run on a
subsample."""
NEEDS = {"ipopt": "casadi"}
"""Packages without which a method cannot run."""
PATIENCE_S = 60.0
"""Processor time [s] that a target may take where answers count and not times; starts and steps end
every method long before."""
KNOWN = ("targets", "layout", "sigma", "previous")
"""Parameters that a function may have."""
TOLERANCE = 1e-6
"""By how much a command may leave its limits, as a share of what they span and of one of its
unit."""


def installed_methods(layout: Layout) -> list[str]:
    """All methods of the library that can run here and take a robot."""
    return [
        name
        for name in methods.METHODS
        if can_run(name) and methods.method_class(name).fits(layout)
    ]


def can_run(name: str) -> bool:
    """Whether the package that a method needs is installed."""
    return name not in NEEDS or find_spec(NEEDS[name]) is not None


@dataclass(frozen=True)
class MethodSpec:
    """A method, as the user has written it, with its settings and networks, for any robot."""

    name: str
    choice: methods.MethodChoice

    def on(self, layout: Layout) -> Allocator:
        """The allocator of the method for a robot. Raises AllocationError: the method does not take
        it."""
        return Allocator.of_choice(layout, self.choice)

    def with_settings(self, **changes: Any) -> "MethodSpec":
        """The same method with those of some settings changed that it knows. Raises
        AllocationError: a value that it may not have."""
        kind = self.choice.kind
        known = {name: value for name, value in changes.items() if name in kind.option_names()}
        settings = methods.checked_settings(kind, {**vars(self.choice.settings), **known})
        return replace(self, choice=replace(self.choice, settings=settings))


def load_method_specs(
    names: Iterable[str],
    checkpoint: str | Path | None = None,
    objective: Name | None = None,
    *,
    patient: bool = False,
) -> dict[str, MethodSpec]:
    """Methods by name, in the order of the names; arguments and errors as for `load_method_spec`.
    Those that stop after a time get `PATIENCE_S` for each target where `patient`, so that the same
    question has the same answer on a busy machine."""
    specs = [load_method_spec(name, checkpoint, objective) for name in dict.fromkeys(names)]
    if patient:
        specs = [spec.with_settings(time_limit_s=PATIENCE_S) for spec in specs]
    return {spec.name: spec for spec in specs}


def load_method_spec(
    name: str, checkpoint: str | Path | None = None, objective: Name | None = None
) -> MethodSpec:
    """The method of a name, or of `file.py:function` as this module says; learned ones with a
    checkpoint as for `finlab.Allocator`, those that can choose with an objective, if there is one.
    Raises AllocationError: unknown method; DataError: a function that is none."""
    if ":" in name:
        kind = own_method(name)
        return MethodSpec(kind.name, methods.MethodChoice(kind, kind.settings_class()))
    if not methods.method_class(name).needs_networks:
        checkpoint = None
    spec = MethodSpec(name, methods.choose_method(name, checkpoint))
    return spec if objective is None else spec.with_settings(objective=objective)


def own_method(name: str) -> type[Method]:
    """The method of a function, given as `module:function` or `file.py:function`. Raises DataError:
    there is no such function, or one of its parameters is none of `KNOWN`."""
    function = own_function(name)
    try:
        wanted = inspect.signature(function).parameters
    except ValueError:
        raise DataError(f"{name}: its parameters are not known; wrap it in a function") from None
    if unknown := [p.name for p in wanted.values() if p.default is p.empty and p.name not in KNOWN]:
        raise DataError(f"{name}: expected parameters among {', '.join(KNOWN)}, got {unknown[0]!r}")
    own = {
        "name": name.rpartition("/")[2],
        "function": staticmethod(function),
        "wanted": tuple(wanted),
    }
    return type("OwnMethod", (_OwnMethod,), own)


class _OwnMethod(Method):
    """A function as a method; the rest of a method's errors are its own."""

    reads: ClassVar[frozenset[Reads]] = frozenset()
    function: ClassVar[Callable[..., Any]]
    wanted: ClassVar[tuple[str, ...]]

    def solve(self, question: MethodQuestion) -> Solution:
        """See `Method`. AllocationError: the function raised, or what it gave are no commands
        within the limits."""
        known = {
            "targets": question.targets,
            "layout": self.layout,
            "sigma": self.scale,
            "previous": question.previous,
        }
        try:
            answer = self.function(**{key: known[key] for key in self.wanted if key in known})
            command = np.asarray(answer, dtype=np.float64)
        except Exception as error:  # a stranger's function may fail in any way
            words = f"{type(error).__name__}: {error}"
            raise AllocationError(
                f"{self.name}: layout {self.layout.name!r:.60}: {words:.300}"
            ) from error
        shape = (len(question.targets), self.layout.n, 3)
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


def own_function(name: str) -> Callable[..., Any]:
    """Returns the function of `module:function` or `file.py:function`. Raises DataError: there is
    none."""
    place, _, attribute = name.rpartition(":")
    try:
        if place.endswith(".py"):
            sys.path.insert(0, str(Path(place).resolve().parent))
            loaded = runpy.run_path(place).get(attribute)
        else:
            sys.path.insert(0, os.getcwd())
            loaded = getattr(import_module(place), attribute, None)
    except Exception as error:  # a stranger's file may fail in any way
        raise DataError(f"{place}: cannot be loaded: {type(error).__name__}: {error}") from None
    if not callable(loaded):
        raise DataError(f"{place}: holds no function {attribute!r}")
    function: Callable[..., Any] = loaded
    return function
