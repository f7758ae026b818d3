"""The largest wrench in a given direction with nothing beside it, or with the other axes as they are, and the
weakest direction of all."""

from collections.abc import Collection
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from finlab.arrays import Array
from finlab.axes import AXES
from finlab.display.blocks import Table, html
from finlab.display.pictures import ranges_picture
from finlab.forces.force_sets import SCALE, ForceSets, convex_parts, force_sets
from finlab.forces.interior_point import minimize
from finlab.layout import Layout

HELD = 1e-12
"""What the squared error of an entry that must be met is divided by, beside one that is free to grow."""
BEYOND = 2.0
"""How much more than all actuators could give along a direction alone is asked for."""
FINE, COARSE = 1e-9, 1e-4
"""Where the solver stops: for results to be shown, and for searches that ask thousands of times."""
BESIDE = 1e-6
"""Scaled wrench that may be left beside the one asked for, as a share of the strongest actuator's."""
UNPROVEN = 1e-3
"""Gap, as a share of the size plus one, from which no force counts as found."""


class Largest(NamedTuple):
    """Largest scaled wrenches of R questions."""

    size: Array
    """How much the actuators can give (R,) [N]; proven to be no less than the truth."""
    gap: Array
    """The truth is at most this much smaller (R,) [N]."""
    force: Array
    """Planar forces (R, n, 2) [N] that give it."""
    wrench: Array
    """Their scaled wrench (R, 6)."""
    normal: Array
    """Direction (R, 6) of the plane that touches the set of wrenches there, not normalized."""


def largest(
    sets: ForceSets, origin: Array, basis: Array, held: Array | float = 0.0, tolerance: float = FINE
) -> Largest:
    """Returns the largest wrenches along unit `origin` (R, 6) whose parts along an orthonormal `basis` (R, 6,
    k) across it are `held` (R, k).

    Each is bracketed: a plane across the solver's multiplier lies outside of the set of all wrenches, and its
    forces lie inside. `tolerance` is as `FINE`.
    """
    rows, _, k = basis.shape
    frame = np.concatenate([origin[:, :, None], basis], axis=-1)
    seen = sets._replace(effectiveness=sets.effectiveness @ frame[:, None])
    wanted = np.empty((rows, 1 + k))
    wanted[:, 1:] = held
    full = np.sqrt((seen.full_effectiveness() ** 2).sum(-1))
    wanted[:, 0] = np.maximum(BEYOND * full.sum(-1), 1e-9) + np.abs(sets.offset).sum(-1)
    force, multiplier = minimize(seen, wanted, np.array([1.0, *(HELD,) * k]), tolerance)
    lead = multiplier[:, :1]
    across = np.tile(np.eye(1 + k)[0], (rows, 1))
    normal = np.where(lead > 0.0, multiplier, across) / np.where(lead > 0.0, lead, 1.0)
    size = seen.farthest(normal)[0] - (wanted[:, 1:] * normal[:, 1:]).sum(-1)
    # The plane across the direction itself proves something, too, should the solver's prove less.
    free = seen.farthest(across)[0]
    normal = np.where((free < size)[:, None], across, normal)
    size = np.minimum(size, free)
    actual = seen.wrench(force)
    # A wrench that is not where it was asked for proves nothing.
    extra = np.abs(actual - wanted)[:, 1:].max(-1, initial=0.0)
    proven = np.where(extra <= BESIDE * full.max(-1), actual[:, 0], 0.0)
    return Largest(
        size, np.maximum(size - proven, 0.0), force, sets.wrench(force), (frame @ normal[..., None])[..., 0]
    )


def max_wrench_along(sets: ForceSets, direction: Array, tolerance: float = FINE) -> Largest:
    """Returns the largest wrenches that point exactly along unit `direction` (R, m), all else zero."""
    result = largest(sets, direction, orthogonal_complement(direction), tolerance=tolerance)
    if sets.center is not None:  # where rest is out of reach, a direction may meet nothing at all
        unmet = (result.size < 0.0) | (result.gap > UNPROVEN * (1.0 + result.size))
        result.size[unmet] = result.gap[unmet] = 0.0
    return result


def max_wrench_along_exactly(sets: ForceSets, directions: Array) -> tuple[Array, float]:
    """Returns the largest wrenches (P, D) of robots (P) along unit `directions` (D, 6), and the largest gap.
    Wide sectors count as their convex parts, with too many of them some as hulls, see `convex_parts`."""
    robots, n = len(sets.radius), len(directions)
    parts = convex_parts(sets)
    result = max_wrench_along(parts.repeat(n), np.tile(directions, (len(parts.radius), 1)))
    size, proven = (v.reshape(-1, robots, n).max(axis=0) for v in (result.size, result.size - result.gap))
    return size, float((size - proven).max())


def orthogonal_complement(direction: Array) -> Array:
    """Returns an orthonormal basis (R, m, m - 1) of what is at right angles to unit `direction` (R, m)."""
    return np.asarray(np.linalg.qr(direction[..., None], mode="complete").Q[..., 1:])


TOLERANCE = 1e-6
"""Where the solver stops: good for a mark on a scale, in a millisecond."""


NOTHING = 1e-6
"""Scaled wrench [N] by which the ends of a range may pass each other and it still is one."""


class Ranges(NamedTuple):
    """What each component of a wrench may be, the other five held; NaN where those five are out of reach."""

    low: Array
    """Smallest values (6,) [N, N m]."""
    high: Array
    """Largest values (6,) [N, N m]."""

    def _repr_html_(self) -> str:
        rows = [(axis, f"{a:.3f}", f"{b:.3f}") for axis, a, b in zip(AXES, *self, strict=True)]
        table = Table(("axis", "least [N, N m]", "most [N, N m]"), rows, (True, False, False))
        return html([table], lambda: ranges_picture("each axis, the others held", AXES, *self))


def axis_ranges(
    layout: Layout, wrench: ArrayLike, failed: Collection[str] = (), flow: ArrayLike | None = None
) -> Ranges:
    """Returns the range of each axis with the others held as in a wrench (6,) [N, N m], too wide by about a
    millionth at most; `failed`, `flow` and errors are as for `force_sets`."""
    water = None if flow is None else tuple(np.asarray(flow, np.float64).tolist())
    parts, axes, basis = _parts(layout, tuple(failed), water, layout.stamps)
    n_parts = len(parts.radius) // 12
    held = (np.asarray(wrench, dtype=np.float64) / SCALE) @ basis
    origin, bases = np.tile(axes, (n_parts, 1)), np.tile(basis, (n_parts, 1, 1))
    size = largest(parts, origin, bases, np.tile(held, (n_parts, 1)), TOLERANCE).size.reshape(n_parts, 2, 6)
    # Planes that leave nothing between them prove that the five others cannot be had together.
    there = size.sum(axis=1) >= -NOTHING
    high, low = np.where(there[:, None], size, -np.inf).max(axis=0)
    return Ranges(*[np.where(there.any(axis=0), value * SCALE, np.nan) + 0.0 for value in (-low, high)])


@lru_cache(maxsize=16)
def _parts(
    layout: Layout, failed: tuple[str, ...], flow: tuple[float, ...] | None, stamps: object
) -> tuple[ForceSets, Array, Array]:
    """Convex parts of a robot, each for both ways along all axes, with these (12, 6) and what is across."""
    axes = np.concatenate([np.eye(6), -np.eye(6)])
    sets = convex_parts(force_sets(layout, failed, flow)).repeat(len(axes))
    return sets, axes, orthogonal_complement(axes)


RANK_TOLERANCE = 1e-6
"""Share of the largest singular value below which another counts as zero."""
N_RANDOM = 24
"""Random directions from which the weakest one is sought, beside axes and singular vectors."""
N_WALKS = 6
"""Steps from face to face of the set of wrenches."""


class Extent(NamedTuple):
    """The weakest direction of the sets of wrenches of P robots, in scaled wrenches."""

    size: Array
    """(P,) [N]."""
    direction: Array
    """Unit scaled wrench (P, m)."""


def singular_values(sets: ForceSets) -> tuple[Array, Array]:
    """Returns singular values (P, m) [N], falling, and their directions (P, m, m), in columns, of the
    wrenches of each one's largest force along the axes of its plane."""
    matrix = np.swapaxes(sets.full_effectiveness(), -1, -2)
    directions, values, _ = np.linalg.svd(matrix, full_matrices=True)
    return np.pad(values, ((0, 0), (0, directions.shape[-1] - values.shape[-1]))), directions


def weakest(sets: ForceSets, n_random: int = N_RANDOM, n_walks: int = N_WALKS, fine: bool = True) -> Extent:
    """Returns the direction in which the sets of wrenches end soonest, and where: every wrench of that size
    is within reach. The walk starts from axes, singular vectors and random directions, goes to the face of
    the set that lies that way, turns to its normal and goes again; the least end of all is returned."""
    values, vectors = singular_values(sets)
    size = np.zeros(len(values))
    direction = vectors[:, :, -1].copy()
    full = np.flatnonzero(values[:, -1] > RANK_TOLERANCE * np.maximum(values[:, 0], 1e-9))
    if not len(full):
        return Extent(size, direction)
    rng = np.random.default_rng(0)
    axes = values.shape[1]
    drawn = rng.standard_normal((n_random, axes))
    drawn /= np.linalg.norm(drawn, axis=-1, keepdims=True)
    common = np.concatenate([np.eye(axes), drawn])
    of_robot = np.swapaxes(vectors[full], -1, -2)
    starts = np.concatenate([np.broadcast_to(common, (len(full), *common.shape)), of_robot], axis=1)
    if (sets.half[full] < np.pi).any() or sets.center is not None:  # else opposite directions are alike
        starts = np.concatenate([starts, -starts], axis=1)
    n_starts = starts.shape[1]
    rows = sets.take(np.repeat(full, n_starts))
    ends = starts.reshape(-1, axes)
    for walk in range(n_walks):
        last = fine and walk == n_walks - 1
        normal = max_wrench_along(rows, ends, FINE if last else COARSE).normal
        ends = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    reach = rows.farthest(ends)[0].reshape(len(full), n_starts)
    best = reach.argmin(axis=1)
    size[full] = np.maximum(reach[np.arange(len(full)), best], 0.0)
    direction[full] = ends.reshape(len(full), n_starts, axes)[np.arange(len(full)), best]
    return Extent(size, direction)
