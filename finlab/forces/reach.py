"""Largest attainable wrenches: along a ray, along an axis with the others fixed, and in the
weakest direction of all, within the power budget that sets of forces may have. The attainable sets,
the analyses and the app use them."""

from collections.abc import Collection, Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from finlab.arrays import Array
from finlab.axes import AXES
from finlab.display import Table, html
from finlab.display.pictures import ranges_picture
from finlab.forces.force_sets import SCALE, ForceSets, convex_parts
from finlab.forces.within_budget import force_sets_within
from finlab.layout import Layout

FINE = 1e-8
"""Gap of final results, over the strongest actuator's wrench [1]."""
COARSE = 1e-3
"""Gap of results that only begin a search, over the strongest actuator's wrench [1]."""
OFF_RAY = 1e-6
"""Largest distance of a wrench from its ray, over the strongest actuator's wrench [1]."""
CROSSED = 1e-6
"""Scaled wrench by which the ends of a range may cross, from rounding [N]."""
UNPROVEN = 1e-3
"""Gap, over the size plus one, above which a result counts as unproven [1]."""


class LargestWrenches(NamedTuple):
    """Largest scaled wrenches along R rays."""

    size: Array
    """Upper bounds of the distances from the rays' origins (R,) [N]."""
    gap: Array
    """Upper bound less the distance that forces prove (R,) [N]."""
    force: Array
    """Planar forces (R, n, 2) [N] that attain the lower bound."""
    normal: Array
    """Normal (R, m) of the plane that bounds the set of wrenches there, not normalized."""


def largest_along_rays(
    sets: ForceSets, ray: Array, origin: Array | float = 0.0, tolerance: float = FINE
) -> LargestWrenches:
    """Returns the largest scaled wrenches along rays.

    Each is bracketed: a plane bounds the set of all wrenches from outside, and forces attain a
    wrench inside.

    Args:
        sets: sets of forces of R robots.
        ray: unit directions (R, m).
        origin: points where the rays begin (R, m) [N].
        tolerance: gap at which the search ends, over the strongest actuator's wrench [1].

    Returns:
        The largest wrenches; of a ray that does not meet the set the size is minus infinity.
    """
    origin = np.broadcast_to(origin, ray.shape)
    size, normal, force = sets.reach(origin, ray, tolerance)
    displacement = sets.wrench(force) - origin
    along = (displacement * ray).sum(-1)
    # A wrench off the ray is no lower bound.
    off_ray = np.linalg.norm(displacement - along[:, None] * ray, axis=-1)
    is_on_ray = off_ray <= max(OFF_RAY, 3.0 * tolerance) * sets.unit
    lower_bound = np.where(is_on_ray, along, 0.0)
    return LargestWrenches(size, np.maximum(size - lower_bound, 0.0), force, normal)


def max_wrench_along(sets: ForceSets, direction: Array, tolerance: float = FINE) -> LargestWrenches:
    """Returns the largest wrenches along directions, exactly: all other components are zero.

    Args:
        sets: sets of forces of R robots.
        direction: unit directions (R, m).
        tolerance: gap at which the search ends, over the strongest actuator's wrench [1].

    Returns:
        The largest wrenches; size 0 where zero force is infeasible and the direction meets no
        attainable wrench.
    """
    result = largest_along_rays(sets, direction, tolerance=tolerance)
    is_unproven = (result.size < 0.0) | (result.gap > UNPROVEN * (1.0 + result.size))
    result.size[is_unproven] = 0.0
    result.gap[is_unproven] = 0.0
    return result


def max_wrench_along_exactly(sets: ForceSets, directions: Array) -> tuple[Array, float]:
    """Returns the largest wrenches along directions, with wide sectors as their convex parts; with
    too many of them, some as their hulls (see `convex_parts`).

    Args:
        sets: sets of forces of P robots.
        directions: unit directions (D, m), the same for all robots.

    Returns:
        Sizes (P, D) of scaled wrenches [N], and the largest gap of all [N].
    """
    robots = len(sets.radius)
    n_directions = len(directions)
    parts = convex_parts(sets)
    rows = np.tile(directions, (len(parts.radius), 1))
    result = max_wrench_along(parts.repeat(n_directions), rows)
    by_part = (-1, robots, n_directions)
    size = result.size.reshape(by_part).max(axis=0)
    lower_bound = (result.size - result.gap).reshape(by_part).max(axis=0)
    return size, float((size - lower_bound).max())


class Ranges(NamedTuple):
    """Attainable range of each component of a wrench, the other five being fixed; NaN where those
    five are not attainable."""

    low: Array
    """Smallest values (6,) [N, N m]."""
    high: Array
    """Largest values (6,) [N, N m]."""

    def _repr_html_(self) -> str:
        rows = []
        for axis, low, high in zip(AXES, self.low, self.high, strict=True):
            rows.append((axis, f"{low:.3f}", f"{high:.3f}"))
        table = Table(("axis", "least [N, N m]", "most [N, N m]"), rows, (True, False, False))
        return html([table], lambda: ranges_picture("each axis, the others held", AXES, *self))


def axis_ranges(
    layout: Layout,
    wrench: ArrayLike,
    lost: Collection[str] = (),
    flow: ArrayLike | None = None,
    power: object = None,
) -> Ranges:
    """Returns the attainable range of each axis, too wide by about a millionth at most.

    Args:
        layout: the robot.
        wrench: values (6,) at which the other axes are fixed [N, N m], body frame.
        lost: names of actuators that give no force.
        flow: velocity of the body relative to the water (6,), body frame [m/s, rad/s]; None at
            rest.
        power: watts of all actuators, or of buses by their names, as in
            `finlab.Allocator.allocate`; None for the budget of the layout, infinity for no limit.

    Raises:
        LayoutError: there is no actuator of a name.
        AllocationError: the power is none, or the flow drives actuators whose power is not known.
    """
    hashable_flow = None if flow is None else tuple(np.asarray(flow, np.float64).tolist())
    hashable_power = tuple(power.items()) if isinstance(power, Mapping) else power
    parts = _parts_for_axes(layout, tuple(lost), hashable_flow, hashable_power, layout.stamps)
    rays = np.concatenate([np.eye(6), -np.eye(6)])
    # Each ray begins at the fixed values of the other axes.
    origins = np.where(rays == 0.0, np.asarray(wrench, np.float64) / SCALE, 0.0)
    n_parts = len(parts.radius) // len(rays)
    result = largest_along_rays(parts, np.tile(rays, (n_parts, 1)), np.tile(origins, (n_parts, 1)))
    size = result.size.reshape(-1, 2, 6)
    # Two bounding planes that have crossed prove that the other five values are not attainable.
    is_attainable = size.sum(axis=1) >= -CROSSED
    high, low = np.where(is_attainable[:, None], size, -np.inf).max(axis=0)
    scale = np.where(is_attainable.any(axis=0), SCALE, np.nan)
    return Ranges(-low * scale + 0.0, high * scale + 0.0)


@lru_cache(maxsize=16)
def _parts_for_axes(
    layout: Layout,
    lost: tuple[str, ...],
    flow: tuple[float, ...] | None,
    power: object,
    stamps: object,
) -> ForceSets:
    """Convex parts of a robot, each repeated for both signs of all six axes; the stamps are part of
    the cache's key, and the items of a mapping are in place of it."""
    asked = dict(power) if isinstance(power, tuple) else power
    return convex_parts(force_sets_within(layout, lost, flow, asked)).repeat(12)


RANK_TOLERANCE = 1e-6
"""Share of the largest singular value below which another counts as zero."""
N_RANDOM = 24
"""Random directions from which the search for the weakest one starts, with axes and singular
vectors."""
N_STEPS = 4
"""Steps from face to face of the set of wrenches, from each start."""
N_FINE_STEPS = 20
"""Further steps from the best directions."""
N_BEST = 6
"""Directions from which the further steps start."""
MIN_SINGULAR_VALUE = 1e-9
"""Floor of the largest singular value in the test of rank [N]."""


class WeakestDirection(NamedTuple):
    """The weakest direction of the sets of wrenches of P robots, in scaled wrenches."""

    size: Array
    """Largest wrench along it (P,) [N]."""
    direction: Array
    """Unit scaled wrench (P, m)."""


def singular_values(sets: ForceSets) -> tuple[Array, Array]:
    """Returns the singular values of the matrix of full wrenches: those of each actuator's largest
    force along the axes of its plane.

    Returns:
        Singular values (P, m) [N], falling, 0 beyond the number of columns; and their directions
        (P, m, m), scaled wrenches in columns.
    """
    matrix = np.swapaxes(sets.full_effectiveness(), -1, -2)
    directions, values, _ = np.linalg.svd(matrix, full_matrices=True)
    n_missing = directions.shape[-1] - values.shape[-1]
    return np.pad(values, ((0, 0), (0, n_missing))), directions


def weakest(sets: ForceSets, n_random: int = N_RANDOM, fine: bool = True) -> WeakestDirection:
    """Returns the direction in which the largest attainable wrench is smallest, by a local search:
    every wrench of that size is attainable.

    From each start, a step finds the face of the set that the direction meets, and continues along
    the normal of that face; the smallest support of all is returned. Starts are the axes, the
    singular vectors and random directions.

    Args:
        sets: sets of forces of P robots.
        n_random: random directions among the starts.
        fine: whether the best directions are refined by further steps.
    """
    values, vectors = singular_values(sets)
    size = np.zeros(len(values))
    direction = vectors[:, :, -1].copy()
    threshold = RANK_TOLERANCE * np.maximum(values[:, 0], MIN_SINGULAR_VALUE)
    full_rank = np.flatnonzero(values[:, -1] > threshold)
    if not len(full_rank):
        return WeakestDirection(size, direction)
    m = values.shape[1]
    starts = _starts(vectors[full_rank], n_random)
    is_symmetric = (sets.sector_half_angle[full_rank] >= np.pi).all()
    if not is_symmetric or sets.polygon_offset.any():
        starts = np.concatenate([starts, -starts], axis=1)
    stages = [(N_STEPS, COARSE)]
    if fine:
        stages.append((N_FINE_STEPS, FINE))
    for n_steps, tolerance in stages:
        rows = sets.take(np.repeat(full_rank, starts.shape[1]))
        directions = starts.reshape(-1, m)
        for _ in range(n_steps):
            normal = max_wrench_along(rows, directions, tolerance).normal
            directions = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
        support = rows.farthest(directions)[0].reshape(starts.shape[:2])
        best = np.argsort(support, axis=1)[:, :N_BEST]
        starts = np.take_along_axis(directions.reshape(starts.shape), best[..., None], axis=1)
    size[full_rank] = np.maximum(support.min(axis=1), 0.0)
    direction[full_rank] = starts[:, 0]
    return WeakestDirection(size, direction)


def _starts(singular_vectors: Array, n_random: int) -> Array:
    """Unit directions (P, S, m) from which the search starts, of robots with singular vectors (P,
    m, m) in columns: the axes, seeded random directions, and the singular vectors."""
    n_robots, m, _ = singular_vectors.shape
    rng = np.random.default_rng(0)
    random_directions = rng.standard_normal((n_random, m))
    random_directions /= np.linalg.norm(random_directions, axis=-1, keepdims=True)
    common = np.concatenate([np.eye(m), random_directions])
    of_all_robots = np.broadcast_to(common, (n_robots, *common.shape))
    return np.concatenate([of_all_robots, np.swapaxes(singular_vectors, -1, -2)], axis=1)
