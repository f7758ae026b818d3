"""Axes along which the actuators can push, how evenly, and what the loss of each one costs."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from finlab.arrays import Array
from finlab.axes import AXES as WRENCH
from finlab.axes import MOTIONS, Axis, MotionAxis
from finlab.errors import LayoutError
from finlab.forces.force_sets import SCALE, ForceSets, force_sets
from finlab.forces.reach import RANK_TOLERANCE, max_wrench_along_exactly, singular_values, weakest
from finlab.forces.within_budget import counted_power, force_sets_within
from finlab.layout import Layout

AXES = MOTIONS
"""Names of the axes in what is said of a layout."""
NEGLIGIBLE_SIZE = 1e-4
"""Largest wrench [N, scaled] below which an axis counts as out of reach; the solver is exact to
about 1e-5."""


@dataclass(frozen=True)
class HeldAxes:
    """Axes along which actuators can push, before any limit. Torques are scaled by the lever
    0.2 m."""

    rank: int
    """Rank of the effectiveness matrix in the axes that count."""
    condition: float | None
    """Largest over smallest singular value; None below the rank of all axes that count."""
    free: tuple[MotionAxis, ...]
    """Axes that the robot does not command, which do not count."""
    without_authority: tuple[MotionAxis, ...]
    """Axes that are commanded and that no actuator pushes at all."""
    coupled: tuple[MotionAxis, ...]
    """Axes that are pushed, but never without pushing others, too."""

    @property
    def alone(self) -> tuple[MotionAxis, ...]:
        """Axes that can be pushed alone."""
        return tuple(
            axis for axis in AXES if axis not in self.free + self.without_authority + self.coupled
        )

    @property
    def counted(self) -> int:
        """How many axes count."""
        return len(AXES) - len(self.free)


@dataclass(frozen=True)
class Authority(HeldAxes):
    """Axes along which actuators can push, and how far within their limits."""

    singular_values: tuple[float, ...]
    """Of the matrix whose columns are the actuators' scaled wrenches at full thrust [N], falling;
    as many as axes count."""
    largest: tuple[float, ...]
    """Largest wrench along each axis with the other five at zero (6,) [N, N m], within the power
    budget that the layout may have."""
    most_negative: tuple[float, ...]
    """The same along the negative axes, as a size (6,) [N, N m]."""
    weakest: float
    """Scaled wrench [N] that is within reach in every direction of the axes that count, within that
    budget; 0 below that rank."""
    weakest_direction: tuple[float, ...]
    """Unit scaled wrench (6,) along which no more than `weakest` can be had."""

    @property
    def reachable(self) -> tuple[MotionAxis, ...]:
        """Axes along which something can be had both ways with the other five at zero."""
        sizes = np.array([self.largest, self.most_negative]) / SCALE
        return _reached(sizes.ravel())


@dataclass(frozen=True)
class Loss:
    """The cost of the loss of one actuator."""

    actuator: str
    """Its name."""
    rank: int
    """Rank that is left."""
    reachable: tuple[MotionAxis, ...]
    """Axes that are still reachable alone."""
    lost: tuple[MotionAxis, ...]
    """Axes that were reachable alone and no longer are."""
    share_left: tuple[float | None, ...]
    """Share of the largest wrench along each axis that is left (6,), the smaller of both signs;
    None where there was nothing."""
    weakest: float
    """Scaled wrench [N] that is within reach in every direction afterwards."""


def authority(
    layout: Layout, lost: Collection[str] = (), flow: ArrayLike | None = None
) -> Authority:
    """Returns the authority of the working actuators; arguments and errors as for `losses`.

    The power budget of the layout counts but where the flow drives actuators, see
    `finlab.forces.within_budget.counts_budget`.
    """
    return _authorities(layout, [lost], flow)[0]


def losses(
    layout: Layout,
    lost: Collection[str] = (),
    before: Authority | None = None,
    flow: ArrayLike | None = None,
) -> tuple[Loss, ...]:
    """Returns the cost of the loss of each working actuator; none when only one is left.

    Args:
        layout: the layout.
        lost: actuators that are lost already.
        before: the authority of the others, where it is known.
        flow: velocity (6,) of the body relative to the water [m/s, rad/s], body frame; None at
            rest.

    Raises:
        LayoutError: there is no actuator of a name in `lost`.
    """
    present = authority(layout, lost, flow) if before is None else before
    working = [name for name in layout.names if name not in lost]
    if len(working) < 2:
        return ()
    after_losses = _authorities(layout, [(*lost, name) for name in working], flow)
    return tuple(
        _loss(present, name, after) for name, after in zip(working, after_losses, strict=True)
    )


def _authorities(
    layout: Layout, failures: Sequence[Collection[str]], flow: ArrayLike | None
) -> list[Authority]:
    """The authority after each of several losses; one call for all is quicker than many."""
    sets = _sets_after(layout, failures, flow)
    counted_rows = np.flatnonzero(layout.commanded)
    counting = sets.along(counted_rows)
    values, vectors = singular_values(counting)
    held_of = [_held(commanded_axes(layout), *pair) for pair in zip(values, vectors, strict=True)]
    size = _largest_sizes(sets, held_of, layout, flow)
    least = weakest(counting)
    direction = np.zeros((len(failures), 6))
    direction[:, counted_rows] = least.direction
    return [
        Authority(
            **vars(held_of[k]),
            singular_values=tuple(values[k].tolist()),
            largest=tuple((size[k, :6] * SCALE).tolist()),
            most_negative=tuple((size[k, 6:] * SCALE).tolist()),
            weakest=float(least.size[k]),
            weakest_direction=tuple((direction[k] + 0.0).tolist()),
        )
        for k in range(len(failures))
    ]


def _sets_after(
    layout: Layout, failures: Sequence[Collection[str]], flow: ArrayLike | None
) -> ForceSets:
    """Feasible forces after each of several losses, within the layout's power budget where one is
    counted."""
    sets = force_sets_within(layout, flow=flow, power=counted_power(layout, flow))
    sets = sets.tile(len(failures))
    for row, lost in enumerate(failures):
        sets.lose(row, list(layout.indices(tuple(lost), "lost")))
    return sets


def reach_alone(layout: Layout, lost: Collection[str] = (), flow: ArrayLike | None = None) -> Array:
    """Returns the largest wrench (2, 6) [N, N m] along each axis, and against it, with the other
    five at zero, as `largest` and `most_negative` of `Authority`; arguments and errors as for
    `losses`."""
    sets = _sets_after(layout, [lost], flow)
    size = _largest_sizes(sets, held_axes(layout, sets), layout, flow)
    return np.asarray(size.reshape(2, 6) * SCALE)


def reachable_axes(
    layout: Layout, failures: Sequence[Collection[str]], flow: ArrayLike | None = None
) -> list[tuple[MotionAxis, ...]]:
    """Returns the axes that are reachable alone, as those of `Authority`, after each of several
    losses.

    Args:
        layout: the layout.
        failures: for each case the names of the actuators that are lost.
        flow: as for `losses`.

    Raises:
        LayoutError: there is no actuator of a name in `failures`.
    """
    sets = force_sets(layout, flow=flow).tile(len(failures))
    for row, lost in enumerate(failures):
        sets.lose(row, list(layout.indices(tuple(lost), "lost")))
    sizes = _largest_sizes(sets, held_axes(layout, sets), layout, flow)
    return [_reached(size) for size in sizes]


def _largest_sizes(
    sets: ForceSets, held_of: Sequence[HeldAxes], layout: Layout, flow: ArrayLike | None
) -> Array:
    """Largest scaled wrenches (P, 12) [N] of P variants of a layout along the axes, and against
    them, with the other five at zero; 0 where negligible."""
    axes = np.concatenate([np.eye(6), -np.eye(6)])
    size, _ = max_wrench_along_exactly(sets, axes)
    if flow is not None and layout.flow_driven:
        # The hull of a rudder's lift and drag has drag without lift, which pushes alone what
        # nothing does.
        pushed_alone = np.array([[axis in held.alone for axis in AXES] for held in held_of])
        size = np.where(np.tile(pushed_alone, 2), size, 0.0)
    return np.where(size > NEGLIGIBLE_SIZE, size, 0.0)


def _reached(sizes: Array) -> tuple[MotionAxis, ...]:
    """The axes along which something can be had both ways, by scaled sizes (12,) [N]: along the
    axes, and against them."""
    is_reached = np.minimum(sizes[:6], sizes[6:]) > NEGLIGIBLE_SIZE
    return tuple(axis for axis, reached in zip(AXES, is_reached, strict=True) if reached)


def commanded_axes(layout: Layout) -> tuple[MotionAxis, ...]:
    """Returns those of `AXES` that a robot commands."""
    return tuple(axis for axis, counts in zip(AXES, layout.commanded, strict=True) if counts)


def named_axes(names: Sequence[MotionAxis]) -> tuple[Axis, ...]:
    """Returns the axes of a wrench for some of `AXES`, each once and in order.

    Raises:
        LayoutError: there is none, or one of another name.
    """
    wrong = [name for name in names if name not in AXES]
    if wrong or not names:
        raise LayoutError(
            f"axes: expected some of {', '.join(AXES)}, got {', '.join(wrong) or 'none'}"
        )
    return tuple(axis for axis, name in zip(WRENCH, AXES, strict=True) if name in names)


def held_axes(layout: Layout, sets: ForceSets) -> list[HeldAxes]:
    """Returns the axes along which the sets of variants of a layout can push, of those that it
    commands."""
    axes = commanded_axes(layout)
    values, vectors = singular_values(sets.along(np.flatnonzero(layout.commanded)))
    return [_held(axes, *pair) for pair in zip(values, vectors, strict=True)]


def _held(axes: tuple[MotionAxis, ...], values: Array, vectors: Array) -> HeldAxes:
    """The axes that can be pushed, by singular values (m,), falling, and left singular vectors
    (m, m) of m axes."""
    is_held = values > RANK_TOLERANCE * max(values[0], 1e-9)
    # The share of each axis that lies in the span of all wrenches: 1 where it can be pushed alone.
    share = np.linalg.norm(vectors[:, is_held], axis=1)
    pushed = share > RANK_TOLERANCE
    coupled = pushed & (share <= 1.0 - RANK_TOLERANCE)
    return HeldAxes(
        rank=int(is_held.sum()),
        condition=float(values[0] / values[-1]) if is_held.all() else None,
        free=tuple(axis for axis in AXES if axis not in axes),
        without_authority=tuple(np.array(axes)[~pushed].tolist()),
        coupled=tuple(np.array(axes)[coupled].tolist()),
    )


def _loss(before: Authority, name: str, after: Authority) -> Loss:
    """The cost of the loss of an actuator by the authority before and after it."""
    largest_before = np.array([before.largest, before.most_negative])
    largest_after = np.array([after.largest, after.most_negative])
    share = np.where(
        largest_before > 0.0,
        largest_after / np.where(largest_before > 0.0, largest_before, 1.0),
        np.inf,
    ).min(axis=0)
    return Loss(
        actuator=name,
        rank=after.rank,
        reachable=after.reachable,
        lost=tuple(axis for axis in before.reachable if axis not in after.reachable),
        share_left=tuple(None if np.isinf(value) else float(min(value, 1.0)) for value in share),
        weakest=after.weakest,
    )
