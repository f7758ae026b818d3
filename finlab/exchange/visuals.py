"""The hull of a robot description: what its visuals draw, as one shape.

Boxes, cylinders, balls, ellipsoids and capsules are read, and meshes are not, since no other file
is opened. Where no visual is one of these, collisions stand for them. `mjcf_geom` makes the same
solids of the geoms of MuJoCo.
"""

from collections.abc import Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from finlab.arrays import Array
from finlab.exchange.description import Description, Visual, numbers, text_at
from finlab.exchange.exchange import Exchange
from finlab.exchange.labels import listed
from finlab.layout.body import Hull

MAIN_SHARE = 0.5
"""Share of the box around all solids from which on the largest one makes the hull by itself."""
SIZES = (0.01, 1000.0)
"""Least and greatest length that a hull may have [m]."""
ALONG = 0.99
"""Cosine from which on an axis counts as one along x."""


class Solid(NamedTuple):
    """A solid that a visual or geom draws, in the frame of its description."""

    kind: str
    """`box`, `ellipsoid`, `cylinder` or `capsule`."""
    link: str
    """The link, or body of MuJoCo, that has it."""
    center: Array
    """(3,) [m]."""
    axes: Array
    """(3, 3): its own axes as columns; a cylinder or capsule stands along the third one."""
    half: Array
    """(3,): half of its size along its own axes [m]; of a capsule without the balls at its ends."""

    @property
    def half_extents(self) -> Array:
        """Half of the sides (3,) of the box around it along the axes of the description [m]."""
        if self.kind == "box":
            return np.asarray(np.abs(self.axes) @ self.half)
        if self.kind == "ellipsoid":
            # Support function of an ellipsoid: |diag(half) R' e| along each axis e.
            return np.asarray(np.linalg.norm(self.axes * self.half, axis=1))
        radius, _, half_length = self.half.tolist()
        axis = self.axes[:, 2]
        along = half_length * np.abs(axis)
        if self.kind == "capsule":
            return np.asarray(along + radius)
        return np.asarray(along + radius * np.sqrt(np.maximum(1.0 - axis**2, 0.0)))

    @property
    def shape(self) -> str:
        """The hull's shape that is most like it."""
        if self.kind in ("box", "ellipsoid"):
            return self.kind
        return "torpedo" if abs(self.axes[0, 2]) > ALONG else "box"


def hull_in(description: Description, origin: Array, exchange: Exchange) -> Hull | None:
    """Returns the hull that a description draws.

    Links that turn or slide, such as propellers and fins, are no part of it. Where one solid fills
    most of the box around all of them, the hull is that solid, else the box.

    Args:
        description: the description.
        origin: the layout's origin in the description's frame, (3,) [m].
        exchange: gets the notes.

    Returns:
        The hull; None where nothing is drawn that could be one.

    Raises:
        LayoutError: the size of a solid is missing or no number.
    """
    moving = _moving(description)
    fixed = [visual for visual in description.visuals if visual.link not in moving]
    solids: list[Solid] = []
    for tag in ("visual", "collision"):
        for visual in fixed:
            solid = _solid(visual) if visual.element.tag == tag else None
            if solid is not None:
                solids.append(solid)
        if solids:
            break
    meshes = [visual.link for visual in fixed if visual.element.find("geometry/mesh") is not None]
    note_meshes(meshes, "link", exchange)
    return hull_of(solids, "link", origin, exchange)


def note_meshes(links: Sequence[str], part: str, exchange: Exchange) -> None:
    """Says whose meshes are not opened.

    Args:
        links: names of the parts that have one, each as often as it has; may be none.
        part: what the file calls a part: `link` or `body`.
        exchange: gets the note.
    """
    if links:
        exchange.note(
            f"The mesh of {part} {listed(list(dict.fromkeys(links)))} is not opened",
            "body.hull.mesh names one",
        )


def hull_of(solids: Sequence[Solid], part: str, origin: Array, exchange: Exchange) -> Hull | None:
    """Returns the hull of some solids: the largest one where it fills most of the box around all of
    them, else that box.

    Args:
        solids: in the frame of the description; may be none.
        part: what the file calls the parts that have them: `link` or `body`.
        origin: the layout's origin in the description's frame, (3,) [m].
        exchange: gets the notes.

    Returns:
        The hull; None where there are no solids, or they are too large for one.
    """
    if not solids:
        return None
    lower = np.min([solid.center - solid.half_extents for solid in solids], axis=0)
    upper = np.max([solid.center + solid.half_extents for solid in solids], axis=0)
    main = max(solids, key=lambda solid: float(np.prod(solid.half_extents)))
    shape = "box"
    what = f"the box around {len(solids)} solids"
    if np.prod(2.0 * main.half_extents) >= MAIN_SHARE * np.prod(upper - lower):
        lower = main.center - main.half_extents
        upper = main.center + main.half_extents
        shape = main.shape
        what = f"the {main.kind} of {part} {main.link:.60}"
    size = np.maximum(upper - lower, SIZES[0])
    if size.max() > SIZES[1]:
        exchange.note(f"The hull is left out: {what} is {size.max():.4g} m long.")
        return None
    x, y, z = np.round(0.5 * (lower + upper) - origin, 9).tolist()
    length, width, height = np.round(size, 9).tolist()
    exchange.note(f"The hull is {what}, {length:.4g} x {width:.4g} x {height:.4g} m.")
    return Hull(shape=shape, size_m=(length, width, height), center_m=(x, y, z))


def _moving(description: Description) -> set[str]:
    """Names of the links that move with a joint that is not fixed, and of those mounted on them."""
    joints = description.joint_of_link
    mounted: dict[str, list[str]] = {}
    for link, joint in joints.items():
        mounted.setdefault(joint.parent, []).append(link)
    moving: set[str] = set()
    ahead = [link for link, joint in joints.items() if joint.kind != "fixed"]
    while ahead:
        link = ahead.pop()
        if link not in moving:
            moving.add(link)
            ahead += mounted.get(link, [])
    return moving


def _solid(visual: Visual) -> Solid | None:
    """The solid that a visual draws; None of a mesh, a plane and the like."""
    geometry = visual.element.find("geometry")
    if geometry is None:
        return None
    for tag in ("box", "sphere", "ellipsoid", "cylinder", "capsule"):
        element = geometry.find(tag)
        if element is not None:
            what = f"of the {tag} of link {visual.link!r:.60}"
            half = _half_size(tag, element, what)
            kind = "ellipsoid" if tag == "sphere" else tag
            return Solid(kind, visual.link, visual.pose[:3, 3], visual.pose[:3, :3], half)
    return None


def _half_size(tag: str, element: Element, what: str) -> Array:
    """Half of a solid's size (3,) [m], as URDF has it in attributes and SDF in elements."""
    if tag == "box":
        return 0.5 * np.abs(numbers(_text(element, "size"), 3, f"the size {what}"))
    if tag == "ellipsoid":
        return np.abs(numbers(_text(element, "radii"), 3, f"the radii {what}"))
    radius = abs(float(numbers(_text(element, "radius"), 1, f"the radius {what}")[0]))
    if tag == "sphere":
        return np.full(3, radius)
    length = abs(float(numbers(_text(element, "length"), 1, f"the length {what}")[0]))
    return np.array([radius, radius, 0.5 * length])


def _text(element: Element, name: str) -> str:
    """The text of an attribute, or of an element, of a solid."""
    return element.get(name) or text_at(element, name)
