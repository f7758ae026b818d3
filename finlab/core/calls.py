"""Calls of the core in C for one robot: its block of numbers and a work area."""

import ctypes
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.core.library import library

MAGIC = 41721.0
"""First number of a block; its version is the second."""
MET, BEYOND, STUCK = range(3)
"""How Newton's method ends: at a target, where it is proved to be out of reach, at its bound of steps."""
ANSWER = 19
"""Numbers of an answer after its forces."""
CODES = ("", "no block of a robot", "a block of another version", "a number out of range", "a bad argument")


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
    ended: bool
    """Whether a search ended at its bound of steps."""


class _Policy(ctypes.Structure):
    _fields_ = [
        ("kind", ctypes.c_int),
        ("groups", ctypes.c_int),
        ("always", ctypes.c_int),
        ("weight", ctypes.c_double * 6),
        ("group", ctypes.c_ubyte * 36),
    ]


@lru_cache(maxsize=64)
def _policy(policy: Any, always: bool) -> _Policy:
    groups = policy.groups
    weights = np.array(policy.axis_weights)
    masks = np.concatenate([*groups, np.zeros(36 - 6 * len(groups))]).astype(int).tolist()
    kind = ("closest", "direction", "priority").index(policy.kind)
    return _Policy(kind, len(groups), always, tuple(weights / weights.max()), tuple(masks))


class Core:
    """One robot in the core."""

    def __init__(self, block: Array, count: int) -> None:
        """Takes the block of a robot of n = `count` actuators."""
        core = library()
        self._core, self._block, self._count = core, block, count
        self._work = ctypes.create_string_buffer(core.fl_sizes(3))
        self._out = ctypes.create_string_buffer(core.fl_sizes(5))
        most = core.fl_sizes(6)
        self._numbers = np.frombuffer(self._out, np.float64, 2 * most + ANSWER)
        self._integers = np.frombuffer(self._out, np.int32, 4, 8 * (2 * most + ANSWER))
        self._rest = self._numbers[2 * most :]
        self._at = block.ctypes.data
        if error := core.fl_check(self._at, len(block)) or core.fl_prepare(self._at, self._work):
            raise ValueError(f"the core takes the robot for {CODES[error]}")

    def one(
        self,
        wrench: Array,
        policy: Any,
        inner: Array | None = None,
        limits: Array | None = None,
        always: bool = False,
    ) -> tuple[Found, Array, int]:
        """The answer to one wrench (6,), its prices (6,) in the robot's basis [W], and how Newton's method ended
        (`MET` ...); `inner` are such prices to begin at, `limits` rows (n, 4) of least and largest force, middle and half of the arc; a policy is
        served where the wrench is out of reach, or `always`."""
        wrench = np.ascontiguousarray(wrench)
        own = None if policy is None else ctypes.byref(_policy(policy, always))
        starts = [None if values is None else np.ascontiguousarray(values) for values in (inner, limits)]
        places = [None if values is None else values.ctypes.data for values in starts]
        if error := self._core.fl_answer_one(
            self._at, self._work, wrench.ctypes.data, own, *places, self._out
        ):
            raise ValueError(f"the core got {CODES[error]}")
        force = self._numbers[: 2 * self._count].reshape(1, -1, 2).copy()
        rest = self._rest.copy()
        status, inside, _, ended = self._integers.tolist()
        within = np.array([inside != 0])
        found = Found(force, rest[None, :6], rest[None, 12:18], rest[18:], within, ended != 0)
        return found, rest[6:12], status

    def many(self, wrenches: Array, policy: Any) -> Found:
        """The answers to wrenches (N, 6)."""
        wrenches, count = np.ascontiguousarray(wrenches), len(wrenches)
        force, value = np.empty((count, self._count, 2)), np.empty(count)
        price, aim, within = np.empty((count, 6)), np.empty((count, 6)), np.empty(count, np.bool_)
        own = None if policy is None else ctypes.byref(_policy(policy, False))
        outs = [values.ctypes.data for values in (force, price, aim, value, within)]
        error = self._core.fl_answer_many(self._at, self._work, wrenches.ctypes.data, count, own, *outs)
        if error > 0:
            raise ValueError(f"the core got {CODES[error]}")
        return Found(force, price, aim, value, within, error < 0)

    def first(self, wrench: Array) -> Array:
        """Prices (6,) [W] in the basis at which a search for a wrench (6,) begins."""
        wrench, inner = np.ascontiguousarray(wrench), np.zeros(6)
        self._core.fl_first(self._at, self._work, wrench.ctypes.data, inner.ctypes.data)
        return inner

    def look(self, wrench: Array, inner: Array) -> tuple[Array, float]:
        """What prices (6,) in the basis give: forces (n, 2), and the dual value [W] for a wrench (6,)."""
        wrench, inner = np.ascontiguousarray(wrench), np.ascontiguousarray(inner)
        force = np.empty((self._count, 2))
        data = (wrench.ctypes.data, inner.ctypes.data, force.ctypes.data)
        return force, self._core.fl_look(self._at, self._work, *data)

    def worth(self, price: Array) -> Array:
        """At prices (N, 6) of the wrench, of each actuator (N, n, 3): prices along its force, ahead and in
        reverse, and what the force is worth, less its power [W]."""
        price = np.ascontiguousarray(price)
        worth = np.empty((len(price), self._count, 3))
        self._core.fl_worth(self._at, self._work, price.ctypes.data, len(price), worth.ctypes.data)
        return worth

    def farthest(self, price: Array) -> Array:
        """Forces (N, n, 2) [N] that are worth most at prices (N, 6) of the wrench, whatever their power."""
        price = np.ascontiguousarray(price)
        force = np.empty((len(price), self._count, 2))
        self._core.fl_support(self._at, self._work, price.ctypes.data, len(price), force.ctypes.data)
        return force
