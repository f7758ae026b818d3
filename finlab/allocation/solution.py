"""Solutions that methods hand over before they are judged, and the base of plain data.

`Method.solve` returns a `Solution`; `robot_state.py` and `allocation.py` make results of it.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.core.calls import AnswerRow

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

    from finlab.allocation.question import MethodQuestion
    from finlab.core.prepared_call import Answer, RowBound

Kind = TypeVar("Kind")
"""A class."""

CANDIDATE_ARRAYS = ("command", "wrench", "err_norm", "effort", "power")
"""Fields of `Candidates` that are arrays with a row of each."""


class _UnlockedProperty(cached_property):  # type: ignore[type-arg]
    """A cached property that takes no lock, as all are from Python 3.12 on."""

    def __get__(self, instance: Any, owner: type[Any] | None = None) -> Any:
        """Computes the value; once it is cached, Python does not ask here."""
        if instance is None:
            return self
        assert self.attrname is not None
        value = self.func(instance)
        instance.__dict__[self.attrname] = value
        return value


def without_locks(kind: type[Kind]) -> type[Kind]:
    """Has the cached properties of a class take no lock: it takes longer than most of them, and two
    threads that read one at the same time find the same value."""
    if sys.version_info >= (3, 12):
        return kind
    for name, value in list(vars(kind).items()):
        if isinstance(value, cached_property):
            unlocked = _UnlockedProperty(value.func)
            unlocked.__set_name__(kind, name)
            setattr(kind, name, unlocked)
    return kind


class PlainData:
    """Base of frozen dataclasses with arrays. NaN equals NaN; fields with `compare=False` do not
    count."""

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(equal(getattr(self, name), getattr(other, name)) for name in self._equal_names())

    def _equal_names(self) -> list[str]:
        """Names of the fields and properties that must be equal."""
        return [field.name for field in fields(self) if field.compare]  # type: ignore[arg-type]

    __hash__ = None  # type: ignore[assignment]

    @classmethod
    def of(cls, **values: Any) -> "Self":
        """Makes one of the values of all its fields, by name, in a fifth of the constructor's time;
        nothing is checked."""
        made = object.__new__(cls)
        object.__setattr__(made, "__dict__", values)
        return made


def equal(a: Any, b: Any) -> bool:
    """Compares two values, of which either may be an array.

    Args:
        a: any value.
        b: any other.

    Returns:
        Whether they are equal: arrays element by element, tuples part by part, NaN to NaN.
    """
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        may_hold_nan = a.dtype.kind == b.dtype.kind == "f"
        return np.array_equal(a, b, equal_nan=may_hold_nan)
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return False
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(equal(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, float) and isinstance(b, float):
        both_nan = a != a and b != b
        return a == b or both_nan
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

    def rows(self, indices: Sequence[int] | slice) -> "Candidates":
        """Returns some of them, by their indices."""
        some = indices if isinstance(indices, slice) else list(indices)
        arrays = {name: getattr(self, name)[some] for name in CANDIDATE_ARRAYS}
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
        """Returns those whose normalized error is at most that, the ones of least effort first."""
        order = self.effort.argsort(kind="stable").tolist()
        return self.rows([k for k in order if self.err_norm[k] <= within])

    def followed_by(self, others: "Candidates") -> "Candidates":
        """Returns these, then others."""
        arrays = {}
        for name in CANDIDATE_ARRAYS:
            arrays[name] = np.concatenate([getattr(self, name), getattr(others, name)])
        return Candidates(**arrays, source=self.source + others.source)


class Solved(Protocol):
    """What a method answers to N targets with the n actuators of its layout: a `Solution`, or what
    finds the same when it is read."""

    @property
    def command(self) -> Array:
        """Chosen commands (N, n, 3)."""

    @property
    def bound(self) -> Callable[[Array, Array], Array] | None:
        """Gives the power (N,) [W] that no answer can undercut which gives the wrenches of the
        chosen commands (N, n, 3), of which the plant's forces (N, n, 3) [N] are told too, in own
        frames, 0 if lost; None for methods that prove none."""

    @property
    def calm_power(self) -> Callable[[Array], Array] | None:
        """Gives the part (N,) of the power [W] of the chosen commands (N, n, 3) that goes into less
        turning; None for methods that weigh no turning, and outside of ticks."""

    @property
    def wrench(self) -> Array | None:
        """Wrench (N, 6) that the method itself expects, where it has a model of its own."""

    @property
    def candidates(self) -> Callable[[], Candidates] | None:
        """Gives the refined candidates, for a single target."""

    @property
    def samples(self) -> Callable[[], Candidates] | None:
        """Gives the raw candidates before refinement, for a single target."""

    @property
    def multipliers(self) -> Array | None:
        """Multipliers (N, 6) [W/N, W/(N m)] of the wrenches, what one more unit of each axis costs;
        None where the method has none."""

    @property
    def notes(self) -> Callable[[], tuple[str, ...]] | None:
        """Gives sentences about these answers; None for methods that have none."""


class PreparedAnswers(NamedTuple):
    """Answers to single wrenches at rest in the water, of which a method knows all else."""

    answer: "Answer"
    """Answers a wrench."""
    solved: "Callable[[AnswerRow, MethodQuestion], Solved]"
    """Makes a solution of what that returned to a question."""
    bound: "RowBound"
    """Proves the lower bound of the power [W] of what that returned; None where the bound of the
    solution has to be asked."""


class Solution(NamedTuple):
    """A `Solved` whose parts are known, or functions."""

    command: Array
    bound: Callable[[Array, Array], Array] | None = None
    calm_power: Callable[[Array], Array] | None = None
    wrench: Array | None = None
    candidates: Callable[[], Candidates] | None = None
    samples: Callable[[], Candidates] | None = None
    multipliers: Array | None = None
    notes: Callable[[], tuple[str, ...]] | None = None

    @classmethod
    def with_command(cls, solved: Solved, command: Array) -> "Self":
        """Returns a solution with another command (N, n, 3) for the same wrenches."""
        return cls(
            command,
            solved.bound,
            solved.calm_power,
            solved.wrench,
            solved.candidates,
            solved.samples,
            solved.multipliers,
            solved.notes,
        )


def among_all(command: Array, works: NDArray[np.bool_]) -> Array:
    """Puts commands of the actuators that work among those of all.

    Args:
        command: (..., m, 3) of the m that work.
        works: which of n actuators (n,) do.

    Returns:
        (..., n, 3), NaN for the lost ones; the same array where all work.
    """
    if len(works) == command.shape[-2]:
        return command
    full = np.full((*command.shape[:-2], len(works), 3), np.nan)
    full[..., works, :] = command
    return full


def _no_notes() -> tuple[str, ...]:
    """The notes of an answer of which there is nothing to say."""
    return ()


Rows = slice | NDArray[np.intp]
"""Indices of targets."""


def written(part: Solved, command: Array) -> Solved:
    """Writes the commands of a part of the targets where they belong.

    Args:
        part: solution for N of the targets, of the actuators that work or of all n.
        command: (N, n, 3), a part of the commands for all targets; becomes those of the solution.

    Returns:
        The same solution, whose own commands need no memory any more where it is of all actuators:
        those of the next part take it, which is quicker than memory that the system has to give.
    """
    if not isinstance(part, Solution) or part.command.shape != command.shape:
        return part
    command[:] = part.command
    return part._replace(command=command)


def _is_whole(rows: Rows, part: Solved, count: int, works: NDArray[np.bool_]) -> bool:
    """Whether the solution for some rows is one for all N targets and all n actuators."""
    are_all_rows = isinstance(rows, slice) and rows == slice(0, count)
    return are_all_rows and part.command.shape[-2] == len(works)


def joined(
    parts: Sequence[tuple[Rows, Solved]],
    count: int,
    works: NDArray[np.bool_],
    memory: Array | None = None,
) -> Solution:
    """Joins solutions for parts of the targets.

    Args:
        parts: which targets each is for, and the solution, of the actuators that work or of all.
        count: N, how many targets there are.
        works: which actuators (n,) work.
        memory: commands (N, n, 3), where `written` has written those of some parts; None for new
            ones.

    Returns:
        One solution for N targets and all n actuators, with commands, bound, wrenches and notes.
    """
    if len(parts) == 1 and _is_whole(*parts[0], count, works):
        only_part = parts[0][1]
        notes_of_whole = only_part.notes or _no_notes
        return Solution(
            only_part.command, only_part.bound, wrench=only_part.wrench, notes=notes_of_whole
        )
    command = np.full((count, len(works), 3), np.nan) if memory is None else memory
    working = np.flatnonzero(works)
    parts_have_all = True
    bounds: list[tuple[Rows, Callable[[Array, Array], Array]]] = []
    wrench: Array | None = None
    notes_of_parts: list[Callable[[], tuple[str, ...]]] = []
    for rows, part in parts:
        parts_have_all = part.command.shape[-2] == len(works)
        if part.command.base is not command:
            command[rows] = among_all(part.command, works)
        if part.notes is not None:
            notes_of_parts.append(part.notes)
        if part.bound is not None:
            bounds.append((rows, part.bound))
        if part.wrench is not None:
            wrench = np.empty((count, 6)) if wrench is None else wrench
            wrench[rows] = part.wrench

    def bound(command: Array, force: Array) -> Array:
        result = np.empty(count)
        for rows, bound_of_part in bounds:
            command_of_part = command[rows]
            force_of_part = force[rows]
            if not parts_have_all:
                command_of_part = command_of_part[:, working]
                force_of_part = force_of_part[:, working]
            result[rows] = bound_of_part(command_of_part, force_of_part)
        return result

    def notes() -> tuple[str, ...]:
        sentences: dict[str, None] = {}
        for notes_of_part in notes_of_parts:
            sentences |= dict.fromkeys(notes_of_part())
        return tuple(sentences)

    return Solution(command, bound if bounds else None, wrench=wrench, notes=notes)
