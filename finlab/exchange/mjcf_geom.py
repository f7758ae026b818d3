"""Geoms of MuJoCo's bodies: their shape, size and pose, of which a robot has masses and a hull."""

from dataclasses import dataclass
from functools import cached_property
from xml.etree.ElementTree import Element

import numpy as np

from finlab.arrays import Array
from finlab.exchange.description import numbers
from finlab.exchange.mjcf_file import Attributes, MjcfFile
from finlab.exchange.visuals import Solid


@dataclass(frozen=True)
class Geom:
    """A geom of a body."""

    file: MjcfFile
    """The model that has it."""
    name: str
    """Its name, or that of its mesh; empty where it has neither."""
    attributes: Attributes
    """Its attributes, with those of its class."""
    outer: Array
    """Pose (4, 4) of what is around it, in the frame of the robot [m]."""

    @property
    def what(self) -> str:
        """What it is, for an error."""
        return f"geom {self.name!r:.60}"

    @property
    def kind(self) -> str:
        """Its shape, such as `box`."""
        return self.attributes.get("type", "sphere")

    @property
    def is_mesh(self) -> bool:
        """Whether a mesh has its size, itself or as what a solid is fitted to."""
        return "mesh" in self.attributes

    @cached_property
    def pose(self) -> Array:
        """Its pose (4, 4) in the frame of the robot [m]. Raises LayoutError: a value is no number,
        or an axis has no length."""
        return np.asarray(self.outer @ self.file.pose(self.attributes, self.what))

    @cached_property
    def size(self) -> Array:
        """Its size (3,) as MuJoCo has it: half sizes, or a radius and half a length [m]. Raises
        LayoutError: a value is no number."""
        words = self.attributes.get("size", "0").split()[:3]
        text = " ".join([*words, *["0"] * (3 - len(words))])
        size = numbers(text, 3, f"size of {self.what}")
        if "fromto" not in self.attributes:
            return size
        ends = numbers(self.attributes["fromto"], 6, f"fromto of {self.what}").reshape(2, 3)
        half_length = 0.5 * float(np.linalg.norm(ends[0] - ends[1]))
        radius = size[0]
        if self.kind in ("capsule", "cylinder"):
            return np.array([radius, half_length, 0.0])
        return np.array([radius, radius, half_length])


def read_geom(file: MjcfFile, element: Element, outer: Array, child_class: str) -> Geom:
    """Returns a geom.

    Args:
        file: the model.
        element: its <geom>.
        outer: pose (4, 4) of what is around it, in the frame of the robot [m].
        child_class: the class of defaults that holds where it names none.

    Raises:
        LayoutError: there is no such class.
    """
    attributes = file.attributes(element, child_class)
    name = element.get("name") or attributes.get("mesh", "")
    return Geom(file, name, attributes, outer)


def solid_of(geom: Geom, link: str) -> Solid | None:
    """Returns the solid of a geom, for the hull; None of a mesh, a plane and the like.

    Args:
        geom: a geom.
        link: name of its body.

    Raises:
        LayoutError: a value is no number.
    """
    if geom.is_mesh or geom.kind not in ("box", "sphere", "ellipsoid", "cylinder", "capsule"):
        return None
    half = np.abs(geom.size)
    kind = geom.kind
    if kind == "sphere":
        kind = "ellipsoid"
        half = np.full(3, half[0])
    elif kind in ("cylinder", "capsule"):
        radius, half_length, _ = half
        half = np.array([radius, radius, half_length])
    return Solid(kind, link, geom.pose[:3, 3], geom.pose[:3, :3], half)
