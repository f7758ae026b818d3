"""Calls of the core in C for one robot: its block of numbers and a work area."""

import ctypes
from functools import lru_cache
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.core.fields import Record, actuators_of, head_of, struct, tables_begin
from finlab.core.library import library
from finlab.errors import CommandError, DataError

MAGIC = 41721.0
"""First number of a block; its version is the second."""
CODES = (
    *(
        "",
        "no block of a robot",
        "a block of another version",
        "a number out of range",
        "a bad argument",
    ),
)


_REFUSED = (
    "the core cannot work with these numbers: it found {}; check the wrench and the previous "
    "command"
)


class Found(NamedTuple):
    """Forces for N targets."""

    force: Array
    """(N, n, 2) [N], along each actuator's directions; the second of a foil is its drag."""
    prices: Array
    """Multipliers (N, 6) of the wrench [W/N, W/(N m)]."""
    wrench_served: Array
    """The wrenches (N, 6) [N, N m] that they give: the targets, or those that the policy gives."""
    gap_power_bound: Array
    """Power (N,) [W] that gaps in the sets are proved to need; 0 where there is none."""
    is_attainable: NDArray[np.bool_]
    """Targets within reach (N,)."""
    command: Array
    """Commands (N, n, 3) that give them, as near as the tables of the laws are."""
    error: Array
    """Distance (N,) of what the commands give from `wrench_served`, on the yardstick, by the laws'
    tables."""
    is_truncated: bool
    """Whether a search ended at its bound of steps."""


class Worth(NamedTuple):
    """What the forces of n actuators are worth at N prices."""

    price_ahead: Array
    """Price along the force (N, n) [W/N]."""
    price_reverse: Array
    """The same of a force in reverse (N, n)."""
    conjugate: Array
    """Most that a force is worth (N, n), less its power [W], by the tables."""
    force_min: Array
    """Least force (1, n) [N] now, of planes below 0 in reverse."""
    force_max: Array
    """Largest force (1, n) [N] now."""


class Now(NamedTuple):
    """What holds of a robot of n actuators when it is asked."""

    previous: Array | None = None
    """Commands (n, 3) of the tick before, NaN where one is unknown; None outside of ticks."""
    lost: NDArray[np.bool_] | None = None
    """Which actuators (n,) do not work; None where all do."""
    free: NDArray[np.bool_] | None = None
    """Which axes (6,) may take any wrench, beside those that the robot does not command; None for
    none."""
    calm: float = 0.0
    """What turning costs in a tick; see `DualSettings.calm`."""
    ticks: int = 1
    """How many ticks after `previous` the commands are for."""
    toward: Array | None = None
    """Angles (n,) [rad] near which pods are to stand, NaN for others; None for nowhere else than
    before."""


STILL = Now()
"""No tick, nothing lost, no axis free."""


class _Served(NamedTuple):
    """A policy as the core reads it, and where it lies."""

    record: Record
    address: int


@lru_cache(maxsize=64)
def _served(policy: Any) -> _Served:
    weights = np.array(policy.axis_weights)
    record = np.zeros(1, struct("fl_policy"))
    record["policy"] = ("closest", "direction", "priority").index(policy.kind)
    record["group_count"] = len(policy.groups)
    record["axis_weight"] = weights / weights.max()
    for place, axes in enumerate(policy.groups):
        record["group"][:, place] = axes
    return _Served(record, record.ctypes.data)


class Core:
    """One robot in the core."""

    def __init__(self, block: Array, count: int) -> None:
        """Takes the block of a robot.

        Args:
            block: its numbers; see finlab/core/fl_fields.h.
            count: n, how many actuators it has.

        Raises:
            DataError: its numbers are out of the range that the core works with.
        """
        core = library()
        self._core = core
        self._block = block
        self._count = count
        self._work = ctypes.create_string_buffer(core.fl_sizes(3))
        self._lock = Lock()
        self._at = block.ctypes.data
        self._area = ctypes.addressof(self._work)

        # Question and answer lie in one place; these are views of it.
        question = np.zeros(1, struct("fl_question"))
        self._question = question
        self._to = question.ctypes.data
        self._wrench = question["wrench"]
        self._policy_at = question["policy"]
        self._price_at = question["prices"]
        self._previous_at = question["previous"]
        self._lost_at = question["lost"]
        self._free_at = question["free"]
        self._calm = question["calm"]
        self._ticks = question["ticks"]
        self._toward_at = question["angles_wanted"]
        answer = np.zeros(1, struct("fl_answer"))
        self._from = answer.ctypes.data
        self._force = answer["force"][:, :count]
        self._answer_prices = answer["prices"]
        self._wrench_served = answer["wrench_served"]
        self._gap_power_bound = answer["gap_power_bound"]
        self._error = answer["error"]
        self._command = answer["command"][:, :count]
        self._is_attainable = answer["is_attainable"]
        self._is_truncated = answer["is_truncated"]

        # What the question points at, and where it lies.
        self._price = np.zeros(6)
        self._previous = np.zeros((count, 3))
        self._lost = np.zeros(count, np.uint8)
        self._free = np.zeros(6, np.uint8)
        self._toward = np.zeros(count)
        self._price_lies = self._price.ctypes.data
        self._previous_lies = self._previous.ctypes.data
        self._lost_lies = self._lost.ctypes.data
        self._free_lies = self._free.ctypes.data
        self._toward_lies = self._toward.ctypes.data

        error = core.fl_check(self._at, len(block)) or core.fl_prepare(self._at, self._area)
        if error:
            raise DataError(
                f"the core takes the robot for {CODES[error]}; check its forces, powers and sizes"
            )

    def _ask_for(self, policy: Any, price: Array | None, now: Now) -> _Served | None:
        """Writes into the question all but the wrench; what is returned is to be kept until the
        call ends."""
        served = None if policy is None else _served(policy)
        self._policy_at[0] = 0 if served is None else served.address
        self._price_at[0] = 0
        if price is not None:
            self._price[:] = price
            self._price_at[0] = self._price_lies
        self._stand(now)
        return served

    def _stand(self, now: Now) -> None:
        """Writes what holds now into the question."""
        self._calm[0] = now.calm
        self._ticks[0] = now.ticks
        self._toward_at[0] = 0
        if now.toward is not None:
            self._toward[:] = now.toward
            self._toward_at[0] = self._toward_lies
        self._previous_at[0] = 0
        if now.previous is not None:
            self._previous[:] = now.previous
            self._previous_at[0] = self._previous_lies
        self._lost_at[0] = 0
        if now.lost is not None:
            self._lost[:] = now.lost
            self._lost_at[0] = self._lost_lies
        self._free_at[0] = 0
        if now.free is not None:
            self._free[:] = now.free
            self._free_at[0] = self._free_lies

    def one(
        self, wrench: Array, policy: Any, price: Array | None = None, now: Now = STILL
    ) -> Found:
        """Answers one wrench.

        Args:
            wrench: wanted (6,) [N, N m].
            policy: what to give out of reach; None for nothing else.
            price: of the wrench (6,) [W/N, W/(N m)] to begin with.
            now: what holds.

        Returns:
            One row of forces, prices and commands.

        Raises:
            CommandError: the core cannot work with these numbers.
        """
        with self._lock:  # question and answer lie in one place for all threads
            self._wrench[0] = wrench
            served = self._ask_for(policy, price, now)
            error = self._ask()
            del served
            if error:
                raise CommandError(_REFUSED.format(CODES[error]))
            return Found(
                force=self._force.copy(),
                prices=self._answer_prices.copy(),
                wrench_served=self._wrench_served.copy(),
                gap_power_bound=self._gap_power_bound.copy(),
                is_attainable=self._is_attainable.astype(bool),
                command=self._command.copy(),
                error=self._error.copy(),
                is_truncated=bool(self._is_truncated[0]),
            )

    def _ask(self) -> int:
        code: int = self._core.fl_answer_one(self._at, self._area, self._to, self._from)
        return code

    def many(self, wrenches: Array, policy: Any, now: Now = STILL) -> Found:
        """Returns the answers to wrenches (N, 6); see `one`."""
        wrenches, count = np.ascontiguousarray(wrenches), len(wrenches)
        found = Found(
            force=np.empty((count, self._count, 2)),
            prices=np.empty((count, 6)),
            wrench_served=np.empty((count, 6)),
            gap_power_bound=np.empty(count),
            is_attainable=np.empty(count, np.bool_),
            command=np.empty((count, self._count, 3)),
            error=np.empty(count),
            is_truncated=False,
        )
        outputs = [
            found.force,
            found.prices,
            found.wrench_served,
            found.gap_power_bound,
            found.command,
            found.is_attainable,
            found.error,
        ]
        outs = [values.ctypes.data for values in outputs]
        with self._lock:
            served = self._ask_for(policy, None, now)
            ins = self._at, self._area, self._to, wrenches.ctypes.data, count
            code = self._core.fl_answer_many(*ins, *outs)
            del served
        if code > 0:
            raise CommandError(_REFUSED.format(CODES[code]))
        return found._replace(is_truncated=code < 0)

    def commands(self, force: Array, previous: Array | None = None) -> Array:
        """Returns commands (N, n, 3) for forces (N, n, 2) [N]; angles without a force keep
        `previous` ones (n, 3)."""
        force, command = np.ascontiguousarray(force), np.empty((len(force), self._count, 3))
        before = None if previous is None else np.ascontiguousarray(previous)
        start = None if before is None else before.ctypes.data
        data = (force.ctypes.data, len(force), start, command.ctypes.data)
        with self._lock:
            self._core.fl_commands(self._at, self._area, *data)
        return command

    def dual_value(self, wrench: Array, lambda_reduced: Array) -> tuple[Array, float]:
        """Evaluates the dual.

        Args:
            wrench: desired (6,) [N, N m].
            lambda_reduced: multipliers (6,) in the basis [W].

        Returns:
            Responses (n, 2) [N], and the dual value [W].
        """
        wrench = np.ascontiguousarray(wrench)
        lambda_reduced = np.ascontiguousarray(lambda_reduced)
        force = np.empty((self._count, 2))
        data = (wrench.ctypes.data, lambda_reduced.ctypes.data, force.ctypes.data)
        return force, self._core.fl_dual_value(self._at, self._area, *data)

    def worth(self, price: Array, now: Now = STILL) -> Worth:
        """Returns what forces are worth at prices (N, 6) of the wrench [W/N, W/(N m)], of all that
        may be given now. Raises CommandError: the core cannot work with these numbers."""
        price = np.ascontiguousarray(price)
        worth = np.empty((len(price), self._count), struct("fl_actuator_worth"))
        with self._lock:
            self._stand(now)
            ins = self._at, self._area, self._to, price.ctypes.data, len(price)
            error = self._core.fl_worth(*ins, worth.ctypes.data)
        if error:
            raise CommandError(_REFUSED.format(CODES[error]))
        return Worth(
            worth["price_ahead"],
            worth["price_reverse"],
            worth["conjugate"],
            worth["force_min"][:1],
            worth["force_max"][:1],
        )


def planes(count: int) -> Array:
    """A block of n = `count` actuators of which it says that they push in planes, and no more."""
    block = np.zeros(tables_begin(count))
    head_of(block)["n"] = count
    actuators_of(block)["rows"] = 2.0
    return block


def reach(
    block: Array, own: Array, origin: Array, ray: Array, close: float
) -> tuple[Array, Array, Array]:
    """How far (R,) rays (R, 6) from points (R, 6) go in what R robots push, minus infinity where
    they miss it: at most, and as `close`; normals (R, 6) of the planes that prove it, and forces
    (R, n, 2) there.

    Args:
        block: of `planes`, and polygons behind: how many corners, then these.
        own: of each actuator (R, n, 16) the place of its polygon, or 0 and radius, middle and half
            of a sector, then the wrench (2, 6) per newton along its directions.
    """
    core = library()
    count, n, _ = own.shape
    size = np.empty(count)
    normal = np.empty((count, 6))
    force = np.empty((count, n, 2))
    work = ctypes.create_string_buffer(core.fl_sizes(3))
    ins = [values.ctypes.data for values in (own, origin, ray)]
    outs = [values.ctypes.data for values in (size, normal, force)]
    core.fl_reach(block.ctypes.data, ctypes.addressof(work), *ins, count, min(close, 1e30), *outs)
    return np.where(size > -1e30, size, -np.inf), normal, force
