"""Methods as users specify them: a name, or a function of their own."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from finlab.allocation.allocator import Allocator
from finlab.allocation.methods import LEARNED, MethodChoice, checked_settings, choose_method, method_class
from finlab.errors import AllocationError
from finlab.evaluation.own_method import own_method
from finlab.layout import Layout
from finlab.physics.objective import Name

SLOW = ("ipopt",)
"""Methods that take a tenth of a second per target, each from several starts; they run on a subsample."""
QUICK = (
    *("dual", "mdn", "paper", "qp", "sqp", "paper_sqp", "px4", "ardusub"),
    *("analytic", "fixed_frequency"),
)
"""Methods that run on every target."""
NEEDS = {"ipopt": "casadi"}
"""Packages without which a method cannot run."""
PATIENCE_S = 60.0
"""Processor time [s] that a target may take where answers count and not times; starts and steps end every
method long before."""


def installed_methods(layout: Layout) -> list[str]:
    """All methods of the library that can run here and take a robot."""
    return [name for name in (*QUICK, *SLOW) if can_run(name) and method_class(name).fits(layout)]


def can_run(name: str) -> bool:
    """Whether the package that a method needs is installed."""
    return name not in NEEDS or find_spec(NEEDS[name]) is not None


@dataclass(frozen=True)
class MethodSpec:
    """A method with its settings and networks, for any robot."""

    name: str
    """As the user has written it."""
    choice: MethodChoice
    """What it is."""

    def on(self, layout: Layout) -> Allocator:
        """Its allocator for a robot."""
        return Allocator.of_choice(layout, self.choice)

    def with_settings(self, **changes: Any) -> "MethodSpec":
        """The same method with those of some settings changed that it knows."""
        kind = self.choice.kind
        known = {name: value for name, value in changes.items() if name in kind.option_names()}
        settings = checked_settings(kind, {**vars(self.choice.settings), **known})
        return replace(self, choice=replace(self.choice, settings=settings))


def load_method_specs(
    names: str | Iterable[str],
    checkpoint: str | Path | None = None,
    objective: Name | None = None,
    *,
    patient: bool = False,
) -> dict[str, MethodSpec]:
    """Methods by name, in the order of the names.

    Args:
        names: of methods, as in `load_method_spec`; as one text with commas between.
        checkpoint: as in `load_method_spec`.
        objective: as in `load_method_spec`.
        patient: whether methods that stop after a time get `PATIENCE_S` for each target, so that the same
            question has the same answer on a busy machine.

    Raises:
        AllocationError: no name, or as in `load_method_spec`.
    """
    listed = names.split(",") if isinstance(names, str) else names
    each = dict.fromkeys(name.strip() for name in listed if name.strip())
    if not each:
        raise AllocationError(f"methods: expected names with commas between (dual,paper), got {names!r}")
    found = {spec.name: spec for spec in (load_method_spec(name, checkpoint, objective) for name in each)}
    if not patient:
        return found
    return {name: method.with_settings(time_limit_s=PATIENCE_S) for name, method in found.items()}


def load_method_spec(
    name: str, checkpoint: str | Path | None = None, objective: Name | None = None
) -> MethodSpec:
    """The method of a specification.

    Args:
        name: a method, or `file.py:function`, see `own_method`.
        checkpoint: of learned methods, as for `finlab.Allocator`.
        objective: what the methods that can choose keep least; each one's default where None.

    Raises:
        AllocationError: unknown method.
        DataError: a function that is none.
    """
    if ":" in name:
        kind = own_method(name)
        return MethodSpec(kind.name, MethodChoice(kind, kind.settings_class()))
    spec = MethodSpec(name, choose_method(name, checkpoint if name in LEARNED else None))
    return spec if objective is None else spec.with_settings(objective=objective)
