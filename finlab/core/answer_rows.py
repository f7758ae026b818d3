"""Memory into which the core writes answers to single questions, a row of numbers each.

A row is an `fl_answer_row` of fl_fields.h, then the commands and the forces. Its numbers are read
when they are asked for, through views of the memory: a control loop reads the command alone.
"""

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.core.fields import Record, count_of, struct

ROWS = 32
"""Rows that are allocated at once; an answer that is kept keeps their memory, some 14 kB for eight
actuators."""


class AnswerMemory:
    """Rows of answers of a robot of n actuators, each of which is written once."""

    def __init__(self, n: int) -> None:
        """Allocates the rows."""
        head = count_of("fl_answer_row")
        begin_of_forces = head + 3 * n
        length = begin_of_forces + 2 * n
        numbers = np.empty((ROWS, length))
        first_address = numbers.ctypes.data
        stride = numbers.strides[0]
        self.addresses = [first_address + stride * row for row in range(ROWS)]
        """Of each row, for the core."""
        # Nobody but the core writes, which has the addresses; views of the rows are read-only, too.
        numbers.setflags(write=False)
        self.head = numbers[:, :head].view(struct("fl_answer_row"))[:, 0]
        """All that is neither command nor force (ROWS,)."""
        self.command = numbers[:, head:begin_of_forces].reshape(ROWS, 1, n, 3)
        """(ROWS, 1, n, 3), NaN of lost actuators."""
        self.force = numbers[:, begin_of_forces:].reshape(ROWS, 1, n, 2)
        """(ROWS, 1, n, 2) [N]."""
        self.multipliers = self.head["multipliers"][:, None]
        """(ROWS, 1, 6) [W/N, W/(N m)]."""


class AnswerRows:
    """Rows for one answer after the other: memory is allocated anew when it is full."""

    def __init__(self, n: int) -> None:
        """Allocates rows for a robot of n actuators."""
        self._n = n
        self._memory = AnswerMemory(n)
        self._used = 0
        """Rows of the memory that hold answers."""

    def next(self) -> tuple[AnswerMemory, int]:
        """Returns a memory, and the index of a row of it that is free."""
        row = self._used
        if row == ROWS:
            self._memory = AnswerMemory(self._n)
            row = 0
        self._used = row + 1
        return self._memory, row


class AnswerRow:
    """One answer of the core. What each number is, `CoreAnswer` says."""

    __slots__ = ("_memory", "_row", "is_finished", "is_met")

    def __init__(self, memory: AnswerMemory, row: int, is_finished: bool, is_met: bool) -> None:
        """Takes a row that the core has written.

        Args:
            memory: of the row.
            row: its index.
            is_finished: whether no steps by the laws themselves can better it.
            is_met: whether it is finished, and the wrench is within reach.
        """
        self._memory = memory
        self._row = row
        self.is_finished = is_finished
        self.is_met = is_met

    @property
    def command(self) -> Array:
        """Command (1, n, 3), read-only; NaN of lost actuators."""
        command: Array = self._memory.command[self._row]
        return command

    @property
    def multipliers(self) -> Array:
        """(1, 6) [W/N, W/(N m)], read-only."""
        multipliers: Array = self._memory.multipliers[self._row]
        return multipliers

    @property
    def force(self) -> Array:
        """Forces (1, n, 2) [N] along each actuator's directions, read-only."""
        force: Array = self._memory.force[self._row]
        return force

    @property
    def wrench_served(self) -> Array:
        """Wrench (1, 6) [N, N m] that the forces give, read-only."""
        return self._head["wrench_served"]

    @property
    def gap_power_bound(self) -> Array:
        """Power (1,) [W] that gaps are proved to need, read-only."""
        return self._head["gap_power_bound"]

    @property
    def error(self) -> Array:
        """Distance (1,) of what the command gives from the wrench served, over the wrench scale,
        by the grids of the laws, read-only."""
        return self._head["error"]

    @property
    def is_attainable(self) -> NDArray[np.bool_]:
        """Whether the wrench (1,) that was asked for is within reach."""
        return np.asarray(self._head["is_attainable"] != 0.0)

    @property
    def is_truncated(self) -> bool:
        """Whether a search ended at its limit of steps before it was done."""
        return bool(self._head["is_truncated"][0])

    @property
    def _head(self) -> Record:
        """The fields (1,) beside command and force."""
        return self._memory.head[self._row : self._row + 1]
