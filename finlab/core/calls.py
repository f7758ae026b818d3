"""Calls of the core in C for one robot: its block of numbers and a work area."""

import ctypes
from functools import lru_cache
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.core.library import library
from finlab.errors import CommandError, DataError

HEAD, EACH = 65, 68
"""Numbers of `fl_head` and of an `fl_actuator` of finlab/core/core.h."""
MAGIC = 41721.0
"""First number of a block; its version is the second."""
CODES = (
    *("", "no block of a robot", "a block of another version", "a number out of range", "a bad argument"),
)


_REFUSED = "the core cannot work with these numbers: it found {}; check the wrench and the previous command"


class Found(NamedTuple):
    """Forces for N targets."""

    force: Array
    """(N, n, 2) [N], along each actuator's directions; the second of a foil is its drag."""
    price: Array
    """(N, 6) of the wrench [W/N, W/(N m)]."""
    aim: Array
    """The wrenches (N, 6) [N, N m] that they give: the targets, or those that the policy gives."""
    value: Array
    """Power (N,) [W] that gaps in the sets are proved to need; 0 where there is none."""
    within: NDArray[np.bool_]
    """Targets within reach (N,)."""
    command: Array
    """Commands (N, n, 3) that give them, as near as the tables of the laws are."""
    error: Array
    """Distance (N,) of what the commands give from the aims, on the yardstick, by the laws' tables."""
    ended: bool
    """Whether a search ended at its bound of steps."""


class Worth(NamedTuple):
    """What the forces of n actuators are worth at N prices."""

    ahead: Array
    """Price along the force (N, n) [W/N]."""
    back: Array
    """The same of a force in reverse (N, n)."""
    most: Array
    """Most that a force is worth (N, n), less its power [W], by the tables."""
    low: Array
    """Least force (1, n) [N] now, of planes below 0 in reverse."""
    high: Array
    """Largest force (1, n) [N] now."""


class _Policy(ctypes.Structure):
    _fields_ = [
        ("kind", ctypes.c_int),
        ("groups", ctypes.c_int),
        ("weight", ctypes.c_double * 6),
        ("group", ctypes.c_ubyte * 36),
    ]


class _Question(ctypes.Structure):
    _fields_ = [
        ("wrench", ctypes.c_double * 6),
        ("policy", ctypes.c_void_p),
        ("price", ctypes.c_void_p),
        ("previous", ctypes.c_void_p),
        ("lost", ctypes.c_void_p),
        ("free", ctypes.c_void_p),
        ("calm", ctypes.c_double),
    ]


class Now(NamedTuple):
    """What holds of a robot of n actuators when it is asked."""

    previous: Array | None = None
    """Commands (n, 3) of the tick before, NaN where one is unknown; None outside of ticks."""
    lost: NDArray[np.bool_] | None = None
    """Which actuators (n,) do not work; None where all do."""
    free: NDArray[np.bool_] | None = None
    """Which axes (6,) may take any wrench, beside those that the robot does not command; None for none."""
    calm: float = 0.0
    """What turning costs in a tick; see `DualSettings.calm`."""


STILL = Now()
"""No tick, nothing lost, no axis free."""


@lru_cache(maxsize=64)
def _policy(policy: Any) -> _Policy:
    groups = policy.groups
    weights = np.array(policy.axis_weights)
    masks = np.concatenate([*groups, np.zeros(36 - 6 * len(groups))]).astype(int).tolist()
    kind = ("closest", "direction", "priority").index(policy.kind)
    return _Policy(kind, len(groups), tuple(weights / weights.max()), tuple(masks))


class Core:
    """One robot in the core."""

    def __init__(self, block: Array, count: int) -> None:
        """Takes the block of a robot of n = `count` actuators. Raises DataError: its numbers are out of the
        range that the core works with."""
        core = library()
        self._core, self._block, self._count = core, block, count
        self._work, self._lock, most = ctypes.create_string_buffer(core.fl_sizes(3)), Lock(), core.fl_sizes(6)
        self._question, answer = _Question(), np.zeros(5 * most + 23)
        self._to, self._from = ctypes.addressof(self._question), answer.ctypes.data
        self._wrench = np.frombuffer(memoryview(self._question), np.float64, 6)
        self._price, self._previous = np.zeros(6), np.zeros((count, 3))
        self._lost, self._free = np.zeros(count, np.uint8), np.zeros(6, np.uint8)
        kept = (self._price, self._previous, self._lost, self._free)
        self._price_at, self._previous_at, self._lost_at, self._free_at = (
            values.ctypes.data for values in kept
        )
        self._force = answer[: 2 * count].reshape(1, count, 2)
        self._vectors = answer[2 * most :][:20]  # price, inner, aim (6,), value, error
        self._command = answer[2 * most + 20 :][: 3 * count].reshape(1, count, 3)
        self._flags = answer[5 * most + 20 :].view(np.int32)  # status, within, steps, ended, placed
        self._at, self._area = block.ctypes.data, ctypes.addressof(self._work)
        if error := core.fl_check(self._at, len(block)) or core.fl_prepare(self._at, self._area):
            raise DataError(
                f"the core takes the robot for {CODES[error]}; check its forces, powers and sizes"
            )

    def _stand(self, now: Now) -> None:
        """Writes what holds now into the question."""
        own = self._question
        own.previous = own.lost = own.free = None
        own.calm = now.calm
        if now.previous is not None:
            self._previous[:] = now.previous
            own.previous = self._previous_at
        if now.lost is not None:
            self._lost[:] = now.lost
            own.lost = self._lost_at
        if now.free is not None:
            self._free[:] = now.free
            own.free = self._free_at

    def one(self, wrench: Array, policy: Any, price: Array | None = None, now: Now = STILL) -> Found:
        """Returns the answer to one wrench (6,) for what holds now, from prices (6,) [W/N, W/(N m)] of the
        wrench on, if there are any; a policy is served out of reach. Raises CommandError: the core cannot
        work with these numbers."""
        with self._lock:  # question and answer lie in one place for all threads
            question = self._question
            self._wrench[:] = wrench
            served = None if policy is None else _policy(policy)  # kept until the call ends
            question.policy = None if served is None else ctypes.addressof(served)
            question.price = None
            if price is not None:
                self._price[:], question.price = price, self._price_at
            self._stand(now)
            if error := self._ask():
                raise CommandError(_REFUSED.format(CODES[error]))
            vectors = self._vectors.copy()
            return Found(
                self._force.copy(),
                vectors[None, :6],
                vectors[None, 12:18],
                vectors[18:19],
                self._flags[1:2].astype(bool),
                self._command.copy(),
                vectors[19:20],
                bool(self._flags[3]),
            )

    def _ask(self) -> int:
        code: int = self._core.fl_answer_one(self._at, self._area, self._to, self._from)
        return code

    def many(self, wrenches: Array, policy: Any, now: Now = STILL) -> Found:
        """Returns the answers to wrenches (N, 6); see `one`."""
        wrenches, count = np.ascontiguousarray(wrenches), len(wrenches)
        force, value, error = np.empty((count, self._count, 2)), np.empty(count), np.empty(count)
        price, aim, within = np.empty((count, 6)), np.empty((count, 6)), np.empty(count, np.bool_)
        command = np.empty((count, self._count, 3))
        outs = [values.ctypes.data for values in (force, price, aim, value, command, within, error)]
        with self._lock:
            served = None if policy is None else _policy(policy)  # kept until the call ends
            self._question.policy = None if served is None else ctypes.addressof(served)
            self._question.price = None
            self._stand(now)
            ins = self._at, self._area, self._to, wrenches.ctypes.data, count
            code = self._core.fl_answer_many(*ins, *outs)
        if code > 0:
            raise CommandError(_REFUSED.format(CODES[code]))
        return Found(force, price, aim, value, within, command, error, code < 0)

    def commands(self, force: Array, previous: Array | None = None) -> Array:
        """Returns commands (N, n, 3) for forces (N, n, 2) [N]; angles without a force keep `previous` ones
        (n, 3)."""
        force, command = np.ascontiguousarray(force), np.empty((len(force), self._count, 3))
        before = None if previous is None else np.ascontiguousarray(previous)
        start = None if before is None else before.ctypes.data
        data = (force.ctypes.data, len(force), start, command.ctypes.data)
        with self._lock:
            self._core.fl_commands(self._at, self._area, *data)
        return command

    def look(self, wrench: Array, inner: Array) -> tuple[Array, float]:
        """What prices (6,) in the basis give: forces (n, 2), and the dual value [W] for a wrench (6,)."""
        wrench, inner = np.ascontiguousarray(wrench), np.ascontiguousarray(inner)
        force = np.empty((self._count, 2))
        data = (wrench.ctypes.data, inner.ctypes.data, force.ctypes.data)
        return force, self._core.fl_look(self._at, self._area, *data)

    def worth(self, price: Array, now: Now = STILL) -> Worth:
        """Returns what forces are worth at prices (N, 6) of the wrench [W/N, W/(N m)], of all that may be
        given now. Raises CommandError: the core cannot work with these numbers."""
        price = np.ascontiguousarray(price)
        worth = np.empty((len(price), self._count, 5))
        with self._lock:
            self._stand(now)
            ins = self._at, self._area, self._to, price.ctypes.data, len(price)
            error = self._core.fl_worth(*ins, worth.ctypes.data)
        if error:
            raise CommandError(_REFUSED.format(CODES[error]))
        ahead, back, most, low, high = np.moveaxis(worth, -1, 0)
        return Worth(ahead, back, most, low[:1], high[:1])


def planes(count: int) -> Array:
    """A block of n = `count` actuators of which it says that they push in planes, and no more."""
    block = np.zeros(HEAD + EACH * count)
    block[3], block[HEAD::EACH] = count, 2.0
    return block


def reach(block: Array, own: Array, origin: Array, ray: Array, close: float) -> tuple[Array, Array, Array]:
    """How far (R,) rays (R, 6) from points (R, 6) go in what R robots push, minus infinity where they miss
    it: at most, and as `close`; normals (R, 6) of the planes that prove it, and forces (R, n, 2) there.

    Args:
        block: of `planes`, and polygons behind: how many corners, then these.
        own: of each actuator (R, n, 16) the place of its polygon, or 0 and radius, middle and half of a
            sector, then the wrench (2, 6) per newton along its directions.
    """
    core, (count, n, _) = library(), own.shape
    size, normal, force = np.empty(count), np.empty((count, 6)), np.empty((count, n, 2))
    work = ctypes.create_string_buffer(core.fl_sizes(3))
    ins = [values.ctypes.data for values in (own, origin, ray)]
    outs = [values.ctypes.data for values in (size, normal, force)]
    core.fl_reach(block.ctypes.data, ctypes.addressof(work), *ins, count, min(close, 1e30), *outs)
    return np.where(size > -1e30, size, -np.inf), normal, force
