"""Calls of the core for a robot whose actuators act on each other: turns on its whole model."""

import ctypes
import math
from collections.abc import Callable
from threading import Lock
from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.core.calls import STILL, Core, Found, Now
from finlab.core.library import library

_EFFECT = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 2, ctypes.c_int, *[ctypes.c_void_p] * 4)


class Beside(NamedTuple):
    """What comes beside the forces of n actuators."""

    frames: Array
    """Axes (n, 3, 3) of the laws' forces in the body frame, in rows."""
    counts: Array
    """1 of axes (6,) of the wrench that count, else 0."""
    inflow: Array | None
    """Velocities (n, 3) [m/s] of the places through the water, body frame; None at rest."""
    jets: Array | None
    """Numbers for the core's formula of jets; None where `effect` says it."""
    effect: Callable[[Array, Array | None], tuple[Array, Array]]
    """For forces (n, 3), body frame, and `inflow`: the wrench (6,) beside them, and its derivatives
    (n, 3, 6)."""


class Ended(NamedTuple):
    """What turns end with."""

    found: Found
    """The dual's last answer by which the command got better, with the command; its force is that
    of the command."""
    power: float
    """[W]."""
    worth: float
    """What an error as large as the yardstick counts [W]."""
    error: float
    """Distance of the wrench from the target, on the yardstick, by the laws' tables."""
    steps: float
    """Steps of Newton's method and on commands that the turns took."""


class _Whole(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_void_p) for name in ("effect", "known", "inflow", "plain", "frames")),
        ("counts", ctypes.c_double * 6),
    ]


class Whole(Core):
    """One robot in the core, with what comes beside its forces."""

    def __init__(self, block: Array, beside: Beside) -> None:
        """Takes the block of the robot by its laws alone."""
        super().__init__(block.copy(), len(beside.frames))
        self._beside = beside
        self._turn = Lock()
        self._raised: BaseException | None = None
        arrays = (beside.jets, beside.inflow, block, np.ascontiguousarray(beside.frames))
        effect = _EFFECT(self._effect) if beside.jets is None else library().fl_jets
        self._kept = arrays, effect
        self._whole = _Whole(
            ctypes.cast(effect, ctypes.c_void_p),
            *(None if own is None else own.ctypes.data for own in arrays),
            tuple(beside.counts),
        )
        self._begin = np.zeros((1, self._count, 2))
        self._end = np.zeros(4)
        self._turns = 0
        self._ends = self._begin.ctypes.data, self._from, self._end.ctypes.data

    def settled(
        self,
        wrench: Array,
        force: Array | None,
        turns: int,
        policy: Any = None,
        price: Array | None = None,
        now: Now = STILL,
        worth: float = 0.0,
        most_steps: float = math.inf,
    ) -> Ended:
        """What turns from forces (n, 2) on, or in a tick from the command before, come to for a
        wrench (6,): at most so many, none for the nearest forces that give it; the first begins at
        a `price` (6,) of the wrench. An error counts `worth` [W] at least. No turn but the first is
        begun after `most_steps` steps. Else as for `one`."""
        with self._turn:
            self._begin[0] = 0.0 if force is None else force
            self._turns = turns
            self._end[1] = worth
            self._end[3] = most_steps
            found = self.one(wrench, policy, price, now)
            return Ended(found._replace(force=self._begin.copy()), *self._end.tolist())

    def _ask(self) -> int:
        ins = ctypes.addressof(self._whole), self._at, self._area, self._to, self._turns
        error: int = self._core.fl_settle(*ins, *self._ends)
        if self._raised is not None:
            raised = self._raised
            self._raised = None
            raise raised
        return error

    def _effect(
        self, _: int, force: int, count: int, inflow: int, change: int, wrench: int, slope: int
    ) -> None:
        n = self._count
        try:
            given = self._beside.effect(_at(force, (n, 3)), self._beside.inflow)
            _at(wrench, (6,))[:], _at(slope, (n, 3, 6))[:] = given
        except BaseException as error:  # the core cannot pass it on
            self._raised = error


def _at(address: int, shape: tuple[int, ...]) -> Array:
    """The numbers at an address."""
    return np.ctypeslib.as_array(
        (ctypes.c_double * math.prod(shape)).from_address(address)
    ).reshape(shape)
