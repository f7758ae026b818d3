"""Calls of the core for a robot whose actuators act on each other: outer iterations on the model
that is made linear at the last forces.

`finlab/allocation/dual/outer_iterations.py` asks a `CoupledCore`; the iterations themselves are in
finlab/core/src/sequential_convex.c.
"""

import ctypes
import math
from collections.abc import Callable
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.core.calls import NOMINAL, Conditions, Core, CoreAnswer, PolicyFields
from finlab.core.fields import Record, struct
from finlab.core.library import library

_OFFSET_CALLBACK = ctypes.CFUNCTYPE(
    None,
    ctypes.c_void_p,  # numbers of the formula of jets; unused
    ctypes.c_void_p,  # forces (n, 3)
    ctypes.c_int,  # n
    ctypes.c_void_p,  # inflow (n, 3), or 0
    ctypes.c_void_p,  # numbers that the formula works with; unused
    ctypes.c_void_p,  # becomes the offset (6,)
    ctypes.c_void_p,  # becomes its derivatives (n, 3, 6)
)
"""The function by which C asks Python for a wrench offset."""


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
    jets: Array | None
    """Numbers for the core's own formula of jets; None where `effect` is asked."""
    effect: Callable[[Array, Array | None], tuple[Array, Array]]
    """For forces (n, 3) [N], body frame, and `inflow`: the offset (6,) [N, N m], and its
    derivatives (n, 3, 6) by the forces."""


class OuterResult(NamedTuple):
    """What outer iterations end with."""

    answer: CoreAnswer
    """The dual's last answer by which the command got better, with the command; its force is that
    of the command."""
    power: float
    """Of the command [W]."""
    error_price: float
    """What an error as large as the wrench scale counts [W], beside the power."""
    error: float
    """Distance of the wrench from the target, over the wrench scale, by the grids of the laws."""
    steps: float
    """Steps of Newton's method and on commands that the iterations took."""


class CoupledCore(Core):
    """One robot in the core, with the wrench offset of its forces."""

    def __init__(self, block: Array, wrench_offset: WrenchOffset) -> None:
        """Takes a robot.

        Args:
            block: of the robot by its laws alone; the core changes a copy of it.
            wrench_offset: what its actuators do to each other.
        """
        super().__init__(block.copy(), len(wrench_offset.frames))
        self._wrench_offset = wrench_offset
        self._iterations_lock = Lock()
        """Held while outer iterations run: their beginning and end are the same for all threads."""
        self._raised: BaseException | None = None
        """Raised by the callback, for `_call` to raise again."""
        callback: Any = library().fl_jets
        if wrench_offset.jets is None:
            callback = _OFFSET_CALLBACK(self._effect)
        frames = np.ascontiguousarray(wrench_offset.frames)
        self._pointed_at = (wrench_offset.jets, wrench_offset.inflow, block, frames, callback)
        """What the struct points at, which has to live as long."""
        robot = np.zeros(1, struct("fl_coupled_robot"))
        robot["offset"] = ctypes.cast(callback, ctypes.c_void_p).value
        robot["constants"] = _address_of(wrench_offset.jets)
        robot["inflow"] = _address_of(wrench_offset.inflow)
        robot["block_uncoupled"] = _address_of(block)
        robot["frames"] = _address_of(frames)
        robot["axis_counts"] = wrench_offset.counts
        self._robot: Record = robot
        self._limits: Record = np.zeros(1, struct("fl_settle_limits"))
        """When the iterations end."""
        self._result: Record = np.zeros(1, struct("fl_settle_result"))
        """What they end with."""
        self._force = np.zeros((1, self._count, 2))
        """Forces [N] at which the iterations begin, and then those at which they end."""

    def iterate(
        self,
        wrench: Array,
        force: Array | None,
        iterations: int,
        policy: PolicyFields | None = None,
        lam: Array | None = None,
        conditions: Conditions = NOMINAL,
        error_price: float = 0.0,
        max_steps: float = math.inf,
    ) -> OuterResult:
        """Runs outer iterations for one wrench.

        Args:
            wrench: desired (6,) [N, N m].
            force: (n, 2) [N] at which the iterations begin; None in a tick, where they begin at
                the command before.
            iterations: how many at most; 0 for the nearest forces that give the wrench.
            policy: what to give out of reach; None for nothing else than the wrench.
            lam: multipliers (6,) [W/N, W/(N m)] at which the first iteration begins.
            conditions: what holds of the robot.
            error_price: what an error as large as the wrench scale counts at least [W].
            max_steps: steps after which no iteration but the first is begun.

        Returns:
            The best command, and the answer of the dual by which it was found.

        Raises:
            CommandError: the core cannot work with these numbers.
        """
        with self._iterations_lock:
            self._force[0] = 0.0 if force is None else force
            self._limits["penalty_least"] = error_price
            self._limits["most_steps"] = max_steps
            self._limits["most_iterations"] = iterations
            answer = self.answer_one(wrench, policy, lam, conditions)
            return OuterResult(
                answer=answer._replace(force=self._force.copy()),
                power=float(self._result["power"][0]),
                error_price=float(self._result["penalty"][0]),
                error=float(self._result["error"][0]),
                steps=float(self._result["steps"][0]),
            )

    def _call(self) -> int:
        """Runs the iterations for the question that is written; returns an error code."""
        error: int = self._core.fl_settle(
            self._robot.ctypes.data,
            self._block_address,
            self._work_address,
            self._question.address,
            self._limits.ctypes.data,
            self._force.ctypes.data,
            self._answer.address,
            self._result.ctypes.data,
        )
        if self._raised is not None:
            raised = self._raised
            self._raised = None
            raise raised
        return error

    def _effect(
        self, _: int, force: int, count: int, inflow: int, change: int, wrench: int, slope: int
    ) -> None:
        """Writes the offset and its derivatives for C; the arguments are those of the callback."""
        n = self._count
        try:
            offset, derivatives = self._wrench_offset.effect(
                _numbers_at(force, (n, 3)), self._wrench_offset.inflow
            )
            _numbers_at(wrench, (6,))[:] = offset
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
