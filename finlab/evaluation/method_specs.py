"""Methods as users specify them: a name, with a number of starts or an objective behind it: `ipopt-32`."""

import re
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from finlab.allocation.allocator import Allocator
from finlab.allocation.baselines.ipopt import IpoptSettings
from finlab.allocation.methods import load_allocator
from finlab.errors import AllocationError
from finlab.evaluation.ahead import AnalyticAhead
from finlab.evaluation.on_board import OnBoard
from finlab.physics.objective import Name

SLOW = ("ipopt",)
"""Methods that take a tenth of a second per target, each from several starts; they run on a subsample."""
QUICK = ("search", "mdn", "paper", "qp", "sqp", "analytic")
"""Methods that run on every target."""
OWN = (OnBoard, AnalyticAhead)
"""Methods that are for comparison alone."""
PATIENCE_S = 60.0
"""Processor time [s] that a target may take where answers count and not times; starts and steps end every
method long before."""
_WITH_STARTS = re.compile(r"(\w+)-(\d+)")
_WITH_OBJECTIVE = re.compile(r"(\w+)-(power|effort)")


def is_slow(name: str) -> bool:
    """Whether a method runs on a subsample only."""
    return method_and_starts(name)[0] in SLOW


def installed_methods() -> list[str]:
    """All methods of the library that can run here."""
    return [name for name in (*QUICK, *SLOW) if name != "ipopt" or find_spec("casadi") is not None]


def load_method_specs(
    names: str | Iterable[str],
    checkpoint: str | Path | None = None,
    objective: Name | None = None,
    *,
    patient: bool = False,
) -> dict[str, Allocator]:
    """Allocators by name, in the order of the names.

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
        raise AllocationError(f"methods: expected names with commas between (search,paper), got {names!r}")
    found = {name: load_method_spec(name, checkpoint, objective) for name in each}
    if not patient:
        return found
    return {
        name: method.with_settings(time_limit_s=PATIENCE_S)
        if "time_limit_s" in method.option_names()
        else method
        for name, method in found.items()
    }


def load_method_spec(
    name: str, checkpoint: str | Path | None = None, objective: Name | None = None
) -> Allocator:
    """The allocator of a specification, as `finlab.load_allocator` makes it.

    Args:
        name: a method; `ipopt-32`, say, for 32 starts; `search-effort`, say, for an objective of its own; or
            `on-board`, U-CAT's own method; or `analytic-ahead`, the pseudo-inverse with the lag of the fins.
        checkpoint: as in `load_allocator`.
        objective: what the methods that can choose keep least; each one's default where None.

    Raises:
        AllocationError: unknown method, or starts or an objective for a method that has none.
    """
    if own := next((kind for kind in OWN if kind.name == name), None):
        return own(load_allocator("analytic", checkpoint=checkpoint).normalization)
    if named := _WITH_OBJECTIVE.fullmatch(name):
        return load_allocator(named[1], checkpoint=checkpoint, objective=named[2])
    method, starts = method_and_starts(name)
    options: dict[str, Any] = {}
    if starts is not None:
        if method not in SLOW or starts < 1:
            raise AllocationError(
                f"methods: a number of starts, from 1, goes with {', '.join(SLOW)} only, got {name!r}"
            )
        # Each start has the time that it has in the method's default.
        usual = IpoptSettings()
        limit = usual.time_limit_s * max(1.0, starts / usual.n_starts)
        options = {"n_starts": starts, "time_limit_s": limit}
    allocator = load_allocator(method, checkpoint=checkpoint, **options)
    chooses = objective is not None and "objective" in allocator.option_names()
    return allocator.with_settings(objective=objective) if chooses else allocator


def method_and_starts(name: str) -> tuple[str, int | None]:
    """Method and number of starts."""
    found = _WITH_STARTS.fullmatch(name)
    return (name, None) if found is None else (found[1], int(found[2]))
