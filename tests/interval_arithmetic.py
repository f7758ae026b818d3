"""Intervals of numbers, for proofs about the laws of fins: what a formula gives of intervals
encloses what it gives of all numbers in them. Rounding is left out; it is far below what is proved.

Numpy hands its functions of an interval to `Interval.__array_ufunc__`, so that laws need not know.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from finlab.arrays import Array

TURN = 2.0 * np.pi


class Interval(NDArrayOperatorsMixin):
    """All numbers from `low` to `high`, arrays of one shape."""

    def __init__(self, low: Any, high: Any) -> None:
        self.low = np.asarray(low, np.float64)
        self.high = np.asarray(high, np.float64)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **_: Any) -> Interval:
        if method != "__call__" or ufunc not in RULES:
            raise TypeError(f"no rule for {ufunc} of intervals")
        return RULES[ufunc](*inputs)

    def rows(self, which: Any) -> Interval:
        """Some of them."""
        return Interval(self.low[which], self.high[which])


def interval(value: Any) -> Interval:
    """A value as an interval."""
    return value if isinstance(value, Interval) else Interval(value, value)


def _add(a: Any, b: Any) -> Interval:
    a, b = interval(a), interval(b)
    return Interval(a.low + b.low, a.high + b.high)


def _subtract(a: Any, b: Any) -> Interval:
    a, b = interval(a), interval(b)
    return Interval(a.low - b.high, a.high - b.low)


def _multiply(a: Any, b: Any) -> Interval:
    a, b = interval(a), interval(b)
    if a.low.min() >= 0.0 and b.low.min() >= 0.0:
        return Interval(a.low * b.low, a.high * b.high)
    products = [a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high]
    return Interval(np.minimum.reduce(products), np.maximum.reduce(products))


def _divide(a: Any, b: Any) -> Interval:
    b = interval(b)
    assert b.low.min() > 0.0, "a divisor may be 0"
    return _multiply(a, Interval(1.0 / b.high, 1.0 / b.low))


def _power(a: Any, exponent: Any) -> Interval:
    a = interval(a)
    if exponent == 2:
        squares = np.stack([a.low**2, a.high**2])
        holds_zero = (a.low <= 0.0) & (a.high >= 0.0)
        return Interval(np.where(holds_zero, 0.0, squares.min(axis=0)), squares.max(axis=0))
    assert a.low.min() >= 0.0, "a power of a negative number"
    ends = np.stack([a.low**exponent, a.high**exponent])
    return Interval(ends.min(axis=0), ends.max(axis=0))


def _sin(a: Any) -> Interval:
    a = interval(a)
    ends = np.stack([np.sin(a.low), np.sin(a.high)])

    def holds(angle: float) -> Any:
        """Whether an angle, or one that is whole turns away, lies within."""
        first = angle + TURN * np.ceil((a.low - angle) / TURN)
        return first <= a.high

    low = np.where(holds(-0.5 * np.pi), -1.0, ends.min(axis=0))
    high = np.where(holds(0.5 * np.pi), 1.0, ends.max(axis=0))
    return Interval(low, high)


def _rising(function: Callable[[Array], Array]) -> Callable[[Any], Interval]:
    """The rule of a function that rises."""
    return lambda a: Interval(function(interval(a).low), function(interval(a).high))


def _maximum(a: Any, b: Any) -> Interval:
    a, b = interval(a), interval(b)
    return Interval(np.maximum(a.low, b.low), np.maximum(a.high, b.high))


RULES: dict[np.ufunc, Callable[..., Interval]] = {
    np.add: _add,
    np.subtract: _subtract,
    np.multiply: _multiply,
    np.divide: _divide,
    np.power: _power,
    np.square: lambda a: _power(a, 2),
    np.negative: lambda a: Interval(-interval(a).high, -interval(a).low),
    np.maximum: _maximum,
    np.sqrt: _rising(np.sqrt),
    np.sin: _sin,
    np.cos: lambda a: _sin(_add(a, 0.5 * np.pi)),
}
