"""The forces, or torques, that a layout can give, as a body to be drawn: a convex hull of
wrenches."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from itertools import count, product
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

from finlab.arrays import Array
from finlab.display import Table, html
from finlab.display.pictures import body_picture
from finlab.forces.force_sets import SCALE, ForceSets, convex_parts, force_sets
from finlab.forces.reach import UNPROVEN, largest
from finlab.layout import Layout

FLAT = 1e-5
"""Thickness, as a share of the size, below which a hull counts as flat."""


WrenchHalf = Literal["force", "torque"]

MAX_ROUNDS = 8
SPECK = 1e-5
"""Share of the sum of all thrusts below which a point counts as the origin; the solver is no more
exact."""
TOLERANCE = 0.01
"""Gap at which no more directions are added, as a share of the farthest vertex."""


@dataclass(frozen=True, eq=False)
class AttainableSet:
    """A convex polytope of forces or torques that can be had with all else at zero, body frame [N]
    or [N m]. Every vertex is attained, of wide arcs and forces of a flow by convex hulls."""

    kind: WrenchHalf
    vertices: Array
    """Corners (V, 3)."""
    faces: NDArray[np.intp]
    """Triangles (F, 3) of corners, counter-clockwise seen from outside; none below dimension 3."""
    outline: NDArray[np.intp]
    """Corners in order around a flat hull, or the two ends of a line; empty otherwise."""
    dimension: int
    """3 for a body, 2 flat, 1 a line, 0 a point."""
    normals: Array
    """Outward unit normals (N, 3) of bounding planes; a flat hull lies between two of them."""
    offsets: Array
    """How far out (N,) those planes are."""
    gap: float = np.inf
    """Nothing attainable lies further than this outside any face [N] or [N m]."""

    def _repr_html_(self) -> str:
        unit = "N" if self.kind == "force" else "N m"
        ends = zip("xyz", self.vertices.min(axis=0), self.vertices.max(axis=0), strict=True)
        rows = [(axis, f"{low + 0.0:.3f}", f"{high + 0.0:.3f}") for axis, low, high in ends]
        table = Table(("axis", f"least [{unit}]", f"most [{unit}]"), rows, (True, False, False))
        title = f"attainable {self.kind}, all else at zero"
        return html([title, table], lambda: body_picture(title, unit, self))


def _hull_of(points: Array, kind: WrenchHalf) -> AttainableSet:
    """The convex hull of points (P, 3), at least one."""
    center = points.mean(axis=0)
    _, extent, axes = np.linalg.svd(points - center, full_matrices=True)
    size = np.abs(points).max()
    inside = (points - center) @ axes.T
    thick = np.ptp(inside, axis=0) > max(FLAT * size, 1e-9)
    dimension = int(thick.sum())
    if dimension == 3:
        return _body(points, kind)
    kept = axes[thick]
    flat = axes[~thick]
    if dimension == 2:
        polygon = ConvexHull(inside[:, thick])
        corners = polygon.vertices
        lines = polygon.equations
        normals = lines[:, :2] @ kept
        offsets = -lines[:, 2] + lines[:, :2] @ kept @ center
    elif dimension == 1:
        along = inside[:, thick][:, 0]
        corners = np.array([along.argmin(), along.argmax()])
        normals = np.concatenate([-kept, kept])
        offsets = (points[corners] * normals).sum(-1)
    else:
        corners = np.array([0])
        normals = np.zeros((0, 3))
        offsets = np.zeros(0)
    sides = np.concatenate([flat, -flat])
    none = np.zeros((0, 3), dtype=np.intp)
    outline = np.arange(len(corners)) if dimension else none[:, 0]
    normals = np.concatenate([normals, sides])
    offsets = np.concatenate([offsets, (points @ sides.T).max(axis=0)])
    return AttainableSet(kind, points[corners], none, outline, dimension, normals, offsets)


def _body(points: Array, kind: WrenchHalf) -> AttainableSet:
    hull = ConvexHull(points)
    corners = hull.vertices
    place = np.zeros(len(points), dtype=np.intp)
    place[corners] = np.arange(len(corners))
    faces = hull.simplices
    normals = hull.equations[:, :3]
    a, b, c = (points[faces[:, k]] for k in range(3))
    backward = (np.cross(b - a, c - a) * normals).sum(-1) < 0.0
    faces = np.where(backward[:, None], faces[:, ::-1], faces)
    planes = np.unique(np.round(hull.equations, 9), axis=0)
    none = np.zeros(0, dtype=np.intp)
    return AttainableSet(
        kind, points[corners], place[faces], none, 3, planes[:, :3].copy(), -planes[:, 3]
    )


def attainable_set(
    layout: Layout,
    kind: WrenchHalf,
    *,
    lost: Collection[str] = (),
    tolerance: float = TOLERANCE,
    flow: ArrayLike | None = None,
) -> AttainableSet:
    """Returns what forces or torques (by `kind`) the actuators can give with all else at zero;
    those in `lost` push nothing, and the body moves through the water with `flow` (6,) [m/s,
    rad/s], body frame, None at rest. A `LayoutError` at an unknown name.

    Directions are sent out from the origin. In each, the farthest attainable point is a vertex;
    where a face still lies further than `tolerance`, a share of the farthest vertex, inside the
    plane that touches the set, its normal is sent out too.
    """
    support = _support(force_sets(layout, lost, flow), kind)
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    extent = np.maximum(support(axes)[1].reshape(2, 3).max(axis=0), 0.0)
    # Flat robots have flat sets: directions are spread over a cube that has been scaled as the set
    # is.
    scale = 1.0 / np.maximum(extent, 1e-2 * extent.max()) if extent.max() > 0.0 else np.ones(3)
    spread = np.array(list(product((-1.0, 0.0, 1.0), repeat=3))) * scale
    spread = spread[spread.any(axis=-1)]
    points = support(spread / np.linalg.norm(spread, axis=-1, keepdims=True))[0]
    result = _hull_of(points, kind)
    for round_ in count():
        new, reach = support(result.normals)
        beyond = reach - result.offsets
        size = float(np.linalg.norm(points, axis=-1).max())
        far = beyond > tolerance * size
        if round_ == MAX_ROUNDS or not far.any():
            break
        points = np.concatenate([result.vertices, new[far]])
        result = _hull_of(points, kind)
    return replace(result, gap=max(float(beyond.max()), 0.0))


def _support(sets: ForceSets, kind: WrenchHalf) -> Callable[[Array], tuple[Array, Array]]:
    """Unit directions (D, 3) to the farthest points (D, 3) and how far they lie along them (D,): by
    the solver, in each convex part; those near the origin are the origin."""
    own, other = (slice(0, 3), slice(3, 6)) if kind == "force" else (slice(3, 6), slice(0, 3))
    parts = convex_parts(sets)
    speck = SPECK * float(sets.radius.sum())
    n_parts = len(parts.radius)

    def support(directions: Array) -> tuple[Array, Array]:
        rows = len(directions)
        along = np.tile(directions, (n_parts, 1))
        asked = parts.repeat(rows)
        # What is along the direction counts, and what has to be zero.
        own_columns = asked.effectiveness[..., own] @ along[:, None, :, None]
        seen = np.concatenate([own_columns, asked.effectiveness[..., other]], axis=-1)
        answer = largest(asked._replace(effectiveness=seen), np.tile(np.eye(4)[0], (len(along), 1)))
        reach = answer.size.reshape(n_parts, rows)
        best = reach.argmax(axis=0) * rows + np.arange(rows)
        # The origin stands in for a point that is not proven to be attained.
        proven = answer.gap < UNPROVEN * (1.0 + answer.size)
        points = np.where(proven[:, None], asked.wrench(answer.force)[:, own], 0.0)
        points = points[best] * SCALE[own]
        size = answer.size[best] * SCALE[own][0]
        near = np.linalg.norm(points, axis=-1) <= speck
        return np.where(near[:, None], 0.0, points), np.where(near, 0.0, size)

    return support
