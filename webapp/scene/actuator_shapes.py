"""Shapes of the view: arrows, rings and tubes, and actuators made of them."""

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray
from trimesh.convex import convex_hull
from trimesh.util import append_faces

from finlab.arrays import Array
from finlab.swim.hull.mesh_file import Mesh
from finlab.swim.hull.surface import grid_faces, revolved, triangles

SHORTEST = 1e-3
"""Arrows shorter than this are not drawn [m]."""
HEAD = 0.28
"""Share of a unit arrow that is its head."""
TURN = math.radians(300.0)
"""How far a ring goes round [rad]."""


NOTHING = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]], dtype=np.int32))
"""A mesh that shows nothing; a node keeps its name while it has nothing to show."""


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes as one."""
    vertices, faces = append_faces(*zip(*meshes, strict=True))
    return Mesh(np.asarray(vertices, float), faces.astype(np.int32))


def tube(path: Array, radius: Array | float, sides: int = 16, across: Array | None = None) -> Mesh:
    """A closed round tube along a path (P, 3) [m], no two neighbours equal, with one radius or (P,)
    [m]; `across` is never along the path, and chosen from it if left out."""
    radius = np.broadcast_to(np.asarray(radius, dtype=float), (len(path),))
    tangent = np.gradient(path, axis=0)
    # Where the path stands still (a step of the radius) the direction of travel is taken from its
    # whole.
    is_degenerate = np.linalg.norm(tangent, axis=1) < 1e-12
    tangent[is_degenerate] = path[-1] - path[0]
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    if across is None:
        across = np.eye(3)[np.argmin(np.abs(tangent).max(axis=0))]
    # Cross products; `np.cross` takes ten times as long for few vectors.
    left = tangent[:, [1, 2, 0]]
    right = tangent[:, [2, 0, 1]]
    first = left * across[[2, 0, 1]] - right * across[[1, 2, 0]]
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = left * first[:, [2, 0, 1]] - right * first[:, [1, 2, 0]]
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    ring = (
        np.cos(turn)[None, :, None] * first[:, None] + np.sin(turn)[None, :, None] * second[:, None]
    )
    points = path[:, None] + radius[:, None, None] * ring
    vertices = np.concatenate([points.reshape(-1, 3), path[:1], path[-1:]])
    return Mesh(vertices, _tube_faces(len(path), sides))


@cache
def _tube_faces(rows: int, sides: int) -> NDArray[np.int32]:
    """Triangles of a tube of so many rings, with a fan at each end whose middle points come
    last."""
    k = np.arange(sides)
    n = np.roll(k, -1)
    last_ring = (rows - 1) * sides
    start = np.full(sides, rows * sides)
    tips = np.full(sides, rows * sides + 1)
    return np.concatenate(
        [grid_faces(rows, sides), triangles(start, n, k, tips, last_ring + k, last_ring + n)]
    )


def force_arrow(direction: Array, start: Array, thickness: float) -> Mesh:
    """A straight arrow from `start` (3,) along `way` (3,) [m]: a force times the scale of the
    arrows."""
    length = float(np.linalg.norm(direction))
    if length < SHORTEST:
        return NOTHING
    direction = np.asarray(direction) / length
    head = min(5.0 * thickness, 0.6 * length)
    stations = np.array([0.0, length - head, length - head, length])
    radii = thickness * np.array([1.0, 1.0, 2.6, 0.02])
    return tube(np.asarray(start) + stations[:, None] * direction, radii, 18)


def unit_arrow(thickness: float) -> Mesh:
    """A straight arrow of length 1 along x, its shaft of a radius [m]: a node scales it along x
    alone."""
    stations = np.array([0.0, 1.0 - HEAD, 1.0 - HEAD, 1.0])
    path = stations[:, None] * np.array([1.0, 0.0, 0.0])
    return tube(path, thickness * np.array([1.0, 1.0, 2.6, 0.02]), 18)


def unit_ring(thickness: float) -> Mesh:
    """A ring arrow of radius 1 about z by the right-hand rule, from x most of the way round.

    The radius of its tube is a share of that of the ring.
    """
    head = 5.0 * thickness
    body = np.linspace(0.0, TURN - head, 48)
    tip = np.linspace(TURN - head, TURN, 8)
    angles = np.concatenate([body, tip])
    radii = thickness * np.concatenate([np.ones(48), np.linspace(2.6, 0.02, 8)])
    circle = np.stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))], axis=1)
    return tube(circle, radii, 14, across=np.array([0.0, 0.0, 1.0]))


CHORD = 0.18
"""Length of the blade from the shaft to its trailing edge [m]."""
SPAN = 0.10
"""Width of the blade along the shaft [m]."""
ROOT = 0.012
"""Gap between the fin's position and the blade along the shaft [m]."""


def blade() -> Mesh:
    """The blade: thick and narrow at the shaft, thin and wide at the trailing edge."""
    along = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 30))
    ends = np.sqrt(np.clip(1.0 - np.abs(2.0 * along - 1.0) ** 10, 0.0, 1.0))  # round
    width = 0.5 * SPAN * (0.66 + 0.36 * along**1.3) * ends
    body = revolved(along, width, (0.0075 * (1 - along) ** 0.8 + 0.0012) * ends, sides=32)
    back, side, up = body.vertices.T
    solid = convex_hull(np.stack([ROOT + SPAN / 2 + side, 0.012 - CHORD * back, up], axis=-1))
    return Mesh(np.asarray(solid.vertices), np.asarray(solid.faces, dtype=np.int32))


def shaft() -> Mesh:
    """The servo's housing at the root and the shaft that carries the blade."""
    housing = np.array(
        [[-0.045, 0, 0], [-0.041, 0, 0], [-0.006, 0, 0], [-0.002, 0, 0]], dtype=float
    )
    rod = np.array([[-0.002, 0, 0], [ROOT + 0.86 * SPAN, 0, 0]], dtype=float)
    return joined(tube(housing, np.array([0.014, 0.018, 0.018, 0.013]), 20), tube(rod, 0.0055, 12))


def foil(slenderness: float) -> Mesh:
    """A rudder of span 1 along x', its leading edge towards y' and a quarter of its chord ahead of
    the shaft; `slenderness` is its span over its chord."""
    along = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 24))
    shape = (
        0.2969,
        -0.126,
        -0.3516,
        0.2843,
        -0.1036,
    )  # of a symmetric NACA section with a closed end
    thick = 5.0 * 0.15 * sum(c * along**p for c, p in zip(shape, (0.5, 1, 2, 3, 4), strict=True))
    points = []
    for x, chord in ((-0.5, 1.0), (0.46, 0.82), (0.5, 0.74)):
        for side in (1.0, -1.0):
            section = [
                np.full(24, x),
                (0.25 - along) * chord / slenderness,
                side * thick * chord / slenderness,
            ]
            points.append(np.stack(section, axis=-1))
    solid = convex_hull(np.concatenate(points))
    return Mesh(np.asarray(solid.vertices), np.asarray(solid.faces, dtype=np.int32))


def stock() -> Mesh:
    """The shaft of a rudder of span 1."""
    return tube(np.array([[-0.6, 0.0, 0.0], [0.54, 0.0, 0.0]]), 0.035, 12)


def pin(size: float) -> Mesh:
    """A nail through what is stuck."""
    path = size * np.array(
        [[0.0, 0.0, -0.04], [0.0, 0.0, 0.06], [0.0, 0.0, 0.06], [0.0, 0.0, 0.066]]
    )
    return tube(path, size * np.array([0.004, 0.004, 0.016, 0.016]), 14)


RADIUS = 0.046
"""Of the duct [m]."""
N_BLADES = 3
COLUMN: Array = RADIUS * np.array(
    [[1.02, 0.0, 0.0], [1.12, 0.0, 0.0], [1.12, 0.0, 0.0], [2.2, 0.0, 0.0]]
)
"""Steps of the column about which a pod turns [m]."""


@cache
def duct(along: int) -> Mesh:
    """A short ring, a hub, and three struts between them; `along` is 0 for x', 1 for y'."""
    section = np.linspace(0.0, 2.0 * np.pi, 17)
    x = 0.5 * np.cos(section)
    radius = 1.0 - 0.07 * np.sin(section) + 0.06 * x  # a little wider where water comes in
    turn = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    rim = [
        np.broadcast_to(x[:, None], (17, 40)),
        *(radius[:, None] * f(turn) for f in (np.cos, np.sin)),
    ]
    ring = Mesh(np.stack(rim, axis=-1).reshape(-1, 3), grid_faces(17, 40))
    s = np.sin(np.linspace(-np.pi / 2, np.pi / 2, 13))
    round_ = 0.25 * np.sqrt(1.0 - s**2) + 1e-4
    hub = revolved(0.62 * s - 0.12, round_, round_, sides=20)
    spokes = [
        tube(np.array([[-0.32, 0, 0], [-0.32, np.cos(t), np.sin(t)]]), 0.05, 8)
        for t in turn[[0, 13, 27]]
    ]
    return _along(joined(ring, hub, *spokes), along)


@cache
def propeller(along: int) -> Mesh:
    """Three twisted blades, ahead of the struts; a node shows both their sides."""
    radius = np.linspace(0.2, 0.9, 9)
    fraction = np.linspace(-0.5, 0.5, 5)
    pitch = np.arctan(0.42 / radius)[:, None]
    chord = (0.42 * np.sqrt(np.clip(1.0 - ((radius - 0.55) / 0.62) ** 2, 0.0, 1.0)))[
        :, None
    ] * fraction
    vertices = np.stack(
        [0.1 + chord * np.sin(pitch), radius[:, None] + 0 * chord, chord * np.cos(pitch)], -1
    )
    k, n = (v.ravel() for v in np.meshgrid(np.arange(8), np.arange(4), indexing="ij"))
    a = 5 * k + n
    faces = triangles(a, a + 1, a + 5, a + 1, a + 6, a + 5)
    blades = []
    for turn in 2.0 * np.pi * np.arange(N_BLADES) / N_BLADES:
        c = np.cos(turn)
        s = np.sin(turn)
        blades.append(
            Mesh(vertices.reshape(-1, 3) @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]), faces)
        )
    return _along(joined(*blades), along)


def column(up: bool) -> Mesh:
    """What a pod turns about: from its duct towards the hull, on one side or the other."""
    radius = RADIUS * np.array([0.2, 0.34, 0.24, 0.24])
    return tube(COLUMN if up else -COLUMN, radius, 16)


def _along(mesh: Mesh, along: int) -> Mesh:
    """A mesh of radius 1 along x', as large as a thruster, along another axis."""
    return Mesh(RADIUS * np.roll(mesh.vertices, along, axis=1), mesh.faces)
