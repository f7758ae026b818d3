"""Masses of MuJoCo's geoms, by their solids and densities; those of meshes stay unknown."""

import math
from xml.etree.ElementTree import Element

import numpy as np

from finlab.arrays import Array
from finlab.exchange.description import numbers
from finlab.exchange.links import LinkMass
from finlab.exchange.mjcf_file import MjcfFile

DENSITY = "1000"
"""Density of a geom that says neither mass nor density [kg/m^3]."""
GROUPS = "0 5"
"""Groups of geoms that have a mass where <compiler> does not say."""
WITHOUT_MASS = ("plane", "hfield")
"""Geoms that have no mass."""


def geom_mass(file: MjcfFile, element: Element, outer: Array, child_class: str) -> LinkMass | None:
    """Returns the mass of a geom.

    Args:
        file: the model.
        element: the geom.
        outer: pose (4, 4) of what is around it, in the frame of the robot [m].
        child_class: the class of defaults that holds where it names none.

    Returns:
        Its mass in the frame of the robot; None of a mesh, or of a shell.

    Raises:
        LayoutError: a value is no number, or there is no such class.
    """
    attributes = file.attributes(element, child_class)
    what = f"geom {element.get('name', '')!r:.60}"
    kind = attributes.get("type", "sphere")
    density = numbers(attributes.get("density", DENSITY), 1, f"density of {what}")[0]
    mass = numbers(attributes["mass"], 1, f"mass of {what}")[0] if "mass" in attributes else None
    group = numbers(attributes.get("group", "0"), 1, f"group of {what}")[0]
    least, most = numbers(file.compiler.get("inertiagrouprange", GROUPS), 2, "inertiagrouprange")
    has_mass = density != 0.0 if mass is None else mass != 0.0
    if kind in WITHOUT_MASS or not least <= group <= most or not has_mass:
        return LinkMass(0.0, np.zeros(3), np.zeros((3, 3)))
    is_shell = attributes.get("shellinertia") == "true"
    solid = None
    if "mesh" not in attributes and not is_shell:
        solid = _solid(kind, _size(attributes, kind, what))
    if solid is None:
        return None
    volume, moments = solid
    if mass is None:
        mass = density * volume
    pose = outer @ file.pose(attributes, what)
    rotation = pose[:3, :3]
    inertia = rotation @ np.diag(mass * moments) @ rotation.T
    return LinkMass(float(mass), pose[:3, 3], inertia)


def _size(attributes: dict[str, str], kind: str, what: str) -> Array:
    """The size (3,) of a geom as MuJoCo has it: half sizes, or a radius and half a length [m]."""
    words = attributes.get("size", "0").split()[:3]
    size = numbers(" ".join([*words, *["0"] * (3 - len(words))]), 3, f"size of {what}")
    if "fromto" not in attributes:
        return size
    ends = numbers(attributes["fromto"], 6, f"fromto of {what}").reshape(2, 3)
    half_length = 0.5 * float(np.linalg.norm(ends[0] - ends[1]))
    radius = size[0]
    if kind in ("capsule", "cylinder"):
        return np.array([radius, half_length, 0.0])
    return np.array([radius, radius, half_length])


def _solid(kind: str, size: Array) -> tuple[float, Array] | None:
    """The volume [m^3] of a solid, and its moments (3,) of inertia over its mass [m^2]; None of an
    unknown one."""
    a, b, c = size.tolist()
    if kind == "sphere":
        return _solid("ellipsoid", np.array([a, a, a]))
    squares = np.array([b * b + c * c, a * a + c * c, a * a + b * b])
    if kind == "ellipsoid":
        return 4.0 / 3.0 * math.pi * a * b * c, squares / 5.0
    if kind == "box":
        return 8.0 * a * b * c, squares / 3.0
    # A radius a, and half a length b along z.
    cylinder = 2.0 * math.pi * a * a * b
    across = a * a / 4.0 + b * b / 3.0
    if kind == "cylinder":
        return cylinder, np.array([across, across, a * a / 2.0])
    if kind == "capsule":
        # Half a ball at either end, whose centre of gravity lies 3/8 of the radius beyond it.
        ball = 4.0 / 3.0 * math.pi * a**3
        volume = cylinder + ball
        ball_across = 0.4 * a * a + b * b + 0.75 * a * b
        moment_across = cylinder * across + ball * ball_across
        moment_along = cylinder * a * a / 2.0 + ball * 0.4 * a * a
        moments = np.array([moment_across, moment_across, moment_along])
        return volume, moments / max(volume, 1e-30)
    return None
