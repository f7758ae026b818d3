"""Calls of the core in C for one robot: its block of numbers and a work area."""

import ctypes
from functools import lru_cache
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.core.library import library

HEAD, EACH = 59, 68
"""Numbers of `fl_head` and of an `fl_actuator` of finlab/core/core.h."""
MAGIC = 41721.0
"""First number of a block; its version is the second."""
CODES = (
    *("", "no block of a robot", "a block of another version", "a number out of range", "a bad argument"),
)


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
    ended: bool
    """Whether a search ended at its bound of steps."""


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
        ("inner", ctypes.c_void_p),
        ("previous", ctypes.c_void_p),
    ]


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
        """Takes the block of a robot of n = `count` actuators."""
        core = library()
        self._core, self._block, self._count = core, block, count
        self._work, self._lock, most = ctypes.create_string_buffer(core.fl_sizes(3)), Lock(), core.fl_sizes(6)
        self._question, answer = _Question(), np.zeros(5 * most + 23)
        self._to, self._from = ctypes.addressof(self._question), answer.ctypes.data
        self._wrench = np.frombuffer(memoryview(self._question), np.float64, 6)
        self._inner, self._previous = np.zeros(6), np.zeros((count, 3))
        self._inner_at, self._previous_at = self._inner.ctypes.data, self._previous.ctypes.data
        self._force = answer[: 2 * count].reshape(1, count, 2)
        self._vectors = answer[2 * most :][:20]  # price, inner, aim (6,), value, error
        self._command = answer[2 * most + 20 :][: 3 * count].reshape(1, count, 3)
        self._flags = answer[5 * most + 20 :].view(np.int32)  # status, within, steps, ended, placed
        self._at, self._area = block.ctypes.data, ctypes.addressof(self._work)
        if error := core.fl_check(self._at, len(block)) or core.fl_prepare(self._at, self._area):
            raise ValueError(f"the core takes the robot for {CODES[error]}")

    def one(
        self, wrench: Array, policy: Any, inner: Array | None = None, previous: Array | None = None
    ) -> Found:
        """The answer to one wrench (6,). It begins at prices `inner` (6,) [W] in the basis, if there are
        any; commands may follow `previous` ones (n, 3); a policy is served out of reach."""
        with self._lock:  # question and answer lie in one place for all threads
            question = self._question
            self._wrench[:] = wrench
            served = None if policy is None else _policy(policy)  # kept until the call ends
            question.policy = None if served is None else ctypes.addressof(served)
            question.inner = question.previous = None
            if inner is not None:
                self._inner[:], question.inner = inner, self._inner_at
            if previous is not None:
                self._previous[:], question.previous = previous, self._previous_at
            if error := self._ask():
                raise ValueError(f"the core got {CODES[error]}")
            vectors = self._vectors.copy()
            return Found(
                self._force.copy(),
                vectors[None, :6],
                vectors[None, 12:18],
                vectors[18:19],
                self._flags[1:2].astype(bool),
                self._command.copy(),
                bool(self._flags[3]),
            )

    def _ask(self) -> int:
        code: int = self._core.fl_answer_one(self._at, self._area, self._to, self._from)
        return code

    def many(self, wrenches: Array, policy: Any) -> Found:
        """The answers to wrenches (N, 6)."""
        wrenches, count = np.ascontiguousarray(wrenches), len(wrenches)
        force, value = np.empty((count, self._count, 2)), np.empty(count)
        price, aim, within = np.empty((count, 6)), np.empty((count, 6)), np.empty(count, np.bool_)
        command = np.empty((count, self._count, 3))
        served = None if policy is None else _policy(policy)  # kept until the call ends
        own = None if served is None else ctypes.addressof(served)
        outs = [values.ctypes.data for values in (force, price, aim, value, command, within)]
        error = self._core.fl_answer_many(self._at, self._area, wrenches.ctypes.data, count, own, *outs)
        if error > 0:
            raise ValueError(f"the core got {CODES[error]}")
        return Found(force, price, aim, value, within, command, error < 0)

    def commands(self, force: Array, previous: Array | None = None) -> Array:
        """Commands (N, n, 3) for forces (N, n, 2) [N]; angles without a force keep `previous` ones (n, 3)."""
        force, command = np.ascontiguousarray(force), np.empty((len(force), self._count, 3))
        before = None if previous is None else np.ascontiguousarray(previous)
        start = None if before is None else before.ctypes.data
        data = (force.ctypes.data, len(force), start, command.ctypes.data)
        self._core.fl_commands(self._at, self._area, *data)
        return command

    def look(self, wrench: Array, inner: Array) -> tuple[Array, float]:
        """What prices (6,) in the basis give: forces (n, 2), and the dual value [W] for a wrench (6,)."""
        wrench, inner = np.ascontiguousarray(wrench), np.ascontiguousarray(inner)
        force = np.empty((self._count, 2))
        data = (wrench.ctypes.data, inner.ctypes.data, force.ctypes.data)
        return force, self._core.fl_look(self._at, self._area, *data)

    def worth(self, price: Array) -> Array:
        """At prices (N, 6) of the wrench, of each actuator (N, n, 3): prices along its force, ahead and in
        reverse, and what the force is worth, less its power [W]."""
        price = np.ascontiguousarray(price)
        worth = np.empty((len(price), self._count, 3))
        self._core.fl_worth(self._at, self._area, price.ctypes.data, len(price), worth.ctypes.data)
        return worth


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
