"""The question to a method, and the checks of the arguments that it is made of.

`Allocator` asks; who writes a method reads `MethodQuestion`. The checks return their argument in
the form in which methods take it, or raise an error that says what was got and what was expected.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.allocation.policy import CLOSEST, Policy
from finlab.arrays import Array
from finlab.axes import AXES, mask_of
from finlab.errors import AllocationError, CommandError
from finlab.layout.damage import NO_DAMAGE, Damage, lost_names
from finlab.layout.layout import Layout

if TYPE_CHECKING:
    from finlab.allocation.power_budget import PowerBudget

MAX_WRENCH = 1e12
"""Largest magnitude of a component of a wrench [N, N m]; beyond it something is wrong upstream."""

MAX_FLOW = 100.0
"""Largest magnitude of a component of the flow [m/s, rad/s]; beyond it something is wrong
upstream."""

_FLOAT64 = np.dtype(np.float64)
"""Type of the numbers that methods take."""

MAX_SIZE_IN_PYTHON = 100
"""Arrays of up to so many numbers are measured by Python's own functions, which is quicker than
numpy's calls are for them; every tick pays for it."""


class MethodQuestion(NamedTuple):
    """What a method is asked, all checked, of a robot of n actuators."""

    targets: Array
    """Desired wrenches (N, 6) [N, N m]; 0 along axes that do not count."""
    policy: Policy = CLOSEST
    """What to give for those out of reach."""
    previous: Array | None = None
    """Command (n, 3) of the tick before, for a single target; None outside of ticks."""
    flow: Array | None = None
    """Velocity (6,) of the body relative to the water [m/s, rad/s]; None at rest."""
    seed: int = 0
    """Makes the answer repeatable."""
    lost: NDArray[np.bool_] | None = None
    """Which actuators (n,) do not work, for methods that read losses; None where all do."""
    free: NDArray[np.bool_] | None = None
    """Which axes (6,) may take any wrench, for methods that read losses; None for none."""
    multipliers: Array | None = None
    """Multipliers (6,) [W/N, W/(N m)] of an earlier answer, for a single target and methods that
    read them; None for their own."""
    reference: Array | None = None
    """Wrenches (K, 6) of the next ticks [N, N m], for methods that read them; None where they are
    not known."""
    budget: PowerBudget | None = None
    """What actuators may take together, for methods that read it; None for no limit."""

    def part(self, rows: slice) -> MethodQuestion:
        """Returns the question for some of the targets. The seed is shifted by their first index,
        so that a target gets the same answer in any batch."""
        if rows == slice(0, len(self.targets)):
            return self
        return self._replace(targets=self.targets[rows], seed=self.seed + rows.start)


def check_layout(layout: object) -> None:
    """Refuses what is no layout.

    Raises:
        AllocationError: it is none.
    """
    if not isinstance(layout, Layout):
        raise AllocationError(
            f"layout: expected a Layout, got {layout!r:.60}; read a file with finlab.load_layout"
        )


def check_seed(seed: object) -> int:
    """Returns a seed, a whole number from 0.

    Raises:
        AllocationError: it is none.
    """
    if type(seed) is int and seed >= 0:
        return seed
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise AllocationError(f"seed: expected a whole number from 0, got {seed!r}")
    return int(seed)


def check_threads(threads: object) -> int:
    """Returns a number of threads, a whole number from 1.

    Raises:
        AllocationError: it is none.
    """
    if type(threads) is int and threads >= 1:
        return threads
    if isinstance(threads, bool) or not isinstance(threads, int | np.integer) or threads < 1:
        raise AllocationError(f"threads: expected a whole number from 1, got {threads!r:.60}")
    return int(threads)


def damage_of(damage: Damage | None, lost: Sequence[str]) -> Damage:
    """Returns the damage that a question names in either of its two arguments.

    Args:
        damage: damage of any kind; None for none.
        lost: names of actuators that are lost besides.

    Returns:
        One damage with both.

    Raises:
        AllocationError: `damage` is no `Damage`, or `lost` is no list of names.
    """
    if damage is None:
        return Damage(lost=lost) if len(lost) else NO_DAMAGE
    if isinstance(damage, Damage):
        if not len(lost):
            return damage
        return replace(damage, lost=[*damage.lost, *lost_names(lost)])
    raise AllocationError(f"damage: expected a Damage, got {damage!r:.100}")


def free_mask(layout: Layout, free: Sequence[str]) -> NDArray[np.bool_] | None:
    """Returns which axes of the wrench are free for one question.

    Args:
        layout: the robot.
        free: names of axes, such as `("Ty",)`.

    Returns:
        Mask (6,) of the axes that are named; None where there are none.

    Raises:
        CommandError: it is no list of names of axes, or no axis is left that the robot commands.
    """
    if not len(free):
        return None
    if isinstance(free, str) or not isinstance(free, Sequence):
        raise CommandError(f'free: expected a list of axes such as ("Ty",), got {free!r:.100}')
    unknown = [axis for axis in free if axis not in AXES]
    if unknown:
        raise CommandError(f"free: expected axes among {', '.join(AXES)}, got {unknown[0]!r:.60}")
    mask = mask_of(free)
    if not (layout.commanded & ~mask).any():
        raise CommandError(
            f"free: names each axis that layout {layout.name} commands "
            f"({', '.join(layout.axes)}), expected one of them to be left"
        )
    return mask


def check_target(wrench: ArrayLike) -> Array:
    """Returns a desired wrench (6,) [N, N m] as finite float64, a copy.

    Raises:
        CommandError: it is not six finite numbers of at most `MAX_WRENCH`.
    """
    if type(wrench) is np.ndarray and wrench.dtype is _FLOAT64 and wrench.shape == (6,):
        array = wrench.copy()
    else:
        array = _numbers(wrench, "wrench", _ONE_WRENCH)
    if array.shape != (6,):
        raise _wrong_shape("wrench", _ONE_WRENCH, array)
    if math.hypot(*array.tolist()) <= MAX_WRENCH:  # quicker than numpy for six numbers
        return array
    return _within_limit(array, "wrench")


def askable(wrench: Array) -> Array:
    """Returns a wrench (6,), or the longest share of it that may be asked for: what large robots
    give may have components above `MAX_WRENCH`."""
    largest = float(np.abs(wrench).max())
    if largest <= MAX_WRENCH:
        return wrench
    shortened = wrench * (MAX_WRENCH / largest)
    return np.clip(shortened, -MAX_WRENCH, MAX_WRENCH)  # but for rounding as long


def check_wrenches(wrench: ArrayLike) -> Array:
    """Returns desired wrenches (N, 6) [N, N m] as finite float64, a copy.

    Raises:
        CommandError: they are no such array of finite numbers of at most `MAX_WRENCH`.
    """
    return _wrenches(wrench, "wrench")


def check_reference(reference: ArrayLike) -> Array:
    """Returns the expected wrenches (K, 6) [N, N m] of the next K ticks, a copy.

    Raises:
        CommandError: as of `check_wrenches`.
    """
    return _wrenches(reference, "reference")


_ONE_WRENCH = "six numbers [Fx, Fy, Fz, Tx, Ty, Tz] in N and N m"
"""What is expected of one wrench, in words."""
_MANY_WRENCHES = "an array of shape (N, 6) in N and N m"
"""What is expected of many wrenches, in words."""


def _wrenches(wrenches: ArrayLike, argument: str) -> Array:
    """Checked wrenches (N, 6), which an argument of that name gave."""
    array = _numbers(wrenches, argument, _MANY_WRENCHES)
    if array.ndim != 2 or array.shape[1] != 6:
        raise _wrong_shape(argument, _MANY_WRENCHES, array)
    return _within_limit(array, argument)


def _wrong_shape(argument: str, expected: str, array: Array) -> CommandError:
    """The error of an argument whose array has another shape than is expected."""
    return CommandError(f"{argument}: expected {expected}, got an array of shape {array.shape}")


def _within_limit(wrench: Array, argument: str) -> Array:
    """Returns wrenches (..., 6) themselves; raises a `CommandError` at the first component that is
    not finite, or above `MAX_WRENCH`."""
    if _size_bound(wrench) <= MAX_WRENCH:
        return wrench
    bad = ~(np.abs(wrench) <= MAX_WRENCH)  # NaN, too
    if not bad.any():
        return wrench
    axis = AXES[int(np.argwhere(bad)[0][-1])]
    value = wrench[bad][0]
    sentence = f"{argument}: {axis} must be a number of at most {MAX_WRENCH:g} in size, got {value}"
    if not np.isfinite(value):
        sentence += f'; an axis that may take any wrench is named: free=("{axis}",)'
    raise CommandError(sentence)


def check_flow(flow: ArrayLike | None) -> Array | None:
    """Returns the velocity of the body relative to the water.

    Args:
        flow: (6,) [m/s, rad/s], body frame; None at rest.

    Returns:
        The same (6,) as finite float64, a read-only copy; None at rest.

    Raises:
        CommandError: it is not six finite numbers of at most `MAX_FLOW`.
    """
    if flow is None:
        return None
    expected = "six numbers [VX, VY, VZ, WX, WY, WZ] in m/s and rad/s, body relative to the water"
    array = _numbers(flow, "flow", expected)
    if array.shape != (6,):
        raise _wrong_shape("flow", expected, array)
    if not (np.abs(array) <= MAX_FLOW).all():
        raise CommandError(
            f"flow: each component must be finite and at most {MAX_FLOW:g} in size, got "
            f"{flow!r:.100}"
        )
    if not array.any():
        return None
    array.setflags(write=False)
    return array


def check_previous(previous: ArrayLike, layout: Layout) -> Array:
    """Returns the command of the tick before.

    Args:
        previous: (n, 3), in which lost actuators may hold NaN.
        layout: the robot of n actuators.

    Returns:
        The same (n, 3) as float64, a read-only copy.

    Raises:
        CommandError: it has another shape, or holds infinity or what is no number.
    """
    array = _numbers(previous, "previous", f"a command of shape ({layout.n}, 3)")
    # The bound is NaN where an actuator is lost: then each number is looked at.
    if not _size_bound(array) < math.inf and np.isinf(array).any():
        raise CommandError(
            "previous: expected finite commands (NaN only for lost actuators), got infinity"
        )
    if array.shape != (layout.n, 3):
        raise CommandError(
            f"previous: expected a command of shape ({layout.n}, 3) for layout {layout.name!r}, "
            f"got shape {array.shape}; pass the `command` of the last allocation"
        )
    array.setflags(write=False)
    return array


def _numbers(values: ArrayLike, argument: str, expected: str) -> Array:
    """A copy as float64 of what an argument gave, or a `CommandError` that says what was expected;
    truth values and text are no numbers, also where they could be read as such."""
    try:
        array = np.array(values)
        if array.dtype.kind not in "iufO" or _has_non_numbers(values):
            raise TypeError("no numbers")
        return array.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError) as error:
        raise CommandError(f"{argument}: expected {expected}, got {values!r:.100}") from error


def _has_non_numbers(values: object) -> bool:
    """Whether truth values or text are among numbers, in lists of any depth: numpy reads `True`
    beside numbers as 1."""
    if isinstance(values, np.ndarray):
        if values.dtype.kind == "O":
            return _has_non_numbers(values.tolist())
        return values.dtype.kind not in "iuf"
    if isinstance(values, list | tuple):
        # Most are plain numbers, and every tick asks.
        others = [value for value in values if type(value) is not float]
        return any(map(_has_non_numbers, others))
    return isinstance(values, bool | np.bool_ | str | bytes)


def _size_bound(array: Array) -> float:
    """An upper bound of the sizes of an array's numbers; NaN where one of them is and none is
    infinite."""
    if array.size <= MAX_SIZE_IN_PYTHON:
        return math.hypot(*array.ravel().tolist())
    return float(np.abs(array).max())
