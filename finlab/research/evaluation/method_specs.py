"""Methods as users specify them: a name, or a Python function of their own, wherever an experiment
takes one.

The function is handed what its parameters ask for by name: `targets` (N, 6) [N, N m] in the body
frame, `layout` (a `finlab.Layout`), `scale` (6,) [N, N m], what the allocator divides errors by,
and `previous`, the command (n, 3) of the tick before or None. It returns commands (N, n, 3), as
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
from finlab.allocation.method import Method, Reads
from finlab.allocation.question import MethodQuestion
from finlab.allocation.solution import Solution
from finlab.errors import AllocationError, DataError
from finlab.layout import Layout
from finlab.physics.objective import Name

SLOW = ("ipopt",)
"""Methods that take a tenth of a second per target, each from several starts; they run on a
subsample."""
PACKAGE_OF_METHOD = {"ipopt": "casadi"}
"""Method -> the package without which it cannot run."""
PATIENCE_S = 60.0
"""Processor time [s] that a target may take where answers count and not times; starts and steps end
every method long before."""
FUNCTION_PARAMETERS = ("targets", "layout", "scale", "previous")
"""Parameters that a user's function may ask for."""
LIMIT_TOLERANCE = 1e-6
"""By how much a command may leave its limits, as a share of what they span and of one of its
unit."""


def installed_methods(layout: Layout) -> list[str]:
    """Returns the names of all methods of the library that can run here and take a robot."""
    names = []
    for name in methods.METHODS:
        if can_run(name) and methods.method_class(name).fits(layout):
            names.append(name)
    return names


def can_run(name: str) -> bool:
    """Returns whether the package that a method needs is installed."""
    return name not in PACKAGE_OF_METHOD or find_spec(PACKAGE_OF_METHOD[name]) is not None


@dataclass(frozen=True)
class MethodSpec:
    """A method, as the user has written it, with its settings and networks, for any robot."""

    name: str
    """As the user has written it."""
    choice: methods.MethodChoice
    """Its class, settings and networks."""

    def on(self, layout: Layout) -> Allocator:
        """Returns the allocator of the method for a robot.

        Raises:
            AllocationError: the method does not take it.
        """
        return Allocator.of_choice(layout, self.choice)

    def with_settings(self, **changes: Any) -> "MethodSpec":
        """Returns the same method with other settings.

        Args:
            changes: new values by setting; those that the method does not know are dropped.

        Raises:
            AllocationError: a value that a setting may not have.
        """
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
    """Returns methods by name, in the order of the names.

    Args:
        names: as for `load_method_spec`; a name that stands twice counts once.
        checkpoint: as for `load_method_spec`.
        objective: as for `load_method_spec`.
        patient: whether methods that stop after a time get `PATIENCE_S` for each target, so that
            the same question has the same answer on a busy machine.

    Raises:
        AllocationError: as for `load_method_spec`.
        DataError: as for `load_method_spec`.
    """
    specs = [load_method_spec(name, checkpoint, objective) for name in dict.fromkeys(names)]
    if patient:
        specs = [spec.with_settings(time_limit_s=PATIENCE_S) for spec in specs]
    return {spec.name: spec for spec in specs}


def load_method_spec(
    name: str, checkpoint: str | Path | None = None, objective: Name | None = None
) -> MethodSpec:
    """Returns the method of a name.

    Args:
        name: a method of the library, or `file.py:function` or `module:function` of a user.
        checkpoint: of learned methods, as for `finlab.Allocator`; others have none.
        objective: of methods that can choose; None for their default.

    Raises:
        AllocationError: there is no such method.
        DataError: there is no such function, or it has other parameters.
    """
    if ":" in name:
        kind = own_method(name)
        return MethodSpec(kind.name, methods.MethodChoice(kind, kind.settings_class()))
    if not methods.method_class(name).needs_networks:
        checkpoint = None
    spec = MethodSpec(name, methods.choose_method(name, checkpoint))
    return spec if objective is None else spec.with_settings(objective=objective)


def own_method(name: str) -> type[Method]:
    """Returns the method of a user's function.

    Args:
        name: `module:function` or `file.py:function`.

    Raises:
        DataError: there is no such function, or one of its parameters is none of
            `FUNCTION_PARAMETERS`.
    """
    function = own_function(name)
    try:
        parameters = inspect.signature(function).parameters
    except ValueError:
        raise DataError(f"{name}: its parameters are not known; wrap it in a function") from None
    for parameter in parameters.values():
        is_required = parameter.default is parameter.empty
        if is_required and parameter.name not in FUNCTION_PARAMETERS:
            raise DataError(
                f"{name}: expected parameters among {', '.join(FUNCTION_PARAMETERS)}, got "
                f"{parameter.name!r}"
            )
    attributes = {
        "name": name.rpartition("/")[2],
        "function": staticmethod(function),
        "parameters": tuple(parameters),
    }
    return type("FunctionMethod", (_FunctionMethod,), attributes)


class _FunctionMethod(Method):
    """A user's function as a method; `own_method` makes a class of it for each function."""

    reads: ClassVar[frozenset[Reads]] = frozenset()
    function: ClassVar[Callable[..., Any]]
    """The user's function, from targets to commands."""
    parameters: ClassVar[tuple[str, ...]]
    """Names of its parameters."""

    def solve(self, question: MethodQuestion) -> Solution:
        """Calls the function.

        Raises:
            AllocationError: the function raised, or what it returned are no commands within the
                limits.
        """
        arguments = {
            "targets": question.targets,
            "layout": self.layout,
            "scale": self.scale,
            "previous": question.previous,
        }
        try:
            wanted = {key: value for key, value in arguments.items() if key in self.parameters}
            command = np.asarray(self.function(**wanted), dtype=np.float64)
        except Exception as error:  # a stranger's function may fail in any way
            problem = f"{type(error).__name__}: {error}"
            raise AllocationError(
                f"{self.name}: layout {self.layout.name!r:.60}: {problem:.300}"
            ) from error
        shape = (len(question.targets), self.layout.n, 3)
        if command.shape != shape or not np.isfinite(command).all():
            raise AllocationError(
                f"{self.name}: expected finite commands of shape {shape}, got shape {command.shape}"
            )
        feasible = self.plant.feasible(command)
        excess = np.abs(command - feasible)
        # An angle without limits may be given with any number of turns.
        excess[..., 2] = np.where(self.plant.full_turn, 0.0, excess[..., 2])
        if (excess > LIMIT_TOLERANCE * np.maximum(self.plant.width, 1.0)).any():
            actuator = self.layout.names[int(excess.max(axis=(0, 2)).argmax())]
            raise AllocationError(
                f"{self.name}: a command of {actuator!r:.60} is {excess.max():.3g} out of its "
                "limits"
            )
        return Solution(feasible)


def own_function(name: str) -> Callable[..., Any]:
    """Returns a user's function.

    Args:
        name: `module:function` or `file.py:function`; modules are looked up in the current folder,
            too.

    Raises:
        DataError: the file or module cannot be loaded, or has no such function.
    """
    module, _, attribute = name.rpartition(":")
    try:
        if module.endswith(".py"):
            sys.path.insert(0, str(Path(module).resolve().parent))
            loaded = runpy.run_path(module).get(attribute)
        else:
            sys.path.insert(0, os.getcwd())
            loaded = getattr(import_module(module), attribute, None)
    except Exception as error:  # a stranger's file may fail in any way
        raise DataError(f"{module}: cannot be loaded: {type(error).__name__}: {error}") from None
    if not callable(loaded):
        raise DataError(f"{module}: holds no function {attribute!r}")
    function: Callable[..., Any] = loaded
    return function
