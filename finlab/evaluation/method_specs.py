"""Methods as users specify them: a name, with a number of starts or an objective behind it: `ipopt-32`."""

import hashlib
import re
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from finlab.allocation.allocator import Allocator
from finlab.allocation.baselines.ipopt import IpoptSettings
from finlab.allocation.methods import LEARNED, load_allocator
from finlab.errors import AllocationError
from finlab.evaluation.ahead import AnalyticAhead
from finlab.evaluation.on_board import OnBoard
from finlab.inference.checkpoint import read_checkpoint, read_normalization, resolve_checkpoint
from finlab.physics.objective import Name

SLOW = ("ipopt",)
"""Methods that take a tenth of a second per target, each from several starts; they run on a subsample."""
QUICK = ("search", "mdn", "paper", "qp", "sqp", "analytic")
"""Methods that run on every target."""
OWN = (OnBoard, AnalyticAhead)
"""Methods that are for comparison alone."""
_WITH_STARTS = re.compile(r"(\w+)-(\d+)")
_WITH_OBJECTIVE = re.compile(r"(\w+)-(power|effort)")


@dataclass(frozen=True)
class Checkpoints:
    """The checkpoints under test: names of shipped ones, or folders."""

    default: str | None = None
    """Of method `mdn`, which also gives the yardstick of the others."""
    paper: str | None = None
    """Of method `paper`."""

    def of(self, method: str) -> str | None:
        """The checkpoint of a method."""
        return self.paper if method == "paper" else self.default


def is_slow(name: str) -> bool:
    """Whether a method runs on a subsample only."""
    return method_and_starts(name)[0] in SLOW


def installed_methods() -> list[str]:
    """All methods of the library that can run here."""
    return [name for name in (*QUICK, *SLOW) if name != "ipopt" or find_spec("casadi") is not None]


def load_method_specs(
    names: str, checkpoint: str | Path | None = None, objective: Name | None = None
) -> dict[str, Allocator]:
    """Allocators by name, from names with commas between; `AllocationError` where there is none."""
    each = dict.fromkeys(name.strip() for name in names.split(",") if name.strip())
    if not each:
        raise AllocationError(f"methods: expected names with commas between (search,paper), got {names!r}")
    return {name: load_method_spec(name, checkpoint, objective) for name in each}


def load_method_spec(
    name: str, checkpoint: str | Path | None = None, objective: Name | None = None
) -> Allocator:
    """The allocator of a specification, as `finlab.load_allocator` makes it.

    Args:
        name: a method; `ipopt-32`, say, for 32 starts; `search-effort`, say, for an objective of its own; or
            `on-board`, U-CAT's own method; or `analytic-ahead`, the pseudo-inverse told how late fins are.
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


def fingerprint(name: str, checkpoint: str | Path | None = None) -> str:
    """What a method's answers depend on besides its settings: the weights' SHA-256 for a learned method,
    a digest of the normalization for the others."""
    method = method_and_starts(name)[0]
    path = resolve_checkpoint(checkpoint or ("paper" if method == "paper" else "default"))
    if method in LEARNED:
        return read_checkpoint(path).sha256
    return hashlib.sha256(b"".join(values.tobytes() for values in read_normalization(path))).hexdigest()


def surrogate_fingerprint(checkpoint: str | Path) -> str:
    """Digest of a checkpoint's surrogate alone, which stays the same while the network learns on."""
    state = read_checkpoint(resolve_checkpoint(checkpoint)).surrogate
    return hashlib.sha256(b"".join(state[key].tobytes() for key in sorted(state))).hexdigest()


def method_and_starts(name: str) -> tuple[str, int | None]:
    """Method and number of starts."""
    found = _WITH_STARTS.fullmatch(name)
    return (name, None) if found is None else (found[1], int(found[2]))
