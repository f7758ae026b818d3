"""Triangle meshes of tubes, and of the arrows of forces and torques."""

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.hull.shapes import Mesh, grid_faces, triangles

SHORTEST = 1e-3
"""Arrows shorter than this are not drawn [m]."""
SMALLEST_TURN, LONGEST_TURN = math.radians(3.0), math.radians(330.0)
"""Rings shorter than this are not drawn, longer ones are cut off [rad]."""
RING_RADIUS = 0.12
"""Radius of a torque ring [m]."""


NOTHING = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]], dtype=np.int32))
"""A mesh that shows nothing; a node keeps its name while it has nothing to show."""


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes as one."""
    offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=False)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces).astype(np.int32))


def tube(path: Array, radius: Array | float, sides: int = 16, across: Array | None = None) -> Mesh:
    """A closed round tube along a path (P, 3) [m], no two neighbours equal, with one radius or (P,) [m];
    `across` is never along the path, and chosen from it if left out."""
    radius = np.broadcast_to(np.asarray(radius, dtype=float), (len(path),))
    tangent = np.gradient(path, axis=0)
    # Where the path stands still (a step of the radius) the direction of travel is taken from its whole.
    still = np.linalg.norm(tangent, axis=1) < 1e-12
    tangent[still] = path[-1] - path[0]
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    if across is None:
        across = np.eye(3)[np.argmin(np.abs(tangent).max(axis=0))]
    first = _cross(tangent, across)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = _cross(tangent, first)
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    ring = np.cos(turn)[None, :, None] * first[:, None] + np.sin(turn)[None, :, None] * second[:, None]
    points = path[:, None] + radius[:, None, None] * ring
    vertices = np.concatenate([points.reshape(-1, 3), path[:1], path[-1:]])
    return Mesh(vertices, _tube_faces(len(path), sides))


def _cross(a: Array, b: Array) -> Array:
    """Cross products of vectors (..., 3); `np.cross` takes ten times as long for few of them."""
    return np.asarray(a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]])


@cache
def _tube_faces(rows: int, sides: int) -> NDArray[np.int32]:
    """Triangles of a tube of so many rings, with a fan at each end whose middle points come last."""
    k = np.arange(sides)
    n, last = np.roll(k, -1), (rows - 1) * sides
    start, end = np.full(sides, rows * sides), np.full(sides, rows * sides + 1)
    return np.concatenate([grid_faces(rows, sides), triangles(start, n, k, end, last + k, last + n)])


def force_arrow(way: Array, start: Array, thickness: float) -> Mesh:
    """A straight arrow from `start` (3,) along `way` (3,) [m]: a force times the scale of the arrows."""
    length = float(np.linalg.norm(way))
    if length < SHORTEST:
        return NOTHING
    direction = np.asarray(way) / length
    head = min(5.0 * thickness, 0.6 * length)
    stations = np.array([0.0, length - head, length - head, length])
    radii = thickness * np.array([1.0, 1.0, 2.6, 0.02])
    return tube(np.asarray(start) + stations[:, None] * direction, radii, 18)


def torque_ring(turn: Array, center: Array, thickness: float, radius: float = RING_RADIUS) -> Mesh:
    """A ring arrow about a vector (3,) [rad] by the right-hand rule: a torque times the rings' scale."""
    size = float(np.linalg.norm(turn))
    if size < SMALLEST_TURN:
        return NOTHING
    axis = np.asarray(turn) / size
    # The arrow starts astern, out of the way of the force arrow, which mostly points ahead.
    astern = np.array([-1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
    first = astern - axis * (astern @ axis)
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    angle = min(size, LONGEST_TURN)
    head = min(5.0 * thickness / radius, 0.6 * angle)
    body = np.linspace(0.0, angle - head, 40)
    tip = np.linspace(angle - head, angle, 8)
    way = np.concatenate([body, tip])
    radii = np.concatenate([np.full(40, thickness), thickness * np.linspace(2.6, 0.02, 8)])
    circle = np.cos(way)[:, None] * first + np.sin(way)[:, None] * second
    return tube(np.asarray(center) + radius * circle, radii, 14, across=axis)
