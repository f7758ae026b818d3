"""Calls of the core in C for one robot: its block of numbers, a work area, a question, an answer.

The default method asks a `Core` for forces, multipliers and commands; other methods ask it for the
commands that give their forces. The structs are those of finlab/core/fl_fields.h.
"""

import ctypes
from collections.abc import Sequence
from functools import cache, cached_property
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.core import library, unlocked_library
from finlab.core.fields import Record, constant, count_of, struct
from finlab.errors import CommandError, DataError

ROWS = 32
"""Rows that are allocated at once; an answer that is kept keeps their memory, some 24 kB for eight
actuators."""


class AnswerMemory:
    """Memory into which the core writes answers to single wrenches, of a robot of n actuators: a
    row of numbers each, which is written once.

    A row is an `fl_answer_row`, then commands, forces and the commands of the tick before. Its
    numbers are read when they are asked for, through views of the memory: a control loop reads the
    command alone.
    """

    def __init__(self, n: int) -> None:
        """Allocates the rows."""
        self._n = n
        self._head_length = count_of("fl_answer_row")
        self.row_length = self._head_length + 8 * n
        """Numbers of a row."""
        numbers = np.empty((ROWS, self.row_length))
        self.address = numbers.ctypes.data
        """Of the rows, for the core."""
        self._stride = numbers.strides[0]
        # Nobody but the core writes, which has the address; views of the rows are read-only, too.
        numbers.setflags(write=False)
        self._numbers = numbers
        self.command = self._part(0, 3)
        """(ROWS, n, 3), NaN of lost actuators."""

    def address_of(self, row: int) -> int:
        """Returns the address of a row."""
        return self.address + self._stride * row

    def _part(self, begin: int, width: int) -> Array:
        """Arrays (ROWS, n, width) behind the heads of the rows, where `begin` numbers of each
        actuator stand before them."""
        first = self._head_length + begin * self._n
        return self._numbers[:, first : first + width * self._n].reshape(ROWS, self._n, width)

    @cached_property
    def head(self) -> Record:
        """All that is neither command nor force (ROWS,)."""
        heads = self._numbers[:, : self._head_length]
        return heads.view(struct("fl_answer_row"))[:, 0]

    # Views of some fields, since every answer would pay for looking them up by name.

    @cached_property
    def is_tick(self) -> Array:
        """1 of rows (ROWS,) of ticks, else 0."""
        return self.head["is_tick"]

    @cached_property
    def wrench(self) -> Array:
        """(ROWS, 6) that was asked for [N, N m]."""
        return self.head["wrench"]

    @cached_property
    def multipliers(self) -> Array:
        """(ROWS, 6) [W/N, W/(N m)]."""
        return self.head["multipliers"]

    @cached_property
    def force(self) -> Array:
        """(ROWS, n, 2) [N]."""
        return self._part(3, 2)

    @cached_property
    def previous(self) -> Array:
        """Commands (ROWS, n, 3) of the ticks before, in rows of ticks."""
        return self._part(5, 3)


class AnswerRows:
    """Rows for one answer after the other: memory is allocated anew when it is full."""

    def __init__(self, n: int) -> None:
        """Allocates rows for a robot of n actuators."""
        self._n = n
        self._memory = AnswerMemory(n)
        self._used = 0
        """Rows of the memory that hold answers."""
        self._unfinished = constant("FL_UNFINISHED")
        self._beyond_reach = constant("FL_BEYOND_REACH")

    def next(self) -> tuple[AnswerMemory, int]:
        """Returns a memory, and the index of a row of it that is free."""
        row = self._used
        if row == ROWS:
            self._memory = AnswerMemory(self._n)
            row = 0
        self._used = row + 1
        return self._memory, row

    def written(self, memory: AnswerMemory, row: int, code: int) -> "AnswerRow":
        """Returns the answer in a row.

        Args:
            memory: of the row.
            row: its index.
            code: what the core has returned with it.

        Raises:
            CommandError: the core could not work with the numbers of the question.
        """
        command = memory.command[row]
        if code == 0:
            return AnswerRow(memory, row, True, True, command)
        is_best_beyond_reach = code == self._beyond_reach
        if not is_best_beyond_reach and code != self._unfinished:
            raise_refusal(code)
        return AnswerRow(memory, row, False, is_best_beyond_reach, command)


class AnswerRow(NamedTuple):
    """One answer of the core, in a row of memory. What each number is, `CoreAnswer` says.

    C makes these tuples, too (finlab/core/src/prepared_call.c): its fields have this order there.
    """

    memory: AnswerMemory
    """Of the row."""
    row: int
    """Its index."""
    is_met: bool
    """Whether the wrench is within reach, and the commands are exact."""
    is_finished: bool
    """Whether it is met, or no step by the laws themselves can better it."""
    command: Array
    """Command (n, 3), read-only; NaN of lost actuators where it is finished."""

    @property
    def wrench(self) -> Array:
        """Wrench (6,) that was asked for [N, N m], read-only."""
        wrench: Array = self.memory.wrench[self.row]
        return wrench

    @property
    def previous(self) -> Array | None:
        """Command (n, 3) of the tick before, read-only; None outside of ticks."""
        return self.memory.previous[self.row] if self.memory.is_tick.item(self.row) else None

    @property
    def multipliers(self) -> Array:
        """(1, 6) [W/N, W/(N m)], read-only."""
        return self.memory.multipliers[self.row : self.row + 1]

    @property
    def wrench_served(self) -> Array:
        """Wrench (1, 6) [N, N m] that the forces give, read-only."""
        return self._head["wrench_served"]

    @property
    def gap_power_bound(self) -> Array:
        """Power (1,) [W] that gaps are proved to need, read-only."""
        return self._head["gap_power_bound"]

    def copied(self) -> "CoreAnswer":
        """Returns the answer with N = 1, in arrays of its own."""
        head = self._head
        return CoreAnswer(
            force=self.memory.force[self.row][None].copy(),
            multipliers=self.multipliers.copy(),
            wrench_served=head["wrench_served"].copy(),
            gap_power_bound=head["gap_power_bound"].copy(),
            is_attainable=head["is_attainable"] != 0.0,
            command=self.command[None].copy(),
            error=head["error"].copy(),
            is_truncated=bool(head["is_truncated"][0]),
        )

    @property
    def _head(self) -> Record:
        """The fields (1,) beside command and force."""
        return self.memory.head[self.row : self.row + 1]


class CoreAnswer(NamedTuple):
    """Answers of the core to N wrenches; the fields of `fl_answer` that Python reads."""

    force: Array
    """Forces y (N, n, 2) [N], along each actuator's directions; the second of a foil is its
    drag."""
    multipliers: Array
    """Multipliers (N, 6) of the wrench [W/N, W/(N m)] (Eq. 3)."""
    wrench_served: Array
    """Wrenches (N, 6) [N, N m] that the forces give: those asked for, or those that the policy
    gives in their place."""
    gap_power_bound: Array
    """Power (N,) [W] that gaps in the sets of forces are proved to need, the least dual value of
    the cuts that were left out; 0 where there is no gap."""
    is_attainable: NDArray[np.bool_]
    """Which wrenches (N,) that were asked for are within reach."""
    command: Array
    """Commands (N, n, 3) that give the forces, as near as the grids of the laws are."""
    error: Array
    """Distance (N,) of what the commands give from `wrench_served`, over the wrench scale, by the
    grids of the laws."""
    is_truncated: bool
    """Whether a search for one of them ended at its limit of steps before it was done."""


class Conjugates(NamedTuple):
    """Conjugates of the costs of n actuators at N multipliers (Eq. 4), by the core's tables; the
    fields of `fl_actuator_conjugate`."""

    price_ahead: Array
    """Price v (N, n) [W/N] along the direction of the force; 0 where an actuator pushes in
    reverse."""
    price_reverse: Array
    """Price (N, n) [W/N] along the force of an actuator that pushes in reverse; 0 of any other."""
    conjugate: Array
    """Conjugate (N, n) [W]: the largest value of a force at its price, less its power."""
    force_min: Array
    """Least force (1, n) [N] that may be given, of planes below 0 in reverse."""
    force_max: Array
    """Largest force (1, n) [N] that may be given."""


class Conditions(NamedTuple):
    """What holds of a robot of n actuators while it is asked, beside what is asked."""

    previous: Array | None = None
    """Commands u^- (n, 3) of the tick before, NaN where one is unknown; None outside of ticks."""
    lost: NDArray[np.bool_] | None = None
    """Which actuators (n,) do not work; None where all do."""
    free: NDArray[np.bool_] | None = None
    """Which axes (6,) may take any wrench, beside those that the robot does not command; None for
    none."""
    calm: float = 0.0
    """What turning costs in a tick, from which Eq. 16 makes the cost of an angle; see
    `DualSettings.calm`."""
    ticks: int = 1
    """How many ticks after `previous` the commands are for; the rates allow as many times
    the change."""
    angles_wanted: Array | None = None
    """Angles (n,) [rad] from which turning of pods costs, in place of those of `previous`;
    NaN of an actuator without; None for none."""
    budget: Record | None = None
    """What buses may take, of `budget_record`; None for no limit."""


NOMINAL = Conditions()
"""Outside of ticks, nothing lost, no axis free."""


class ConjugateMargins:
    """By how much the conjugates of the laws of n actuators may be above those of their tables, as
    `fl_conjugates` takes it."""

    def __init__(self, margins: Sequence[Array | None]) -> None:
        """Takes the numbers of each actuator, as finlab/core/finlab.h has them; None where the
        table's conjugate is to stay."""
        self._margins = [None if each is None else np.ascontiguousarray(each) for each in margins]
        """At which the addresses point, so that they live as long."""
        self._addresses = np.zeros(len(margins), np.uintp)
        for i, margin in enumerate(self._margins):
            if margin is not None:
                self._addresses[i] = margin.ctypes.data
        self.address = self._addresses.ctypes.data
        """Of the addresses (n,)."""
        self.are_complete = bool(self._addresses.all())
        """Whether each actuator has one."""


def policy_record(
    kind: str, axis_weights: Sequence[float], groups: Sequence[NDArray[np.bool_]]
) -> Record:
    """Returns a policy as the core reads it, an `fl_policy` (1,).

    Args:
        kind: name of the policy: "closest" is FL_CLOSEST in C, and so on.
        axis_weights: weights (6,) of the axes, for `closest`.
        groups: masks (6,) of the groups of axes in order, for `priority`; of the axes that fall,
            for `falling`.
    """
    weights = np.array(axis_weights)
    record = np.zeros(1, struct("fl_policy"))
    record["kind"] = constant(f"FL_{kind.upper()}")
    record["group_count"] = len(groups)
    record["axis_weight"] = weights / weights.max()
    for index, axes in enumerate(groups):
        record["group"][:, index] = axes
    return record


def budget_record(members: NDArray[np.bool_], watts: Array) -> Record:
    """Returns power budgets as the core reads them, an `fl_budget` (1,).

    Args:
        members: which actuators (b, n) each bus feeds; an actuator has one bus at most.
        watts: the most that each may take (b,) [W].
    """
    record = np.zeros(1, struct("fl_budget"))
    buses, n = members.shape
    record["buses"] = buses
    record["watts"][:, :buses] = watts
    for bus, feeds in enumerate(members):
        record["bus_of"][0, :n][feeds] = bus + 1
    return record


class QuestionRecord:
    """One `fl_question`, the arrays that it points at, and their addresses.

    A pointer is written as the address of an array of ours, into which the values are copied, or as
    0 for none: so no array of a caller has to outlive the call.
    """

    def __init__(self, n: int) -> None:
        """Makes the question of a robot of n actuators."""
        record = np.zeros(1, struct("fl_question"))
        self._record = record
        self.address = record.ctypes.data

        # Views of the fields, since every tick would pay for looking them up by name.
        self._wrench = record["wrench"]
        self._policy_pointer = record["policy"]
        self._multipliers_pointer = record["multipliers"]
        self._previous_pointer = record["previous"]
        self._lost_pointer = record["lost"]
        self._free_pointer = record["free"]
        self._calm = record["calm"]
        self._ticks = record["ticks"]
        self._angles_wanted_pointer = record["angles_wanted"]
        self._budget_pointer = record["budget"]

        self._policy: Record | None = None
        """At which the question points, so that it lives as long."""
        self._has_multipliers = False
        """Whether the question points at multipliers."""
        self._budget: Record | None = None
        """The same of power budgets."""
        self._constant_conditions: Conditions | None = None
        """Those that are written, where they are not of a single tick: the object, which nobody
        changes."""
        self._multipliers = np.zeros(6)
        self._previous = np.zeros((n, 3))
        self._lost = np.zeros(n, np.uint8)
        self._free = np.zeros(6, np.uint8)
        self._angles_wanted = np.zeros(n)
        self._multipliers_address = self._multipliers.ctypes.data
        self._previous_address = self._previous.ctypes.data
        self._lost_address = self._lost.ctypes.data
        self._free_address = self._free.ctypes.data
        self._angles_wanted_address = self._angles_wanted.ctypes.data

    def write_wrench(self, wrench: Array) -> None:
        """Writes what is asked for, (6,) [N, N m]."""
        self._wrench[0] = wrench

    def write(
        self, policy: Record | None, multipliers: Array | None, conditions: Conditions
    ) -> None:
        """Writes all but the wrench.

        Args:
            policy: of `policy_record`, what to give out of reach; None for nothing else
                than what is asked.
            multipliers: lambda (6,) [W/N, W/(N m)] at which Newton's method begins; None for its
                own.
            conditions: what holds.
        """
        if policy is not self._policy:
            self._policy = policy
            self._policy_pointer[0] = 0 if policy is None else policy.ctypes.data
        if multipliers is not None:
            self._multipliers[:] = multipliers
            self._multipliers_pointer[0] = self._multipliers_address
        elif self._has_multipliers:
            self._multipliers_pointer[0] = 0
        self._has_multipliers = multipliers is not None
        self.write_conditions(conditions)

    def begin_at(self, multipliers: Array | None) -> None:
        """Writes where a batch begins, after `write`: lambda (N, 6) [W/N, W/(N m)], C-contiguous,
        which has to live as long as it stands here; None for Newton's own."""
        self._multipliers_pointer[0] = 0 if multipliers is None else multipliers.ctypes.data

    def write_conditions(self, conditions: Conditions) -> None:
        """Writes what holds of the robot."""
        if conditions is self._constant_conditions:
            return  # as they were written for the last question: most are, outside of ticks
        self._calm[0] = conditions.calm
        self._ticks[0] = conditions.ticks
        self._angles_wanted_pointer[0] = 0
        if conditions.angles_wanted is not None:
            self._angles_wanted[:] = conditions.angles_wanted
            self._angles_wanted_pointer[0] = self._angles_wanted_address
        self._previous_pointer[0] = 0
        if conditions.previous is not None:
            self._previous[:] = conditions.previous
            self._previous_pointer[0] = self._previous_address
        self._lost_pointer[0] = 0
        if conditions.lost is not None:
            self._lost[:] = conditions.lost
            self._lost_pointer[0] = self._lost_address
        self._free_pointer[0] = 0
        if conditions.free is not None:
            self._free[:] = conditions.free
            self._free_pointer[0] = self._free_address
        if conditions.budget is not self._budget:
            self._budget = conditions.budget
            self._budget_pointer[0] = 0 if self._budget is None else self._budget.ctypes.data
        self._constant_conditions = conditions if conditions.previous is None else None


class AnswerRecord:
    """One `fl_answer`, and its address."""

    def __init__(self, n: int) -> None:
        """Makes the answer of a robot of n actuators."""
        record = np.zeros(1, struct("fl_answer"))
        self._record = record
        self.address = record.ctypes.data
        self._force = record["force"][:, :n]
        self._multipliers = record["multipliers"]
        self._wrench_served = record["wrench_served"]
        self._gap_power_bound = record["gap_power_bound"]
        self._error = record["error"]
        self._command = record["command"][:, :n]
        self._is_attainable = record["is_attainable"]
        self._is_truncated = record["is_truncated"]

    def read(self) -> CoreAnswer:
        """Returns a copy of what the core has written."""
        return CoreAnswer(
            force=self._force.copy(),
            multipliers=self._multipliers.copy(),
            wrench_served=self._wrench_served.copy(),
            gap_power_bound=self._gap_power_bound.copy(),
            is_attainable=self._is_attainable.astype(bool),
            command=self._command.copy(),
            error=self._error.copy(),
            is_truncated=bool(self._is_truncated[0]),
        )


def prepared_work(block: Array) -> ctypes.Array[ctypes.c_char]:
    """Returns a work area `fl_work` that is prepared for a robot.

    Args:
        block: the robot's numbers; see finlab/core/fl_fields.h.

    Raises:
        DataError: the numbers are out of the range that the core works with.
    """
    core = library()
    work = ctypes.create_string_buffer(constant("sizeof fl_work"))
    code = core.fl_check(block.ctypes.data, len(block))
    if not code:
        code = core.fl_prepare(block.ctypes.data, ctypes.addressof(work))
    if code:
        raise DataError(f"the core refuses the robot: {error_text(code)}")
    return work


@cache
def widest_lanes() -> int:
    """Returns how many wrenches of a batch this machine answers at once, in lanes of vectors."""
    return int(library().fl_widest_lanes())


class DualPoints(NamedTuple):
    """The dual of N wrenches at N multipliers."""

    multipliers: Array
    """lambda (N, 6) [W/N, W/(N m)]."""
    steps: NDArray[np.int32]
    """How many steps of Newton's method were taken (N,)."""
    residual: Array
    """What the responses leave of the wrenches (N, 6) [N, N m] (Eq. 6)."""
    dual_value: Array
    """g (N,) [W] (Eq. 3)."""
    force: Array
    """Responses (N, n, 2) [N] (Eq. 5)."""
    slope: Array
    """Their derivatives by the prices (N, n, 3) [N^2/W]: xx, xy, yy."""


class WorkArea:
    """What one thread needs to ask the core about a robot: a prepared `fl_work`, and a question."""

    def __init__(self, block: Array, n: int) -> None:
        """Prepares it for the block of a robot of n actuators.

        Raises:
            DataError: the numbers of the block are out of the range that the core works with.
        """
        self._work = prepared_work(block)
        self.address = ctypes.addressof(self._work)
        self.question = QuestionRecord(n)


class Core:
    """One robot in the core. Threads may share it: of single questions one is answered after the
    other, batches at the same time."""

    def __init__(self, block: Array, n: int) -> None:
        """Takes the block of a robot.

        Args:
            block: its numbers; see finlab/core/fl_fields.h.
            n: how many actuators it has.

        Raises:
            DataError: its numbers are out of the range that the core works with.
        """
        self._core = library()
        self._unlocked_core = unlocked_library()
        self._lanes = widest_lanes()
        self._block = block
        self.n = n
        """How many actuators there are."""
        self._work = prepared_work(block)
        self._lock = Lock()
        """Held during a call: work area, question and answer are the same for all threads."""
        self._block_address = block.ctypes.data
        self._work_address = ctypes.addressof(self._work)
        self._answer_into_row = self._core.fl_answer_into_row
        self._question = QuestionRecord(n)
        self._rows = AnswerRows(n)
        self._laws: PowerFormulas | None = None
        """To which the work area points, so that they live as long."""
        self._is_busy = np.zeros(1, np.int32)
        """Not 0 while a batch is answered in the work area, without the interpreter's lock."""
        self._spare_areas: list[WorkArea] = []
        """Work areas of batches that were answered at the same time, which nobody uses now."""

    def answer_row(
        self,
        wrench: Array,
        policy: Record | None,
        multipliers: Array | None,
        conditions: Conditions,
        most_error: float,
    ) -> AnswerRow:
        """Answers one wrench, as `answer_one` does; what it found is read when it is asked for.

        Args:
            wrench: as in `answer_one`, as are all but the last.
            policy: what to give out of reach.
            multipliers: lambda (6,) at which Newton's method begins.
            conditions: what holds of the robot.
            most_error: error up to which commands are exact [1].

        Returns:
            The answer.

        Raises:
            CommandError: the core cannot work with these numbers.
        """
        with self._lock:
            memory, row = self._rows.next()
            question = self._question
            question.write_wrench(wrench)
            question.write(policy, multipliers, conditions)
            code = self._answer_into_row(
                self._block_address,
                self._work_address,
                question.address,
                most_error,
                memory.address_of(row),
            )
        return self._rows.written(memory, row, code)

    def use_laws(self, laws: "PowerFormulas") -> None:
        """Has single questions keep power budgets by the actuators' own laws from now on.

        Args:
            laws: of the actuators.
        """
        with self._lock:
            self._core.fl_use_laws(self._work_address, *laws.addresses)
            self._laws = laws

    def prepare_again(self) -> None:
        """Prepares the work area for numbers that were changed in the block.

        Raises:
            DataError: they are out of the range that the core works with.
        """
        with self._lock:
            code = self._core.fl_prepare(self._block_address, self._work_address)
        if code:
            raise DataError(f"the core refuses the robot: {error_text(code)}")

    def prepared_call(self) -> Record:
        """Returns an `fl_prepared_call` (1,) of this robot, without question and rows."""
        record = np.zeros(1, struct("fl_prepared_call"))
        record["block"] = self._block_address
        record["work"] = self._work_address
        record["is_busy"] = self._is_busy.ctypes.data
        return record

    def answer_one(
        self,
        wrench: Array,
        policy: Record | None,
        multipliers: Array | None = None,
        conditions: Conditions = NOMINAL,
    ) -> CoreAnswer:
        """Answers one wrench.

        Args:
            wrench: desired (6,) [N, N m].
            policy: of `policy_record`, what to give out of reach; None for nothing else
                than the wrench.
            multipliers: lambda (6,) [W/N, W/(N m)] at which Newton's method begins; None for its
                own.
            conditions: what holds of the robot.

        Returns:
            An answer with N = 1.

        Raises:
            CommandError: the core cannot work with these numbers.
        """
        return self.answer_row(wrench, policy, multipliers, conditions, -1.0).copied()

    def answer_many(
        self,
        wrenches: Array,
        policy: Record | None,
        conditions: Conditions = NOMINAL,
        multipliers: Array | None = None,
    ) -> CoreAnswer:
        """Answers many wrenches in one call of C, which releases the interpreter's lock. Threads
        that ask at the same time are answered at the same time.

        Args:
            wrenches: desired (N, 6) [N, N m].
            policy: of `policy_record`, what to give out of reach; None for nothing else
                than the wrenches.
            conditions: what holds of the robot.
            multipliers: lambda (N, 6) [W/N, W/(N m)] at which Newton's method begins; None for its
                own.

        Returns:
            The same N answers as `answer_one` gives, to 1e-9.

        Raises:
            CommandError: the core cannot work with these numbers.
        """
        wrenches = np.ascontiguousarray(wrenches)
        count = len(wrenches)
        if multipliers is not None:
            multipliers = np.ascontiguousarray(multipliers, np.float64)
            if multipliers.shape != (count, 6):
                raise CommandError(
                    f"multipliers: expected an array ({count}, 6), a row for each wrench, got one "
                    f"of shape {multipliers.shape}"
                )
        answer = CoreAnswer(
            force=np.empty((count, self.n, 2)),
            multipliers=np.empty((count, 6)),
            wrench_served=np.empty((count, 6)),
            gap_power_bound=np.empty(count),
            is_attainable=np.empty(count, np.bool_),
            command=np.empty((count, self.n, 3)),
            error=np.empty(count),
            is_truncated=False,
        )
        is_truncated = np.empty(count, np.bool_)
        batch = (wrenches, policy, conditions, multipliers, answer, is_truncated)
        if self._lock.acquire(blocking=False):
            try:
                self._is_busy[0] = 1
                self._answer_many(self._work_address, self._question, *batch)
            finally:
                self._is_busy[0] = 0
                self._lock.release()
        else:
            # Another thread is answered at this moment.
            area = self._spare_area()
            try:
                self._answer_many(area.address, area.question, *batch)
            finally:
                self._spare_areas.append(area)
        return answer._replace(is_truncated=bool(is_truncated.any()))

    def _spare_area(self) -> WorkArea:
        """A work area that no thread uses; whoever has asked for it puts it back."""
        try:
            return self._spare_areas.pop()
        except IndexError:
            return WorkArea(self._block, self.n)

    def _answer_many(
        self,
        work_address: int,
        question: QuestionRecord,
        wrenches: Array,
        policy: Record | None,
        conditions: Conditions,
        multipliers: Array | None,
        answer: CoreAnswer,
        is_truncated: NDArray[np.bool_],
    ) -> None:
        """Answers wrenches (N, 6) in a work area, from multipliers (N, 6) where there are some; the
        arrays of `answer`, and `is_truncated` (N,), become the answers."""
        question.write(policy, None, conditions)
        question.begin_at(multipliers)
        code = self._unlocked_core.fl_answer_many(
            self._block_address,
            work_address,
            question.address,
            self._lanes,
            wrenches.ctypes.data,
            len(wrenches),
            answer.force.ctypes.data,
            answer.multipliers.ctypes.data,
            answer.wrench_served.ctypes.data,
            answer.gap_power_bound.ctypes.data,
            answer.command.ctypes.data,
            answer.is_attainable.ctypes.data,
            answer.error.ctypes.data,
            is_truncated.ctypes.data,
        )
        question.begin_at(None)
        raise_refusal(code)

    def dual_points(
        self,
        wrenches: Array,
        multipliers: Array | None,
        most_steps: int,
        conditions: Conditions = NOMINAL,
    ) -> DualPoints:
        """Takes some steps of Newton's method from multipliers, and evaluates the dual there.

        Args:
            wrenches: desired (N, 6) [N, N m].
            multipliers: lambda (N, 6) [W/N, W/(N m)] to begin with; None for its own.
            most_steps: most steps, those included that are undone; 0 for the dual as it is.
            conditions: what holds of the robot.

        Returns:
            The dual at the multipliers that the steps come to.

        Raises:
            CommandError: the core cannot work with these numbers.
        """
        wrenches = np.ascontiguousarray(wrenches, np.float64)
        count = len(wrenches)
        begin = np.full((count, 6), np.nan)
        if multipliers is not None:
            begin[:] = multipliers
        points = DualPoints(
            multipliers=begin,
            steps=np.empty(count, np.int32),
            residual=np.empty((count, 6)),
            dual_value=np.empty(count),
            force=np.empty((count, self.n, 2)),
            slope=np.empty((count, self.n, 3)),
        )
        with self._lock:
            self._question.write(None, None, conditions)
            code = self._core.fl_dual_points(
                self._block_address,
                self._work_address,
                self._question.address,
                wrenches.ctypes.data,
                count,
                most_steps,
                *(array.ctypes.data for array in points),
            )
        raise_refusal(code)
        return points

    def commands(self, force: Array, previous: Array | None = None) -> Array:
        """Finds the commands for forces, by the grids of the laws.

        Args:
            force: (N, n, 2) [N] along each actuator's directions.
            previous: commands (n, 3) whose angles are kept where there is no force; None for 0.

        Returns:
            Commands (N, n, 3).
        """
        force = np.ascontiguousarray(force)
        command = np.empty((len(force), self.n, 3))
        previous_address = None
        if previous is not None:
            previous = np.ascontiguousarray(previous)
            previous_address = previous.ctypes.data
        with self._lock:
            self._core.fl_commands(
                self._block_address,
                self._work_address,
                force.ctypes.data,
                len(force),
                previous_address,
                command.ctypes.data,
            )
        return command

    def forces_of(self, command: Array) -> Array:
        """Evaluates the laws of the actuators, as far as the core's grids say them.

        Args:
            command: (N, n, 3).

        Returns:
            Forces (N, n, 3) [N] along the axes of the laws.
        """
        command = np.ascontiguousarray(command)
        force = np.empty(command.shape)
        self._core.fl_forces_of_commands(
            self._block_address, command.ctypes.data, len(command), force.ctypes.data
        )
        return force

    def conjugates(
        self, multipliers: Array, margins: ConjugateMargins, conditions: Conditions = NOMINAL
    ) -> Conjugates:
        """Evaluates the conjugates of all costs (Eq. 4), by the core's tables.

        Args:
            multipliers: lambda (N, 6) of the wrench [W/N, W/(N m)].
            margins: what is added for some actuators, so that theirs are upper bounds of those of
                their laws, over all that their limits allow.
            conditions: what holds of the robot, which limits the sets of forces.

        Returns:
            Conjugates of n actuators at N multipliers.

        Raises:
            CommandError: the core cannot work with these numbers.
        """
        multipliers = np.ascontiguousarray(multipliers)
        records = np.empty((len(multipliers), self.n), struct("fl_actuator_conjugate"))
        with self._lock:
            self._question.write_conditions(conditions)
            code = self._core.fl_conjugates(
                self._block_address,
                self._work_address,
                self._question.address,
                multipliers.ctypes.data,
                len(multipliers),
                margins.address,
                records.ctypes.data,
            )
        raise_refusal(code)
        return Conjugates(
            price_ahead=records["price_ahead"],
            price_reverse=records["price_reverse"],
            conjugate=records["conjugate"],
            force_min=records["force_min"][:1],
            force_max=records["force_max"][:1],
        )

    def power_bounds(
        self,
        multipliers: Array,
        wrench: Array,
        margins: ConjugateMargins,
        conditions: Conditions = NOMINAL,
    ) -> Array:
        """Proves lower bounds of the power by weak duality (Eq. 3), at given multipliers and at 0.

        Args:
            multipliers: lambda (N, 6) of the wrench [W/N, W/(N m)]; any prove a bound.
            wrench: (N, 6) [N, N m] that is given, 0 along axes that do not count.
            margins: of all actuators.
            conditions: what holds of the robot.

        Returns:
            Power (N,) [W].

        Raises:
            CommandError: the core cannot work with these numbers.
        """
        multipliers = np.ascontiguousarray(multipliers)
        wrench = np.ascontiguousarray(wrench)
        bound = np.empty(len(wrench))
        with self._lock:
            self._question.write_conditions(conditions)
            code = self._core.fl_power_bounds(
                self._block_address,
                self._work_address,
                self._question.address,
                multipliers.ctypes.data,
                wrench.ctypes.data,
                len(wrench),
                margins.address,
                bound.ctypes.data,
            )
        raise_refusal(code)
        return bound


class CommandFigures:
    """What one command of n actuators gives and takes: read-only views of what the core wrote."""

    __slots__ = ("_n", "_numbers")

    def __init__(self, n: int, numbers: Array) -> None:
        """Takes the figures (6 n + 7,) of `fl_figures_of_command`, read-only."""
        self._n = n
        self._numbers = numbers

    @property
    def own_force(self) -> Array:
        """Forces (1, n, 3) [N], own frames, 0 of lost actuators."""
        return self._numbers[: 3 * self._n].reshape(1, self._n, 3)

    @property
    def force(self) -> Array:
        """The same (n, 3) [N] in the body frame."""
        return self._numbers[3 * self._n : 6 * self._n].reshape(self._n, 3)

    @property
    def wrench(self) -> Array:
        """Wrench (6,) [N, N m], body frame."""
        return self._numbers[6 * self._n : -1]

    @property
    def power(self) -> float:
        """Power of all actuators [W]."""
        return self._numbers.item(-1)


class Formulas:
    """The laws of n actuators in the core, where all of them are formulas. Threads may share it."""

    def __init__(self, laws: Record, effectiveness: Array, frames: Array) -> None:
        """Takes the laws of a robot.

        Args:
            laws: of its actuators, an `fl_formula` (n,).
            effectiveness: wrench (n, 3, 6) of 1 N along own axes [1, m].
            frames: own axes (n, 3, 3) in the body frame, in rows.
        """
        n = len(laws)
        self._n = n
        self._laws = laws
        self._effectiveness = np.ascontiguousarray(effectiveness)
        self._frames = np.ascontiguousarray(frames)
        self._command = np.empty((n, 3))
        self._figures = np.empty(6 * n + 7)
        arrays = (self._effectiveness, self._frames, self._command, self._figures)
        self._addresses = [array.ctypes.data for array in arrays]
        self.laws_address = laws.ctypes.data
        """Of the laws, for the core."""
        self.effectiveness_address = self._effectiveness.ctypes.data
        """Of the effectiveness, for the core."""
        self._figures_of_command = library().fl_figures_of_command
        self._lock = Lock()
        """Held during a call: command and figures are the same for all threads."""

    def __reduce__(self) -> tuple[object, ...]:
        """Copies are prepared anew: what is prepared are addresses."""
        return type(self), (self._laws, self._effectiveness, self._frames)

    def figures(self, command: Array) -> CommandFigures | None:
        """Evaluates a command.

        Args:
            command: (n, 3), NaN of lost actuators.

        Returns:
            Its figures, whose arrays are read-only; None where it is no command of the robot.
        """
        n = self._n
        if command.shape != (n, 3):
            return None
        with self._lock:
            self._command[:] = command
            code = self._figures_of_command(self.laws_address, n, *self._addresses)
            numbers = self._figures.copy()
        if code:
            return None
        numbers.setflags(write=False)
        return CommandFigures(n, numbers)


class PowerFormulas:
    """The powers of n actuators, as the core evaluates them to keep budgets."""

    def __init__(self, laws: Record, curves: Sequence[Array | None]) -> None:
        """Takes the laws of a robot.

        Args:
            laws: of its actuators, an `fl_formula` (n,).
            curves: of each whose power was measured its curve, see `fl_use_laws` in `finlab.h`;
                None of the others.
        """
        self._laws = laws
        self._curves = curves
        addresses = [0 if curve is None else curve.ctypes.data for curve in curves]
        self._curve_addresses = np.array(addresses, np.uintp)

    def __reduce__(self) -> tuple[object, ...]:
        """Copies are prepared anew: what is prepared are addresses."""
        return type(self), (self._laws, self._curves)

    @property
    def addresses(self) -> tuple[int, int]:
        """Of the laws and of the curves, for `fl_use_laws`."""
        return self._laws.ctypes.data, self._curve_addresses.ctypes.data


def error_text(code: int) -> str:
    """Returns what a code that the core has returned means, and what to do."""
    text: bytes = library().fl_error_text(code)
    return text.decode()


def raise_refusal(code: int) -> None:
    """Raises a `CommandError` at a code other than FL_OK of a question."""
    if code:
        raise CommandError(
            f"the core cannot work with these numbers: {error_text(code)}; check the wrench and "
            "the previous command"
        )
