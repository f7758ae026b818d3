"""Solutions that methods hand over before they are judged, and the base of plain data."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array

ARRAYS = ("command", "wrench", "err_norm", "effort", "power")
"""What candidates have a row of each."""


class PlainData:
    """Base of frozen dataclasses with arrays. NaN equals NaN; fields with `compare=False` do not
    count."""

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(equal(getattr(self, name), getattr(other, name)) for name in self._equal_names())

    def _equal_names(self) -> list[str]:
        """What must be equal."""
        return [field.name for field in fields(self) if field.compare]  # type: ignore[arg-type]

    __hash__ = None  # type: ignore[assignment]

    @classmethod
    def of(cls, **values: Any) -> Self:
        """One of the values of all its fields, in a fifth of the constructor's time."""
        made = object.__new__(cls)
        made.__dict__.update(values)
        return made


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


@dataclass(frozen=True, eq=False)
class Candidates(PlainData):
    """Several commands for one target, best first. Lost fins hold NaN."""

    command: Array
    """Commands (K, n, 3): amplitude [rad], frequency [Hz], zero direction [rad]."""
    wrench: Array
    """Wrench (K, 6) that the method's own model expects [N, N m]."""
    err_norm: Array
    """Normalized error (K,) of that wrench."""
    effort: Array
    """Effort `J_en` (K,), the paper's energy proxy."""
    power: Array
    """Mean mechanical power (K,) [W]."""
    source: tuple[str, ...]
    """Where each one comes from, in words."""

    def __len__(self) -> int:
        return len(self.command)

    def rows(self, places: Sequence[int] | slice) -> "Candidates":
        """Some of them, by their places."""
        some = places if isinstance(places, slice) else list(places)
        arrays = {name: getattr(self, name)[some] for name in ARRAYS}
        return Candidates(**arrays, source=tuple(np.array(self.source, object)[some]))

    def split(self, count: int) -> "tuple[Candidates, ...]":
        """As many parts of equal length, in their order."""
        length = len(self.command) // count
        parts = []
        for start in range(0, len(self.command), length):
            some = slice(start, start + length)
            part = Candidates(
                command=self.command[some],
                wrench=self.wrench[some],
                err_norm=self.err_norm[some],
                effort=self.effort[some],
                power=self.power[some],
                source=self.source[some],
            )
            parts.append(part)
        return tuple(parts)

    def exact(self, within: float) -> "Candidates":
        """Those whose error is at most that, the ones of least effort first."""
        order = self.effort.argsort(kind="stable").tolist()
        return self.rows([k for k in order if self.err_norm[k] <= within])

    def beside(self, others: "Candidates") -> "Candidates":
        """These, then others."""
        both = {
            name: np.concatenate([getattr(self, name), getattr(others, name)]) for name in ARRAYS
        }
        return Candidates(**both, source=self.source + others.source)


class Solution(NamedTuple):
    """What a method answers to N targets with the n healthy fins of its layout."""

    command: Array
    """Chosen commands (N, n, 3)."""
    bound: Callable[[Array], Array] | None = None
    """Gives the power (N,) [W] that no answer can undercut which gives the wrenches of the chosen
    commands (N, n, 3); None for methods that prove none."""
    calm_power: Callable[[Array], Array] | None = None
    """Gives the part (N,) of the power [W] of the chosen commands (N, n, 3) that goes into less
    turning; None for methods that weigh no turning, and outside of ticks."""
    wrench: Array | None = None
    """Wrench (N, 6) that the method itself expects, where it has a model of its own."""
    candidates: Callable[[], Candidates] | None = None
    """Gives the refined candidates, for a single target."""
    samples: Callable[[], Candidates] | None = None
    """Gives the raw candidates before refinement, for a single target."""
    prices: Array | None = None
    """What one more unit of each axis of the wrenches costs (N, 6) [W/N, W/(N m)], where the method
    tells."""
    notes: tuple[str, ...] = ()
    """Sentences about these answers."""


def among_all(command: Array, alive: NDArray[np.bool_]) -> Array:
    """Commands (..., m, 3) of the actuators that are alive (n,) put among all n; the lost ones hold
    NaN."""
    if len(alive) == command.shape[-2]:
        return command
    full = np.full((*command.shape[:-2], len(alive), 3), np.nan)
    full[..., alive, :] = command
    return full


Rows = slice | NDArray[np.intp]
"""Places of targets."""


def joined(
    parts: Iterable[tuple[Rows, Solution]], count: int, alive: NDArray[np.bool_]
) -> Solution:
    """Returns one solution for `count` targets and all n actuators, of which some are alive (n,),
    of solutions for some targets and those that are alive."""
    command = np.full((count, len(alive), 3), np.nan)
    places = np.flatnonzero(alive)
    all_rows = True
    bounds: list[tuple[Rows, Callable[[Array], Array]]] = []
    wrench: Array | None = None
    notes: dict[str, None] = {}
    for rows, part in parts:
        all_rows = part.command.shape[-2] == len(alive)
        command[rows] = among_all(part.command, alive)
        notes |= dict.fromkeys(part.notes)
        if part.bound is not None:
            bounds.append((rows, part.bound))
        if part.wrench is not None:
            wrench = np.empty((count, 6)) if wrench is None else wrench
            wrench[rows] = part.wrench

    def bound(command: Array) -> Array:
        result = np.empty(count)
        for rows, part in bounds:
            own = command[rows]
            result[rows] = part(own if all_rows else own[:, places])
        return result

    return Solution(command, bound if bounds else None, wrench=wrench, notes=tuple(notes))
