"""Attainable set of forces, or of torques, of a layout as a convex polytope, for
`finlab.analysis.attainable_set`, plots and the app."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from itertools import count, product
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.arrays import Array
from finlab.display import Table, html
from finlab.display.pictures import body_picture
from finlab.forces.force_sets import SCALE, ForceSets, convex_parts
from finlab.forces.reach import UNPROVEN, largest_along_rays
from finlab.forces.within_budget import force_sets_within
from finlab.layout import Layout

FLAT = 1e-5
"""Thickness, as a share of the size, below which a hull counts as flat [1]."""
MIN_THICKNESS = 1e-9
"""Thickness below which any hull counts as flat [N, N m]."""
WrenchHalf = Literal["force", "torque"]
"""The three components of a wrench that a set has."""
MAX_ROUNDS = 8
"""Most rounds in which directions are added."""
AT_ORIGIN = 1e-5
"""Share of the sum of all thrusts below which a point counts as the origin [1]: the accuracy of the
solver."""
TOLERANCE = 0.01
"""Gap at which no more directions are added, as a share of the farthest vertex [1]."""
MIN_EXTENT = 1e-2
"""Least extent along an axis, as a share of the largest, by which first directions are scaled
[1]."""


@dataclass(frozen=True, eq=False)
class AttainableSet:
    """Convex polytope of forces or torques that are attainable with the other three components of
    the wrench at zero, body frame [N] or [N m]. Every vertex is attained, of wide arcs and forces
    by the flow by convex hulls."""

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
    """Distances (N,) of those planes from the origin along their normals [N] or [N m]."""
    gap: float = np.inf
    """Largest distance of an attainable point outside any face [N] or [N m]."""

    def _repr_html_(self) -> str:
        unit = "N" if self.kind == "force" else "N m"
        lows = self.vertices.min(axis=0)
        highs = self.vertices.max(axis=0)
        rows = []
        for axis, low, high in zip("xyz", lows, highs, strict=True):
            rows.append((axis, f"{low + 0.0:.3f}", f"{high + 0.0:.3f}"))  # + 0.0: no "-0.000"
        table = Table(("axis", f"least [{unit}]", f"most [{unit}]"), rows, (True, False, False))
        title = f"attainable {self.kind}, all else at zero"
        return html([title, table], lambda: body_picture(title, unit, self))


def _hull_of(points: Array, kind: WrenchHalf) -> AttainableSet:
    """The convex hull of points (P, 3), at least one, of any dimension."""
    center = points.mean(axis=0)
    axes = np.linalg.svd(points - center, full_matrices=True)[2]
    size = np.abs(points).max()
    principal = (points - center) @ axes.T  # coordinates along the principal axes
    is_thick = np.ptp(principal, axis=0) > max(FLAT * size, MIN_THICKNESS)
    dimension = int(is_thick.sum())
    if dimension == 3:
        return _polytope(points, kind)
    basis = axes[is_thick]
    flat = axes[~is_thick]
    if dimension == 2:
        from scipy.spatial import ConvexHull  # here: few ask for a hull, and it takes long to load

        polygon = ConvexHull(principal[:, is_thick])
        corners = polygon.vertices
        lines = polygon.equations
        normals = lines[:, :2] @ basis
        offsets = -lines[:, 2] + lines[:, :2] @ basis @ center
    elif dimension == 1:
        along = principal[:, is_thick][:, 0]
        corners = np.array([along.argmin(), along.argmax()])
        normals = np.concatenate([-basis, basis])
        offsets = (points[corners] * normals).sum(-1)
    else:
        corners = np.array([0])
        normals = np.zeros((0, 3))
        offsets = np.zeros(0)
    # Two planes on either side bound a hull along each axis in which it is flat.
    flat_normals = np.concatenate([flat, -flat])
    flat_offsets = (points @ flat_normals.T).max(axis=0)
    return AttainableSet(
        kind=kind,
        vertices=points[corners],
        faces=np.zeros((0, 3), dtype=np.intp),
        outline=np.arange(len(corners)) if dimension else np.zeros(0, dtype=np.intp),
        dimension=dimension,
        normals=np.concatenate([normals, flat_normals]),
        offsets=np.concatenate([offsets, flat_offsets]),
    )


def _polytope(points: Array, kind: WrenchHalf) -> AttainableSet:
    """The convex hull of points (P, 3) that do not lie in a plane."""
    from scipy.spatial import ConvexHull

    hull = ConvexHull(points)
    corners = hull.vertices
    vertex_of_point = np.zeros(len(points), dtype=np.intp)
    vertex_of_point[corners] = np.arange(len(corners))
    faces = hull.simplices
    normals = hull.equations[:, :3]
    a = points[faces[:, 0]]
    b = points[faces[:, 1]]
    c = points[faces[:, 2]]
    is_clockwise = (np.cross(b - a, c - a) * normals).sum(-1) < 0.0
    faces = np.where(is_clockwise[:, None], faces[:, ::-1], faces)
    # Triangles of one plane differ by rounding.
    planes = np.unique(np.round(hull.equations, 9), axis=0)
    return AttainableSet(
        kind=kind,
        vertices=points[corners],
        faces=vertex_of_point[faces],
        outline=np.zeros(0, dtype=np.intp),
        dimension=3,
        normals=planes[:, :3].copy(),
        offsets=-planes[:, 3],
    )


def attainable_set(
    layout: Layout,
    kind: WrenchHalf,
    *,
    lost: Collection[str] = (),
    tolerance: float = TOLERANCE,
    flow: ArrayLike | None = None,
    power: object = None,
) -> AttainableSet:
    """Returns the attainable forces or torques with the other three components at zero.

    The support function is evaluated in directions from the origin; the point that attains it is a
    vertex. The normal of a face is added to the directions while its supporting plane lies further
    out than the tolerance.

    Args:
        layout: the robot.
        kind: the three components.
        lost: names of actuators that give no force.
        tolerance: gap at which no more directions are added, over the farthest vertex [1].
        flow: velocity of the body relative to the water (6,), body frame [m/s, rad/s]; None at
            rest.
        power: watts of all actuators, or of buses by their names, as in
            `finlab.Allocator.allocate`; None for the budget of the layout, infinity for no limit.

    Raises:
        LayoutError: there is no actuator of a name.
        AllocationError: the power is none, or the flow drives actuators whose power is not known.
    """
    support = _support(force_sets_within(layout, lost, flow, power), kind)
    points = support(_first_directions(support))[0]
    result = _hull_of(points, kind)
    for round_ in count():
        support_points, support_values = support(result.normals)
        excess = support_values - result.offsets
        size = float(np.linalg.norm(points, axis=-1).max())
        is_beyond = excess > tolerance * size
        if round_ == MAX_ROUNDS or not is_beyond.any():
            break
        points = np.concatenate([result.vertices, support_points[is_beyond]])
        result = _hull_of(points, kind)
    return replace(result, gap=max(float(excess.max()), 0.0))


Support = Callable[[Array], tuple[Array, Array]]
"""From unit directions (D, 3) to the farthest points (D, 3), and the values (D,) of the support
function, both [N] or [N m]."""


def _first_directions(support: Support) -> Array:
    """Unit directions (26, 3) to the corners, edges and faces of a cube that is stretched by the
    inverse extents of the set: the normals of a flat set's faces lie near its thin axis."""
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    extent = np.maximum(support(axes)[1].reshape(2, 3).max(axis=0), 0.0)
    largest_extent = extent.max()
    scale = np.ones(3)
    if largest_extent > 0.0:
        scale = 1.0 / np.maximum(extent, MIN_EXTENT * largest_extent)
    directions = np.array(list(product((-1.0, 0.0, 1.0), repeat=3))) * scale
    directions = directions[directions.any(axis=-1)]
    return np.asarray(directions / np.linalg.norm(directions, axis=-1, keepdims=True))


def _support(sets: ForceSets, kind: WrenchHalf) -> Support:
    """The support function of the attainable set, by the solver in each convex part; points near
    the origin are the origin."""
    force_half = slice(0, 3)
    torque_half = slice(3, 6)
    if kind == "force":
        components, other_components = force_half, torque_half
    else:
        components, other_components = torque_half, force_half
    parts = convex_parts(sets)
    n_parts = len(parts.radius)
    origin_radius = AT_ORIGIN * float(sets.radius.sum())
    scale = SCALE[components]

    def support(directions: Array) -> tuple[Array, Array]:
        n_directions = len(directions)
        rows = parts.repeat(n_directions)
        along = np.tile(directions, (n_parts, 1))
        # Four coordinates: the component along the direction, and those that have to be zero.
        component_along = rows.effectiveness[..., components] @ along[:, None, :, None]
        others = rows.effectiveness[..., other_components]
        reduced = rows._replace(effectiveness=np.concatenate([component_along, others], axis=-1))
        ray = np.tile(np.eye(4)[0], (len(along), 1))
        result = largest_along_rays(reduced, ray)
        best_part = result.size.reshape(n_parts, n_directions).argmax(axis=0)
        best = best_part * n_directions + np.arange(n_directions)
        # The origin takes the place of a point that is not proven to be attained.
        is_proven = result.gap < UNPROVEN * (1.0 + result.size)
        points = np.where(is_proven[:, None], rows.wrench(result.force)[:, components], 0.0)
        points = points[best] * scale
        values = result.size[best] * scale[0]
        is_origin = np.linalg.norm(points, axis=-1) <= origin_radius
        return np.where(is_origin[:, None], 0.0, points), np.where(is_origin, 0.0, values)

    return support
