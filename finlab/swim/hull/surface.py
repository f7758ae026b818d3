"""The closed surface of a hull, which can be asked where it is: from a shape, a mesh file, or made
up."""

from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from trimesh.triangles import closest_point, normals

from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.files.guarded import read_file
from finlab.layout import Layout
from finlab.swim.hull.mesh_file import MAX_BYTES, Mesh, MeshReport, read_mesh, simplified


def grid_faces(rows: int, columns: int) -> NDArray[np.int32]:
    """Triangles between neighbouring rings of points; the columns close on themselves."""
    a = np.arange((rows - 1) * columns).reshape(-1, columns)
    b = np.roll(a, -1, axis=1)
    return triangles(a, b, a + columns, b, b + columns, a + columns)


def triangles(*corners: NDArray[np.intp]) -> NDArray[np.int32]:
    """Arrays of corners, three for each set of triangles, as triangles (F, 3)."""
    return np.stack(corners, axis=-1).reshape(-1, 3).astype(np.int32)


def revolved(
    x: Array, radius_y: Array, radius_z: Array, power: float = 2.0, sides: int = 48
) -> Mesh:
    """A closed body along the x axis whose cross-section at `x` is a superellipse.

    Args:
        x: stations (P,), rising [m].
        radius_y: half width (P,) at each station [m].
        radius_z: half height (P,) at each station [m].
        power: 2 is an ellipse, larger is boxier.
        sides: corners of the cross-section.
    """
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    cos = np.cos(turn)
    sin = np.sin(turn)
    unit_y = np.sign(cos) * np.abs(cos) ** (2 / power)
    unit_z = np.sign(sin) * np.abs(sin) ** (2 / power)
    x, y, z = np.broadcast_arrays(
        x[:, None], radius_y[:, None] * unit_y, radius_z[:, None] * unit_z
    )
    return Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), grid_faces(len(x), sides))


STATIONS: Array = np.sin(np.linspace(-np.pi / 2, np.pi / 2, 41))
"""Positions along a hull of half length 1, closer together towards the ends where it curves
most."""
ACROSS = {"box": 5.0, "ellipsoid": 2.0, "torpedo": 2.0, "ucat": 3.2}
ALONG = {"box": 6.0, "ellipsoid": 2.0, "ucat": 3.0}
"""Powers of the superellipses across and along each shape; a torpedo has a profile of its own."""

Three = tuple[float, float, float]


def shape_mesh(
    shape: str, half: Three, center: Three, stations: Array = STATIONS, swell: float = 1.0
) -> Mesh:
    """The surface of a shape, or a part of it.

    Args:
        shape: one of `finlab.layout.body.HULL_SHAPES`.
        half: half length, width and height [m].
        center: where its middle lies in the body frame [m].
        stations: where along it, from -1 to 1, rising.
        swell: how many times as large it is drawn.
    """
    x, y, z = (swell * value for value in half)
    share = _profile(shape, stations)
    mesh = revolved(stations * x, share * y, share * z, ACROSS[shape])
    return Mesh(mesh.vertices + np.array(center), mesh.faces)


def _profile(shape: str, s: Array) -> Array:
    """Share of the full width at s in [-1, 1] along a shape."""
    if shape == "torpedo":
        nose = np.sqrt(np.clip(1 - (np.clip(s - 0.6, 0, None) / 0.4) ** 2, 0, 1))
        tail = 1 - 0.62 * (np.clip(-s - 0.35, 0, None) / 0.65) ** 2
        end = np.sqrt(np.clip(1 - (np.clip(-s - 0.94, 0, None) / 0.06) ** 2, 0, 1))
        return nose * tail * end
    power = ALONG[shape]
    return np.clip(1 - np.abs(s) ** power, 0, 1) ** (1 / power)


COARSE_FACES = 400
"""Triangles of a coarse surface."""
UNITS = {"m": 1.0, "mm": 0.001, "cm": 0.01, "inch": 0.0254}
"""Metres per unit of a mesh file."""


@dataclass(frozen=True)
class Surface:
    """A closed surface in the body frame. Two are equal that were made of the same."""

    shape: str
    """One of `finlab.layout.body.HULL_SHAPES`, or `mesh`."""
    half: Three
    """Half length, width and height of the box around it [m]."""
    center: Three
    """Where the middle of that box lies [m]."""
    mesh: Mesh = field(compare=False, repr=False)
    file: tuple[str, float] | None = None
    """File and metres per unit, where it is a mesh."""
    report: MeshReport | None = field(default=None, compare=False)
    """What was found in that file."""

    @staticmethod
    @lru_cache(maxsize=8)
    def of_shape(shape: str, half: Three, center: Three = (0.0, 0.0, 0.0)) -> "Surface":
        """The surface of a shape of a half size [m]."""
        return Surface(shape, half, center, shape_mesh(shape, half, center))

    @staticmethod
    @lru_cache(maxsize=8)
    def of_file(path: str, scale: float, center: Three) -> "Surface":
        """The surface in a mesh file, the middle of its box at `center` [m]. Raises FinlabError:
        the file cannot be read or is no sensible hull."""
        file = Path(path)
        mesh, report = read_mesh(
            file.name, read_file(file, MAX_BYTES, "a mesh file", FinlabError), scale
        )
        x, y, z = (float(v) for v in np.ptp(mesh.vertices, axis=0) / 2)
        moved = Mesh(mesh.vertices + np.array(center), mesh.faces)
        return Surface("mesh", (x, y, z), center, moved, (path, scale), report)

    def coarse(self) -> "Surface":
        """Returns about the same one with at most 400 triangles, for questions asked thousands of
        times."""
        return replace(self, mesh=simplified(self.mesh, COARSE_FACES))

    @cached_property
    def _triangles(self) -> tuple[Array, Array]:
        """Corners (F, 3, 3) [m] and outward normals (F, 3) of the triangles that have an area."""
        corners = np.asarray(self.mesh.vertices, dtype=float)[self.mesh.faces]
        normal, good = normals(corners)
        return corners[good], normal

    def nearest(self, point: Array) -> tuple[Array, Array]:
        """Returns the point (3,) [m] of the surface nearest to `point` (3,) [m], and the outward
        unit normal
        (3,) there; on an edge the mean of those around it."""
        corners, outward = self._triangles
        nearest = closest_point(
            corners, np.broadcast_to(np.asarray(point, dtype=float), (len(corners), 3))
        )
        gap = np.linalg.norm(nearest - point, axis=1)
        best = int(np.argmin(gap))
        normal = outward[gap < gap[best] + 1e-6].sum(axis=0)
        size = float(np.linalg.norm(normal))
        return np.asarray(nearest[best]), outward[best] if size < 1e-9 else normal / size

    def contains(self, points: Array) -> NDArray[np.bool_]:
        """Returns which of the points (..., 3) [m], body frame, lie inside (...,).

        Of a shape, which is convex, those behind all triangles; of a mesh those around which the
        triangles fill the whole sphere, by solid angles after Van Oosterom and Strackee (1983).
        """
        points = np.asarray(points, dtype=float)
        if self.shape != "mesh":
            corners, outward = self._triangles
            ahead = points @ outward.T - (corners[:, 0] * outward).sum(axis=1)
            return np.asarray((ahead < 0.0).all(axis=-1))
        inside = [self._solid_angle(point) > 2.0 * np.pi for point in points.reshape(-1, 3)]
        return np.array(inside).reshape(points.shape[:-1])

    def _solid_angle(self, point: Array) -> float:
        a, b, c = np.swapaxes(self._triangles[0] - point, 0, 1)
        u, v, w = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        volume = (a * np.cross(b, c)).sum(axis=1)
        scale = (
            u * v * w + (a * b).sum(axis=1) * w + (b * c).sum(axis=1) * u + (c * a).sum(axis=1) * v
        )
        return abs(2.0 * float(np.arctan2(volume, scale).sum()))

    def anchor(self, point: Array) -> Array:
        """Returns where a strut from a point (3,) meets the surface (3,) [m]; the point itself if
        inside."""
        return _anchor(self, tuple(np.asarray(point).tolist())).copy()


@lru_cache(maxsize=256)
def _anchor(surface: Surface, place: tuple[float, ...]) -> Array:
    """The same, kept: it is asked for again and again while nothing moves."""
    point = np.array(place)
    return point if surface.contains(point) else surface.nearest(point)[0]


def hull_of(layout: Layout) -> Surface:
    """Returns the hull that the layout describes, body frame [m], or one that fits between its
    actuators where it describes none, or names a mesh file that cannot be read."""
    described = layout.body.hull if layout.body is not None else None
    if described is not None and described.mesh is not None:
        x, y, z = described.center_m
        with suppress(
            FinlabError
        ):  # the file may be on another computer; a made-up hull is better than none
            return Surface.of_file(described.mesh, described.scale, (x, y, z))
    elif described is not None and described.shape is not None and described.size_m is not None:
        length, width, height = described.size_m
        x, y, z = described.center_m
        return Surface.of_shape(described.shape, (length / 2, width / 2, height / 2), (x, y, z))
    reach = np.abs(layout.position).max(axis=0)
    half = np.maximum(reach * [1.06, 0.86, 0.86], [0.16, 0.09, 0.08])
    slender = half[0] > 2.4 * max(half[1], half[2])
    round_plan = half[1] > 0.8 * half[0]
    shape = "torpedo" if slender else "ellipsoid" if round_plan else "ucat"
    return Surface.of_shape(shape, (float(half[0]), float(half[1]), float(half[2])))


@lru_cache(maxsize=8)
def has_inside(layout: Layout) -> bool:
    """Whether an actuator other than a fin sits inside the hull."""
    places = layout.position[~layout.is_fin]
    return bool(len(places)) and bool(hull_of(layout).contains(places).any())
