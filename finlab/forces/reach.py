"""The largest wrench in a given direction with nothing beside it, or with the other axes as they
are, and the weakest direction of all."""

from collections.abc import Collection
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from finlab.arrays import Array
from finlab.axes import AXES
from finlab.display import Table, html
from finlab.display.pictures import ranges_picture
from finlab.forces.force_sets import SCALE, ForceSets, convex_parts, force_sets
from finlab.layout import Layout

FINE = 1e-8
"""Gap of answers that are shown, over the strongest actuator's wrench [1]."""
COARSE = 1e-3
"""Gap of answers that only begin a search, over the same [1]."""
OFF_RAY = 1e-6
"""Most by which a wrench may miss the ray that it is to lie on, over the same [1]."""
CROSSED = 1e-6
"""Scaled wrench by which the ends of a range may cross, from rounding [N]."""
UNPROVEN = 1e-3
"""Gap, over the size plus one, above which no force counts as a proof [1]."""


class Largest(NamedTuple):
    """Largest scaled wrenches along R rays."""

    size: Array
    """Upper bounds of the distances from the rays' origins (R,) [N]."""
    gap: Array
    """Upper bound less the distance that forces prove (R,) [N]."""
    force: Array
    """Planar forces (R, n, 2) [N] that prove it."""
    normal: Array
    """Normal (R, m) of the plane that bounds the set of wrenches there, not normalized."""


def largest(
    sets: ForceSets, ray: Array, origin: Array | float = 0.0, close: float = FINE
) -> Largest:
    """Returns the largest scaled wrenches along rays.

    Each is bracketed: a plane bounds the set of all wrenches from outside, and forces lie inside.

    Args:
        sets: sets of forces of R robots.
        ray: unit directions (R, m).
        origin: points where the rays begin (R, m) [N].
        close: gap at which the search ends, over the strongest actuator's wrench [1].

    Returns:
        The largest wrenches; of a ray that does not meet the set the size is minus infinity.
    """
    origin = np.broadcast_to(origin, ray.shape)
    size, normal, force = sets.reach(origin, ray, close)
    wrench = sets.wrench(force)
    along = ((wrench - origin) * ray).sum(-1)
    # A wrench off the ray proves nothing.
    off_ray = np.linalg.norm(wrench - origin - along[:, None] * ray, axis=-1)
    proven = np.where(off_ray <= max(OFF_RAY, 3.0 * close) * sets.unit, along, 0.0)
    return Largest(size, np.maximum(size - proven, 0.0), force, normal)


def max_wrench_along(sets: ForceSets, direction: Array, close: float = FINE) -> Largest:
    """Returns the largest wrenches that point exactly along unit `direction` (R, m), all else zero;
    none where rest is out of reach and the direction meets nothing."""
    result = largest(sets, direction, close=close)
    is_unproven = (result.size < 0.0) | (result.gap > UNPROVEN * (1.0 + result.size))
    result.size[is_unproven] = 0.0
    result.gap[is_unproven] = 0.0
    return result


def max_wrench_along_exactly(sets: ForceSets, directions: Array) -> tuple[Array, float]:
    """Returns the largest wrenches (P, D) of robots (P) along unit `directions` (D, 6), and the
    largest gap. Wide sectors count as their convex parts, with too many of them some as hulls, see
    `convex_parts`."""
    robots = len(sets.radius)
    n = len(directions)
    parts = convex_parts(sets)
    result = max_wrench_along(parts.repeat(n), np.tile(directions, (len(parts.radius), 1)))
    size, proven = (
        v.reshape(-1, robots, n).max(axis=0) for v in (result.size, result.size - result.gap)
    )
    return size, float((size - proven).max())


class Ranges(NamedTuple):
    """What each component of a wrench may be, the other five held; NaN where those five are out of
    reach."""

    low: Array
    """Smallest values (6,) [N, N m]."""
    high: Array
    """Largest values (6,) [N, N m]."""

    def _repr_html_(self) -> str:
        rows = [(axis, f"{a:.3f}", f"{b:.3f}") for axis, a, b in zip(AXES, *self, strict=True)]
        table = Table(("axis", "least [N, N m]", "most [N, N m]"), rows, (True, False, False))
        return html([table], lambda: ranges_picture("each axis, the others held", AXES, *self))


def axis_ranges(
    layout: Layout, wrench: ArrayLike, lost: Collection[str] = (), flow: ArrayLike | None = None
) -> Ranges:
    """Returns the range of each axis with the others held as in a wrench (6,) [N, N m], too wide by
    about a millionth at most; `lost`, `flow` and errors are as for `force_sets`."""
    water = None if flow is None else tuple(np.asarray(flow, np.float64).tolist())
    parts = _parts(layout, tuple(lost), water, layout.stamps)
    axes = np.concatenate([np.eye(6), -np.eye(6)])
    held = np.where(axes == 0.0, np.asarray(wrench, np.float64) / SCALE, 0.0)
    count = len(parts.radius) // len(axes)
    rays = np.tile(axes, (count, 1))
    origins = np.tile(held, (count, 1))
    size = largest(parts, rays, origins).size.reshape(-1, 2, 6)
    # Planes that leave nothing between them prove that the five others cannot be had together.
    there = size.sum(axis=1) >= -CROSSED
    high, low = np.where(there[:, None], size, -np.inf).max(axis=0)
    scale = np.where(there.any(axis=0), SCALE, np.nan)
    return Ranges(-low * scale + 0.0, high * scale + 0.0)


@lru_cache(maxsize=16)
def _parts(
    layout: Layout, lost: tuple[str, ...], flow: tuple[float, ...] | None, stamps: object
) -> ForceSets:
    """Convex parts of a robot, each for both ways along all axes."""
    return convex_parts(force_sets(layout, lost, flow)).repeat(12)


RANK_TOLERANCE = 1e-6
"""Share of the largest singular value below which another counts as zero."""
N_RANDOM = 24
"""Random directions from which the weakest one is sought, beside axes and singular vectors."""
N_WALKS = 4
"""Steps from face to face of the set of wrenches."""
FINE_WALKS = 20
"""Further steps from the best ends."""
KEPT = 6
"""Ends from which these begin."""


class Extent(NamedTuple):
    """The weakest direction of the sets of wrenches of P robots, in scaled wrenches."""

    size: Array
    """(P,) [N]."""
    direction: Array
    """Unit scaled wrench (P, m)."""


def singular_values(sets: ForceSets) -> tuple[Array, Array]:
    """Returns singular values (P, m) [N], falling, and their directions (P, m, m), in columns, of
    the wrenches of each one's largest force along the axes of its plane."""
    matrix = np.swapaxes(sets.full_effectiveness(), -1, -2)
    directions, values, _ = np.linalg.svd(matrix, full_matrices=True)
    return np.pad(values, ((0, 0), (0, directions.shape[-1] - values.shape[-1]))), directions


def weakest(sets: ForceSets, n_random: int = N_RANDOM, fine: bool = True) -> Extent:
    """Returns the direction in which the sets of wrenches end soonest, and where: every wrench of
    that size is within reach. The walk starts from axes, singular vectors and random directions,
    goes to the face of the set that lies that way, turns to its normal and goes again; the least
    end of all is returned."""
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
    if (
        sets.sector_half_angle[full] < np.pi
    ).any() or sets.polygon_offset.any():  # else opposite directions are alike
        starts = np.concatenate([starts, -starts], axis=1)
    for walks, close in ((N_WALKS, COARSE), (FINE_WALKS, FINE))[: 2 if fine else 1]:
        rows = sets.take(np.repeat(full, starts.shape[1]))
        ends = starts.reshape(-1, axes)
        for _ in range(walks):
            normal = max_wrench_along(rows, ends, close).normal
            ends = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
        reach = rows.farthest(ends)[0].reshape(starts.shape[:2])
        best = np.argsort(reach, axis=1)[:, :KEPT]
        starts = np.take_along_axis(ends.reshape(starts.shape), best[..., None], axis=1)
    size[full] = np.maximum(reach.min(axis=1), 0.0)
    direction[full] = starts[:, 0]
    return Extent(size, direction)
