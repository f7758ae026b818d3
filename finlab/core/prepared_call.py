"""Single questions to the core as a builtin function of Python, whose calls need no ctypes.

The core holds functions of Python's C API by their addresses, which ctypes gives it once; so the
library neither links to Python nor is compiled with its headers (finlab/core/src/prepared_call.c).
Where there is no such function, `Core.answer_row` answers alone.
"""

import ctypes
import sys
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from finlab.arrays import Array
from finlab.core import library
from finlab.core.calls import (
    ROWS,
    AnswerMemory,
    AnswerRow,
    Conditions,
    ConjugateMargins,
    Core,
    Formulas,
    QuestionRecord,
)
from finlab.core.fields import Record

if TYPE_CHECKING:
    from finlab.core.coupled_core import CoupledCore

Answer: TypeAlias = Callable[[object, object, Array | None], AnswerRow | None]
"""Answers a wrench, with the command (n, 3) of the tick before and multipliers (6,) to begin with,
each None for none. Returns a finished answer; None where `Core.answer_row` has to be asked: it says
what is wrong with a question, and gives answers that are not finished, too."""
RowBound: TypeAlias = Callable[[AnswerRow], float | None]
"""Finds the lower bound of the power [W] of an answer; None where it has to be found by
`Core.power_bounds`."""

_MEMORY = 2
"""Index of the memory of the rows in what C reads."""
_COMMANDS = 3
"""Index of the commands of these rows."""


class PreparedCall(NamedTuple):
    """A question of which all is known but the wrench, and what is found of its answers later."""

    answer: Answer
    """Answers as `Core.answer_row` does, in a fraction of the time around C."""
    record: Record
    """The `fl_prepared_call` (1,)."""

    def power_bounds(self, formulas: Formulas, margins: ConjugateMargins) -> RowBound:
        """Prepares lower bounds of the power of the answers, see `Core.power_bounds`.

        Args:
            formulas: laws of the actuators; their effectiveness is 0 along axes that do not count.
            margins: of all actuators.
        """
        addresses = (
            self.record.ctypes.data,
            formulas.laws_address,
            formulas.effectiveness_address,
            margins.address,
        )
        power_bound_of_row = library().fl_power_bound_of_row
        pointed_at = (self, formulas, margins)

        def power_bound(row: AnswerRow, _pointed_at: object = pointed_at) -> float | None:
            bound: float = power_bound_of_row(*addresses, row.memory.address_of(row.row))
            return None if bound < 0.0 else bound

        return power_bound


def prepared_call(
    core: "Core | CoupledCore",
    policy: Record | None,
    conditions: Conditions,
    calm: float,
    most_wrench: float,
    most_error: float,
) -> PreparedCall | None:
    """Prepares a question of which all is known but the wrench, and in a tick the command before.

    Args:
        core: the robot.
        policy: of `policy_record`, what to give out of reach.
        conditions: what holds of the robot, outside of ticks.
        calm: what turning costs in a tick.
        most_wrench: largest size of a wrench, as a vector of six numbers.
        most_error: error up to which commands are exact [1].

    Returns:
        The call; None where this interpreter has no such functions, or C asks Python for what
        actuators do to each other.
    """
    if not has_builtin_functions():
        return None
    record = core.prepared_call()
    if record is None:
        return None
    question = QuestionRecord(core.n)
    question.write(policy, None, conditions)
    record["question"] = question.address
    record["most_wrench"] = most_wrench
    record["most_error"] = most_error
    record["calm"] = calm
    rows = _Rows(record, core.n, (core, question))
    answer: Answer = _functions_of_python()(library().fl_python_method(), rows.bound, None)
    return PreparedCall(answer, record)


class _Rows:
    """The rows that C writes into, one answer after the other."""

    def __init__(self, record: Record, n: int, pointed_at: object) -> None:
        """Allocates the first ones.

        Args:
            record: an `fl_prepared_call` (1,), which C reads.
            n: how many actuators the robot has.
            pointed_at: what the record points at, which has to live as long.
        """
        self._record = record
        self._n = n
        self._pointed_at = pointed_at
        self.bound: list[object] = [record.ctypes.data, AnswerRow, None, None, self._renew]
        """What the function of C is bound to; see `fl_python_method` in finlab/core/finlab.h."""
        self._renew()

    def _renew(self) -> None:
        """Allocates rows; C calls it when all are used."""
        memory = AnswerMemory(self._n)
        record = self._record
        record["rows"] = memory.address
        record["row_numbers"] = memory.row_length
        record["row_count"] = ROWS
        record["used"] = 0
        self.bound[_MEMORY] = memory
        self.bound[_COMMANDS] = memory.command


@cache
def has_builtin_functions() -> bool:
    """Returns whether C may be called without ctypes: by CPython with its lock, which keeps two
    threads from one work area."""
    if sys.implementation.name != "cpython":
        return False
    is_locked: Callable[[], bool] | None = getattr(sys, "_is_gil_enabled", None)
    return is_locked is None or is_locked()


@cache
def _functions_of_python() -> Any:
    """Tells C of Python, and returns the function that makes builtin ones."""
    core = library()
    names: bytes = core.fl_python_names()
    addresses = []
    for name in names.decode().split():
        function = getattr(ctypes.pythonapi, name)
        addresses.append(ctypes.cast(function, ctypes.c_void_p).value)
    known = [None, True, False, float, int, list, tuple, np.ndarray]
    functions = np.array(addresses, np.uintp)
    objects = np.array([id(each) for each in known], np.uintp)  # of CPython its address
    core.fl_use_python(functions.ctypes.data, objects.ctypes.data)
    kind = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.py_object, ctypes.c_void_p)
    return kind(("PyCFunction_NewEx", ctypes.pythonapi))
