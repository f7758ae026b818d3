"""The convex hull of points in space, whether they fill it, lie in a plane, on a line, or coincide."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

Array = NDArray[np.float64]

FLAT = 1e-5
"""Thickness, as a share of the size, below which a hull counts as flat."""


class Hull(NamedTuple):
    """A convex hull of dimension 0 to 3, and the planes that bound it."""

    vertices: Array
    """Corners (V, 3)."""
    faces: NDArray[np.intp]
    """Triangles (F, 3), counter-clockwise seen from outside; none below dimension 3."""
    outline: NDArray[np.intp]
    """Corners in order around a flat hull, or the two ends of a line; empty otherwise."""
    dimension: int
    """0 to 3."""
    normals: Array
    """Outward unit normals (N, 3) of bounding planes; a flat hull lies between two of them."""
    offsets: Array
    """How far out (N,) those planes are."""


def hull_of(points: Array) -> Hull:
    """Returns the convex hull of points (P, 3), at least one."""
    center = points.mean(axis=0)
    _, extent, axes = np.linalg.svd(points - center, full_matrices=True)
    size = np.abs(points).max()
    inside = (points - center) @ axes.T
    thick = np.ptp(inside, axis=0) > max(FLAT * size, 1e-9)
    dimension = int(thick.sum())
    if dimension == 3:
        return _body(points)
    kept, flat = axes[thick], axes[~thick]
    if dimension == 2:
        polygon = ConvexHull(inside[:, thick])
        corners, lines = polygon.vertices, polygon.equations
        normals, offsets = lines[:, :2] @ kept, -lines[:, 2] + lines[:, :2] @ kept @ center
    elif dimension == 1:
        along = inside[:, thick][:, 0]
        corners = np.array([along.argmin(), along.argmax()])
        normals = np.concatenate([-kept, kept])
        offsets = (points[corners] * normals).sum(-1)
    else:
        corners, normals, offsets = np.array([0]), np.zeros((0, 3)), np.zeros(0)
    sides = np.concatenate([flat, -flat])
    vertices = points[corners]
    return Hull(
        vertices,
        np.zeros((0, 3), dtype=np.intp),
        np.arange(len(corners)) if dimension else np.zeros(0, dtype=np.intp),
        dimension,
        np.concatenate([normals, sides]),
        np.concatenate([offsets, (points @ sides.T).max(axis=0)]),
    )


def _body(points: Array) -> Hull:
    hull = ConvexHull(points)
    corners = hull.vertices
    place = np.zeros(len(points), dtype=np.intp)
    place[corners] = np.arange(len(corners))
    faces, normals = hull.simplices, hull.equations[:, :3]
    a, b, c = (points[faces[:, k]] for k in range(3))
    backward = (np.cross(b - a, c - a) * normals).sum(-1) < 0.0
    faces = np.where(backward[:, None], faces[:, ::-1], faces)
    planes = np.unique(np.round(hull.equations, 9), axis=0)
    return Hull(
        points[corners], place[faces], np.zeros(0, dtype=np.intp), 3, planes[:, :3].copy(), -planes[:, 3]
    )
