"""The structs of the core as numpy sees them, and its constants; the loaded library says which it
has (fl_fields.h, finlab.h)."""

import re
from functools import cache
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.core import library

Record = NDArray[np.void]
"""An array of structs, whose fields are read by name."""
_FIELD = re.compile(r"(\w+) (\w+)((?:\[\d+\])*);")
"""A field as the library says it: type, name, lengths in brackets."""
_NUMPY_TYPES: dict[str, Any] = {
    "fl_real": np.float64,
    "fl_byte": np.uint8,
    "int": np.int32,
    "fl_reals": np.uintp,
    "fl_bytes": np.uintp,
    "fl_policy_at": np.uintp,
    "fl_offset_at": np.uintp,
    "fl_budget_at": np.uintp,
    "fl_question_at": np.uintp,
    "fl_work_at": np.uintp,
    "fl_row_at": np.uintp,
    "fl_coupled_at": np.uintp,
    "fl_flag_at": np.uintp,
}
"""Types of fields in numpy by those in C; addresses are whole numbers."""


@cache
def struct(name: str) -> np.dtype[np.void]:
    """Returns the dtype of a struct of the core.

    Args:
        name: such as `fl_actuator`.

    Returns:
        A dtype with the fields' names and shapes, aligned as in C.

    Raises:
        KeyError: the library knows no such struct.
    """
    text: bytes = library().fl_fields()
    for line in text.decode().splitlines():
        known, _, fields = line.partition(" ")
        if known == name:
            return _dtype(fields)
    raise KeyError(name)


def _dtype(fields: str) -> np.dtype[np.void]:
    """The dtype of a struct's fields, as the library says them: `fl_real scale[6];...`."""
    columns = []
    for c_type, name, shape in _FIELD.findall(fields):
        lengths = tuple(int(length) for length in re.findall(r"\d+", shape))
        columns.append((name, _NUMPY_TYPES[c_type], lengths))
    return np.dtype(columns, align=True)


@cache
def _constants() -> dict[str, int]:
    """All constants of the core by name."""
    core = library()
    constants = {}
    for k in count():
        name: bytes | None = core.fl_constant_name(k)
        if name is None:
            break
        constants[name.decode()] = core.fl_constant_value(k)
    return constants


@cache
def constant(name: str) -> int:
    """Returns a constant of the core.

    Args:
        name: of finlab.h, such as `FL_FIN`, or `sizeof fl_work` for the bytes of a struct.

    Raises:
        KeyError: the library knows no such constant.
    """
    return _constants()[name]


def count_of(name: str) -> int:
    """Returns how many numbers a struct has, such as `fl_actuator`, all of whose fields are
    numbers."""
    return struct(name).itemsize // np.dtype(np.float64).itemsize


def head_of(block: Array) -> Record:
    """Returns the head () of a block, a view: what is written there is in the block."""
    return block[: count_of("fl_head")].view(struct("fl_head")).reshape(())


def actuators_of(block: Array) -> Record:
    """Returns the actuators (n,) of a block, a view: what is written there is in the block."""
    begin = count_of("fl_head")
    n = int(head_of(block)["n"])
    end = begin + n * count_of("fl_actuator")
    return block[begin:end].view(struct("fl_actuator"))


def tables_begin(n: int) -> int:
    """Returns the offset at which the tables of a block of n actuators begin."""
    return count_of("fl_head") + n * count_of("fl_actuator")


def numbers_of(records: Record) -> Array:
    """Returns the numbers (N,) of structs that hold nothing else."""
    return np.ascontiguousarray(records).reshape(-1).view(np.float64)
