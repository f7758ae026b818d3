"""Checks of a question: wrenches, previous commands, flow, lost and damaged actuators."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.allocation.solution import among_all
from finlab.arrays import Array
from finlab.axes import AXES, mask_of
from finlab.errors import AllocationError, CommandError
from finlab.layout.damage import WHOLE, Damage, lost_names
from finlab.layout.layout import Layout

MAX_WRENCH = 1e6
"""Largest magnitude of a target component [N, N m]; beyond it something is wrong upstream."""

MAX_FLOW = 100.0
"""Largest magnitude of a component of the flow [m/s, rad/s]."""

FEW = 100
"""Numbers that are checked in the interpreter."""


@dataclass(frozen=True, eq=False)
class Usable:
    """The actuators of a robot, and which of them an allocator may use."""

    layout: Layout
    """All of them, with the limits that damage has left."""
    damage: Damage
    """What is known of those that are damaged."""
    alive: NDArray[np.bool_]
    """Mask (n,) of those that work."""

    @cached_property
    def healthy(self) -> Layout:
        """The robot of those that work alone."""
        return self.layout.without(self.damage.lost) if self.damage.lost else self.layout

    @property
    def lost(self) -> NDArray[np.bool_] | None:
        """Mask (n,) of those that do not work; None where all do."""
        return ~self.alive if self.damage.lost else None

    def among_all(self, command: Array) -> Array:
        """Commands (..., m, 3) of the healthy ones put among all n; the lost ones hold NaN."""
        return among_all(command, self.alive)


def damage_of(damage: Damage | None, lost: Sequence[str]) -> Damage:
    """What a question says of damage: `lost` actuators and those that `damage` names.

    Raises:
        AllocationError: `damage` is no `Damage`, or `lost` is no list of names.
    """
    if damage is None:
        known = WHOLE
    elif isinstance(damage, Damage):
        known = damage
    else:
        raise AllocationError(f"damage: expected a Damage, got {damage!r:.100}")
    if not len(lost):
        return known
    return replace(known, lost=[*known.lost, *lost_names(lost)])


def usable(layout: Layout, damage: Damage) -> Usable:
    """A robot some of whose actuators are lost or damaged. Raises LayoutError: an unknown actuator,
    or none left."""
    left = damage.applied_to(layout)
    lost = set(damage.lost)
    alive = np.array([name not in lost for name in left.names])
    if lost and (not alive.any() or len(lost) > left.n - int(alive.sum())):
        left.without(damage.lost, "lost")  # says what is wrong
    return Usable(left, damage, alive)


def _numbers(values: ArrayLike, name: str, expected: str) -> Array:
    """A copy of what is called `name` as float64, or a `CommandError` that says what was expected;
    truth values and text are no numbers, also where they could be read as such."""
    try:
        array = np.array(values)
        if array.dtype.kind not in "iufO" or _has_others(values):
            raise TypeError("no numbers")
        return array.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError) as error:
        raise CommandError(f"{name}: expected {expected}, got {values!r:.100}") from error


def _has_others(values: object) -> bool:
    """Whether truth values or text are among numbers, in lists of any depth: numpy reads `True`
    beside numbers as 1."""
    if isinstance(values, np.ndarray):
        return (
            _has_others(values.tolist())
            if values.dtype.kind == "O"
            else values.dtype.kind not in "iuf"
        )
    if isinstance(values, list | tuple):
        # Most are plain numbers, and every tick asks.
        others = [value for value in values if type(value) is not float]
        return any(map(_has_others, others))
    return isinstance(values, bool | np.bool_ | str | bytes)


def _size(array: Array) -> float:
    """A bound of the sizes of some numbers, NaN where one of them is and none is infinite; of few
    numbers found in less time than numpy's calls take."""
    return math.hypot(*array.ravel().tolist()) if array.size <= FEW else float(np.abs(array).max())


def _wrenches(wrench: ArrayLike, name: str, single: bool) -> Array:
    """Checked wrenches; see `check_wrenches`."""
    expected = "six numbers [Fx, Fy, Fz, Tx, Ty, Tz]" if single else "an array of shape (N, 6)"
    array = _numbers(wrench, name, f"{expected} in N and N m")
    if array.shape != (6,) if single else (array.ndim != 2 or array.shape[1] != 6):
        raise CommandError(
            f"{name}: expected {expected} in N and N m, got an array of shape {array.shape}"
        )
    if _size(array) <= MAX_WRENCH:
        return array
    bad = ~(np.abs(array) <= MAX_WRENCH)
    if bad.any():
        axis = AXES[int(np.argwhere(bad)[0][-1])]
        value = array[bad][0]
        sentence = f"{name}: {axis} must be a number of at most {MAX_WRENCH:g} in size, got {value}"
        if not np.isfinite(value):
            sentence += f'; an axis that may take any wrench is named: free=("{axis}",)'
        raise CommandError(sentence)
    return array


def check_wrenches(wrench: ArrayLike) -> Array:
    """Wrenches (N, 6) as finite float64, a copy, or a `CommandError` that says what is wrong."""
    return _wrenches(wrench, "wrench", single=False)


def check_reference(reference: ArrayLike) -> Array:
    """Expected wrenches (K, 6); errors as of `check_wrenches`."""
    return _wrenches(reference, "reference", single=False)


def check_target(wrench: ArrayLike) -> Array:
    """A wrench (6,) as finite float64, a copy; errors as of `check_wrenches`."""
    return _wrenches(wrench, "wrench", single=True)


def free_mask(layout: Layout, free: Sequence[str]) -> NDArray[np.bool_] | None:
    """Returns a mask (6,) of axes that are free for one question; None where there are none.

    Args:
        layout: the robot.
        free: their names, such as `("Ty",)`.

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
            f"({', '.join(layout.axes)}), expected "
            "one of them to be left"
        )
    return mask


def check_flow(flow: ArrayLike | None) -> Array | None:
    """The velocity (6,) of the body relative to the water as finite float64; None at rest, or a
    `CommandError` that says what is wrong."""
    if flow is None:
        return None
    expected = "six numbers [VX, VY, VZ, WX, WY, WZ] in m/s and rad/s, body relative to the water"
    array = _numbers(flow, "flow", expected)
    if array.shape != (6,):
        raise CommandError(f"flow: expected {expected}, got an array of shape {array.shape}")
    if not (np.abs(array) <= MAX_FLOW).all():
        raise CommandError(
            f"flow: each component must be finite and at most {MAX_FLOW:g} in size, got "
            f"{flow!r:.100}"
        )
    return array if array.any() else None


def check_layout(layout: object) -> None:
    """Refuses what is no layout."""
    if not isinstance(layout, Layout):
        raise AllocationError(
            f"layout: expected a Layout, got {layout!r:.60}; read a file with finlab.load_layout"
        )


def check_seed(seed: object) -> None:
    """Refuses seeds that are no whole number from 0."""
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise AllocationError(f"seed: expected a whole number from 0, got {seed!r}")


def check_previous(previous: ArrayLike, layout: Layout) -> Array:
    """The previous command (n, 3), a copy, in which lost actuators may hold NaN."""
    array = _numbers(previous, "previous", f"a command of shape ({layout.n}, 3)")
    if not _size(array) < math.inf and np.isinf(array).any():
        raise CommandError(
            "previous: expected finite commands (NaN only for lost fins), got infinity"
        )
    if array.shape != (layout.n, 3):
        raise CommandError(
            f"previous: expected a command of shape ({layout.n}, 3) for layout {layout.name!r}, "
            f"got shape {array.shape}; pass the `command` of the last allocation"
        )
    return array
