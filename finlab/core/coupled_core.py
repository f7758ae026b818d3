"""Calls of the core for a robot whose actuators act on each other: outer iterations on the model
that is made linear at the last forces.

`finlab/allocation/dual/outer_iterations.py` asks a `CoupledCore`; the iterations themselves are in
finlab/core/src/outer_iterations.c.
"""

import ctypes
import math
from collections.abc import Callable
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.core import library
from finlab.core.calls import (
    NOMINAL,
    AnswerRecord,
    AnswerRow,
    AnswerRows,
    Conditions,
    CoreAnswer,
    QuestionRecord,
    prepared_work,
    raise_refusal,
)
from finlab.core.fields import Record, struct

_OFFSET_CALLBACK = ctypes.CFUNCTYPE(
    None,
    ctypes.c_void_p,  # constants of a formula in C; unused here
    ctypes.c_void_p,  # force (count, n, 3)
    ctypes.c_int,  # count, how many questions
    ctypes.c_void_p,  # inflow (count, n, 3), or 0
    ctypes.c_void_p,  # change (count, n, 3) of each actuator's force; not written here
    ctypes.c_void_p,  # becomes the offset (count, 6)
    ctypes.c_void_p,  # becomes its derivatives (count, n, 3, 6)
)
"""The function by which C asks Python for a wrench offset: `fl_offset_at` of finlab/core/finlab.h.
Outer iterations ask with a count of 1, and read no change of single forces."""


class WrenchOffset(NamedTuple):
    """The wrench o(y) that n actuators cause beside their own forces y, since they act on each
    other (Eq. 18)."""

    frames: Array
    """Axes (n, 3, 3) of the laws' forces in the body frame, in rows."""
    counts: NDArray[np.bool_]
    """Axes (6,) of the wrench that count."""
    inflow: Array | None
    """Velocities (n, 3) [m/s] of the actuators' positions through the water, body frame; None at
    rest."""
    core_constants: Array | None
    """What `core_function` works with; None where `effect` is asked."""
    effect: Callable[[Array, Array | None], tuple[Array, Array]]
    """For forces (n, 3) [N], body frame, and `inflow`: the offset (6,) [N, N m], and its
    derivatives (n, 3, 6) by the forces."""
    offset: Callable[[Array, Array | None], Array] | None = None
    """The same without derivatives; None where `effect` gives both."""
    starts: Array | None = None
    """Where iterations begin anew (K, n, 2): real and imaginary parts of factors, by which the
    forces by the laws alone are multiplied as complex numbers. None for nowhere."""
    core_function: str = "fl_jets"
    """Name of the core's function that gives the offset, where there are `core_constants`."""


class OuterResult(NamedTuple):
    """What outer iterations end with."""

    answer: CoreAnswer | None
    """The dual's last answer by which the command got better, with the command; its force is that
    on the linear model. None without an iteration."""
    force: Array
    """Forces (n, 2) [N] that the iterations come to."""
    power: float
    """Of these forces [W]."""
    penalty: float
    """What an error as large as the wrench scale counted last [W], beside the power."""
    error: float
    """Distance of the wrench from the target, over the wrench scale, by the grids of the laws."""
    steps: float
    """Steps of Newton's method and on commands that the iterations took."""


class CoupledCore:
    """One robot in the core, with the wrench offset of its forces. Threads may share it: one call
    after the other is made.

    It is no `Core`, whose calls leave the offset out.
    """

    def __init__(self, block: Array, wrench_offset: WrenchOffset) -> None:
        """Takes a robot.

        Args:
            block: of the robot by its laws alone; the core changes a copy of it.
            wrench_offset: what its actuators do to each other.
        """
        n = len(wrench_offset.frames)
        self._core = library()
        self.n = n
        """How many actuators there are."""
        self._block_linear = block.copy()
        """The block of the linear model, which the core changes in each iteration."""
        self._work = prepared_work(self._block_linear)
        self._lock = Lock()
        """Held while outer iterations run: what they read and write is the same for all threads."""
        self._question = QuestionRecord(n)
        self._answer = AnswerRecord(n)
        self._wrench_offset = wrench_offset
        self._raised: BaseException | None = None
        """Raised by the callback, to be raised again when C returns."""
        callback: Any = getattr(library(), wrench_offset.core_function)
        if wrench_offset.core_constants is None:
            callback = _OFFSET_CALLBACK(self._effect)
        frames = np.ascontiguousarray(wrench_offset.frames)
        starts = np.zeros((0, n, 2))
        if wrench_offset.starts is not None:
            starts = np.ascontiguousarray(wrench_offset.starts)
        self._pointed_at = (
            wrench_offset.core_constants,
            wrench_offset.inflow,
            block,
            frames,
            starts,
            callback,
        )
        """What the struct points at, which has to live as long."""
        robot = np.zeros(1, struct("fl_coupled_robot"))
        robot["offset"] = ctypes.cast(callback, ctypes.c_void_p).value
        robot["constants"] = _address_of(wrench_offset.core_constants)
        robot["inflow"] = _address_of(wrench_offset.inflow)
        robot["block_uncoupled"] = _address_of(block)
        robot["frames"] = _address_of(frames)
        robot["axis_counts"] = wrench_offset.counts
        robot["starts"] = _address_of(starts)
        robot["start_count"] = len(starts)
        self.line_jets = np.zeros(self._core.fl_line_jets_length(robot.ctypes.data))
        """Jets of a robot of thrusters as the core has prepared them; empty of other robots."""
        if len(self.line_jets):
            self._core.fl_prepare_line_jets(robot.ctypes.data, self.line_jets.ctypes.data)
            robot["line_jets"] = self.line_jets.ctypes.data
        self._robot: Record = robot
        self._limits: Record = np.zeros(1, struct("fl_outer_limits"))
        """When the iterations end."""
        self._result: Record = np.zeros(1, struct("fl_outer_result"))
        """What they end with."""
        self._robot_address = robot.ctypes.data
        self._block_address = self._block_linear.ctypes.data
        self._block_uncoupled_address = _address_of(block)
        self._is_busy = np.zeros(1, np.int32)
        """Not 0 while the work area is in use without the interpreter's lock, which is never."""
        self._work_address = ctypes.addressof(self._work)
        self._rows = AnswerRows(n)
        self._force = np.zeros((n, 2))
        """Forces [N] at which the iterations begin, and then those at which they end."""

    def iterate(
        self,
        wrench: Array,
        force: Array | None,
        most_iterations: int,
        policy: Record | None = None,
        multipliers: Array | None = None,
        conditions: Conditions = NOMINAL,
        penalty_least: float = 0.0,
        most_steps: float = math.inf,
    ) -> OuterResult:
        """Runs outer iterations for one wrench.

        Args:
            wrench: desired (6,) [N, N m].
            force: (n, 2) [N] at which the iterations begin; None in a tick, where they begin at
                the command before.
            most_iterations: how many outer iterations; 0 for the nearest forces that give the
                wrench.
            policy: of `policy_record`, what to give out of reach; None for nothing else
                than the wrench.
            multipliers: lambda (6,) [W/N, W/(N m)] at which the first iteration begins.
            conditions: what holds of the robot.
            penalty_least: what an error as large as the wrench scale counts at least [W].
            most_steps: steps after which no iteration but the first is begun.

        Returns:
            The best command with the answer of the dual by which it was found, and its forces.

        Raises:
            CommandError: the core cannot work with these numbers.
        """
        with self._lock:
            self._force[:] = 0.0 if force is None else force
            self._limits["penalty_least"] = penalty_least
            self._limits["most_steps"] = most_steps
            self._limits["most_iterations"] = most_iterations
            self._question.write_wrench(wrench)
            self._question.write(policy, multipliers, conditions)
            code = self._core.fl_outer_iterations(
                self._robot_address,
                self._block_address,
                self._work_address,
                self._question.address,
                self._limits.ctypes.data,
                self._force.ctypes.data,
                self._answer.address,
                self._result.ctypes.data,
            )
            self._raise_from_callback()
            raise_refusal(code)
            return OuterResult(
                answer=self._answer.read() if most_iterations > 0 else None,
                force=self._force.copy(),
                power=float(self._result["power"][0]),
                penalty=float(self._result["penalty"][0]),
                error=float(self._result["error"][0]),
                steps=float(self._result["steps"][0]),
            )

    def answer_row(
        self,
        wrench: Array,
        policy: Record | None,
        multipliers: Array | None,
        conditions: Conditions,
        most_error: float,
    ) -> AnswerRow:
        """Answers one wrench, as `answer_many` does; what it found is read when it is asked for.

        Args:
            wrench: desired (6,) [N, N m].
            policy: as in `answer_many`, as are the next two.
            multipliers: lambda (6,) at which the first answer begins.
            conditions: what holds of the robot.
            most_error: error up to which commands are exact, by the grids of the laws [1].

        Returns:
            The answer, finished where no steps by the laws themselves can better it.

        Raises:
            CommandError: the core cannot work with these numbers.
        """
        with self._lock:
            memory, row = self._rows.next()
            self._question.write_wrench(wrench)
            self._question.write(policy, multipliers, conditions)
            code = self._core.fl_answer_coupled_into_row(
                self._robot_address,
                self._block_address,
                self._work_address,
                self._question.address,
                most_error,
                memory.address_of(row),
            )
            self._raise_from_callback()
        return self._rows.written(memory, row, code)

    def prepared_call(self) -> Record | None:
        """Returns an `fl_prepared_call` (1,) of this robot, without question and rows; None where
        the offset is a function of Python, whose exceptions have to be raised again, and which lets
        another thread have the interpreter's lock."""
        if self._wrench_offset.core_constants is None:
            return None
        record = np.zeros(1, struct("fl_prepared_call"))
        record["block"] = self._block_uncoupled_address
        record["work"] = self._work_address
        record["coupled"] = self._robot_address
        record["block_linear"] = self._block_address
        record["is_busy"] = self._is_busy.ctypes.data
        return record

    def answer_many(
        self,
        wrenches: Array,
        policy: Record | None,
        multipliers: Array | None = None,
        conditions: Conditions = NOMINAL,
    ) -> CoreAnswer:
        """Answers wrenches by outer iterations from all starts, in a tick from the command before.

        Args:
            wrenches: desired (N, 6) [N, N m].
            policy: of `policy_record`, what to give out of reach; None for nothing else than the
                wrenches.
            multipliers: lambda (6,) [W/N, W/(N m)] at which each first answer begins; None for its
                own.
            conditions: what holds of the robot.

        Returns:
            N answers, of the dual's last answers by which the commands were found, with these
            commands. Nothing is proved of gaps.

        Raises:
            CommandError: the core cannot work with these numbers.
        """
        wrenches = np.ascontiguousarray(wrenches)
        count = len(wrenches)
        force = np.empty((count, self.n, 2))
        multipliers_found = np.empty((count, 6))
        wrench_served = np.empty((count, 6))
        command = np.empty((count, self.n, 3))
        is_attainable = np.empty(count, np.bool_)
        error = np.empty(count)
        is_truncated = np.empty(count, np.bool_)
        with self._lock:
            self._question.write(policy, multipliers, conditions)
            code = self._core.fl_answer_coupled_many(
                self._robot_address,
                self._block_address,
                self._work_address,
                self._question.address,
                wrenches.ctypes.data,
                count,
                force.ctypes.data,
                multipliers_found.ctypes.data,
                wrench_served.ctypes.data,
                command.ctypes.data,
                is_attainable.ctypes.data,
                error.ctypes.data,
                is_truncated.ctypes.data,
            )
            self._raise_from_callback()
        raise_refusal(code)
        return CoreAnswer(
            force=force,
            multipliers=multipliers_found,
            wrench_served=wrench_served,
            gap_power_bound=np.zeros(count),
            is_attainable=is_attainable,
            command=command,
            error=error,
            is_truncated=bool(is_truncated.any()),
        )

    def _raise_from_callback(self) -> None:
        """Raises what the callback has raised during the last call."""
        if self._raised is not None:
            raised = self._raised
            self._raised = None
            raise raised

    def _effect(
        self,
        _: int,
        force: int,
        count: int,
        inflow: int,
        change: int,
        wrench: int,
        slope: int | None,
    ) -> None:
        """Writes the offset and its derivatives for C; the arguments are those of the callback."""
        n = self.n
        if self._raised is not None:
            return  # the answer is lost already: C only has to come to its end
        offset_of = self._wrench_offset
        try:
            forces = _numbers_at(force, (n, 3))
            if slope is None and offset_of.offset is not None:
                _numbers_at(wrench, (6,))[:] = offset_of.offset(forces, offset_of.inflow)
                return
            offset, derivatives = offset_of.effect(forces, offset_of.inflow)
            _numbers_at(wrench, (6,))[:] = offset
            if slope is not None:
                _numbers_at(slope, (n, 3, 6))[:] = derivatives
        except BaseException as error:  # an exception cannot pass through C
            self._raised = error


def _address_of(array: Array | None) -> int:
    """The address of an array's numbers; 0 for none."""
    return 0 if array is None else array.ctypes.data


def _numbers_at(address: int, shape: tuple[int, ...]) -> Array:
    """The numbers at an address, as an array that C and Python share."""
    numbers = (ctypes.c_double * math.prod(shape)).from_address(address)
    return np.ctypeslib.as_array(numbers).reshape(shape)
