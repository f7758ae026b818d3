"""Masses of MuJoCo's geoms, by their solids and densities; those of meshes stay unknown."""

import math

import numpy as np

from finlab.arrays import Array
from finlab.exchange.description import numbers
from finlab.exchange.links import LinkMass
from finlab.exchange.mjcf_geom import Geom

DENSITY = "1000"
"""Density of a geom that says neither mass nor density [kg/m^3]."""
GROUPS = "0 5"
"""Groups of geoms that have a mass where <compiler> does not say."""
WITHOUT_MASS = ("plane", "hfield")
"""Geoms that have no mass."""


def geom_mass(geom: Geom) -> LinkMass | None:
    """Returns the mass of a geom.

    Args:
        geom: a geom.

    Returns:
        Its mass in the frame of the robot; None of a mesh, or of a shell.

    Raises:
        LayoutError: a value is no number.
    """
    attributes = geom.attributes
    what = geom.what
    density = numbers(attributes.get("density", DENSITY), 1, f"density of {what}")[0]
    mass = numbers(attributes["mass"], 1, f"mass of {what}")[0] if "mass" in attributes else None
    group = numbers(attributes.get("group", "0"), 1, f"group of {what}")[0]
    least, most = numbers(
        geom.file.compiler.get("inertiagrouprange", GROUPS), 2, "inertiagrouprange"
    )
    has_mass = density != 0.0 if mass is None else mass != 0.0
    if geom.kind in WITHOUT_MASS or not least <= group <= most or not has_mass:
        return LinkMass(0.0, np.zeros(3), np.zeros((3, 3)))
    is_shell = attributes.get("shellinertia") == "true"
    volume_and_moments = None
    if not geom.is_mesh and not is_shell:
        volume_and_moments = _volume_and_moments(geom.kind, geom.size)
    if volume_and_moments is None:
        return None
    volume, moments = volume_and_moments
    if mass is None:
        mass = density * volume
    pose = geom.pose
    rotation = pose[:3, :3]
    inertia = rotation @ np.diag(mass * moments) @ rotation.T
    return LinkMass(float(mass), pose[:3, 3], inertia)


def _volume_and_moments(kind: str, size: Array) -> tuple[float, Array] | None:
    """The volume [m^3] of a solid, and its moments (3,) of inertia over its mass [m^2]; None of an
    unknown one."""
    a, b, c = size.tolist()
    if kind == "sphere":
        return _volume_and_moments("ellipsoid", np.array([a, a, a]))
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
