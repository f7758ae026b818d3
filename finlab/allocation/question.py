"""Checks of a question: wrenches, previous commands, flow, failed and damaged actuators."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.allocation.solution import among_all
from finlab.arrays import Array
from finlab.axes import AXES, Axis, axes_in
from finlab.errors import AllocationError, CommandError
from finlab.layout import Layout
from finlab.layout.damage import WHOLE, Damage, lost_names

MAX_WRENCH = 1e6
"""Largest magnitude of a target component [N, N m]; beyond it something is wrong upstream."""

MAX_FLOW = 100.0
"""Largest magnitude of a component of the flow [m/s, rad/s]."""

FEW = 100
"""Numbers that are checked in the interpreter."""

Axes = tuple[Axis, ...]
"""Axes that a question asks for."""


class Usable(NamedTuple):
    """The actuators of a robot, and which of them an allocator may use."""

    layout: Layout
    """All of them, with the limits that damage has left."""
    damage: Damage
    healthy: Layout
    """The others."""
    alive: NDArray[np.bool_]
    """Mask (n,) of the others."""

    def among_all(self, command: Array) -> Array:
        """Commands (..., m, 3) of the healthy ones put among all n; the failed ones hold NaN."""
        return among_all(command, self.alive)


def damage_of(damage: Damage | None, lost: Sequence[str], failed: Sequence[str]) -> Damage:
    """What a question says of damage; `failed` means `lost`. Raises AllocationError: it is none, or names are
    no list."""
    if damage is None:
        known = WHOLE
    elif isinstance(damage, Damage):
        known = damage
    else:
        raise AllocationError(f"damage: expected a Damage, got {damage!r:.100}")
    if not len(lost) and not len(failed):
        return known
    more = [name for names in (lost, failed) if len(names) for name in lost_names(names)]
    return replace(known, lost=[*known.lost, *more])


def usable(layout: Layout, damage: Damage) -> Usable:
    """A robot some of whose actuators are lost or damaged. Raises LayoutError: an unknown actuator, or none
    left."""
    left = damage.applied_to(layout)
    if not damage.lost:
        return Usable(left, damage, left, np.ones(left.n, dtype=bool))
    alive = np.array([name not in set(damage.lost) for name in left.names])
    return Usable(left, damage, left.without(damage.lost), alive)


def _numbers(values: ArrayLike, name: str, expected: str) -> Array:
    """A copy of what is called `name` as float64, or a `CommandError` that says what was expected; truth
    values and text are no numbers, also where they could be read as such."""
    try:
        array = np.array(values)
        if array.dtype.kind not in "iufO" or _has_others(values):
            raise TypeError("no numbers")
        return array.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError) as error:
        raise CommandError(f"{name}: expected {expected}, got {values!r:.100}") from error


def _has_others(values: object) -> bool:
    """Whether truth values or text are among numbers, in lists of any depth: numpy reads `True` beside
    numbers as 1."""
    if isinstance(values, np.ndarray):
        return _has_others(values.tolist()) if values.dtype.kind == "O" else values.dtype.kind not in "iuf"
    if isinstance(values, list | tuple):
        # Most are plain numbers, and every tick asks.
        return any(type(value) is not float and _has_others(value) for value in values)
    return isinstance(values, bool | np.bool_ | str | bytes)


def _size(array: Array) -> float:
    """A bound of the sizes of some numbers, NaN where one of them is and none is infinite; of few numbers
    found in less time than numpy's calls take."""
    return math.hypot(*array.ravel().tolist()) if array.size <= FEW else float(np.abs(array).max())


def _wrenches(wrench: ArrayLike, name: str, single: bool) -> tuple[Array, bool]:
    """Checked wrenches, and whether each axis of them counts; see `check_wrenches`."""
    expected = "six numbers [Fx, Fy, Fz, Tx, Ty, Tz]" if single else "an array of shape (N, 6)"
    array = _numbers(wrench, name, f"{expected} in N and N m")
    if array.shape != (6,) if single else (array.ndim != 2 or array.shape[1] != 6):
        raise CommandError(f"{name}: expected {expected} in N and N m, got an array of shape {array.shape}")
    if _size(array) <= MAX_WRENCH:
        return array, True
    if (bad := np.abs(array) > MAX_WRENCH).any():
        axis = AXES[int(np.argwhere(bad)[0][-1])]
        value = array[bad][0]
        raise CommandError(
            f"{name}: {axis} must be at most {MAX_WRENCH:g} in size, or NaN where it is free, got {value}"
        )
    return array, not np.isnan(array).any()


def check_wrenches(wrench: ArrayLike) -> Array:
    """Wrenches (N, 6) as float64, a copy, NaN for an axis that does not count, or a `CommandError` that
    says what is wrong."""
    return _wrenches(wrench, "wrench", single=False)[0]


def check_reference(reference: ArrayLike) -> Array:
    """Expected wrenches (K, 6), 0 for an axis that does not count; errors as of `check_wrenches`."""
    array, whole = _wrenches(reference, "reference", single=False)
    return array if whole else np.nan_to_num(array)


def check_target(wrench: ArrayLike, layout: Layout) -> tuple[Array, Axes | None]:
    """A wrench (6,) as float64, and the axes of a robot that it asks for: None where these are all that it
    commands. Errors as of `check_wrenches`, and CommandError: there is none."""
    array, whole = _wrenches(wrench, "wrench", single=True)
    return array, None if whole else axes_of(layout, array)


def axes_of(layout: Layout, wrench: Array) -> Axes | None:
    """The axes of a robot that a wrench (6,) asks for; None where these are all that it commands. Raises
    CommandError: there is none."""
    counts = layout.commanded & ~np.isnan(wrench)
    if (counts == layout.commanded).all():
        return None
    if not counts.any():
        raise CommandError(
            f"wrench: NaN on each axis that layout {layout.name} commands ({', '.join(layout.axes)}), "
            "expected a number on one of them"
        )
    return axes_in(counts)


def same_axes(layout: Layout, wrenches: Array) -> list[tuple[Axes | None, NDArray[np.intp] | None]]:
    """Groups of wrenches (N, 6) that ask for the same axes: the axes as `axes_of` gives them, and their
    places; None for all. Raises CommandError: a wrench asks for no axis."""
    free = np.isnan(wrenches)
    if not free.any():
        return [(None, None)]
    patterns, group = np.unique(free, axis=0, return_inverse=True)
    rows = [np.flatnonzero(group.ravel() == i) for i in range(len(patterns))]
    return [(axes_of(layout, wrenches[places[0]]), places) for places in rows]


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
            f"flow: each component must be finite and at most {MAX_FLOW:g} in size, got {flow!r:.100}"
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
    """The previous command (n, 3), a copy, in which failed actuators may hold NaN."""
    array = _numbers(previous, "previous", f"a command of shape ({layout.n}, 3)")
    if not _size(array) < math.inf and np.isinf(array).any():
        raise CommandError("previous: expected finite commands (NaN only for failed fins), got infinity")
    if array.shape != (layout.n, 3):
        raise CommandError(
            f"previous: expected a command of shape ({layout.n}, 3) for layout {layout.name!r}, "
            f"got shape {array.shape}; pass the `command` of the last allocation"
        )
    return array
