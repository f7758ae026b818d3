"""From a layout to a robot description that ROS tools show: a hull, and a link and a joint for each fin."""

from __future__ import annotations

import os
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from finlab.errors import LayoutError
from finlab.layout import Layout

BLADE = (0.10, 0.18, 0.005)
"""Length along the shaft, width and thickness of a fin as drawn [m]; a picture, not physics."""
BLADE_MASS = 0.001
"""Mass of a drawn fin [kg]: simulators want one above zero, and the body's mass already holds the fins'."""
ROOT = "base_link"


def write_urdf(layout: Layout, path: str | os.PathLike[str]) -> None:
    """Write a URDF file; `read_urdf(path, layout.names, origin="base")` gives the fins back.

    The base link's frame is the layout's: x forward, y left, z up, at the centre of gravity. A fin's joint
    has its x axis along the shaft and turns about it; its zero is the zero direction 0.

    Raises:
        LayoutError: the file cannot be written.
    """
    try:
        Path(path).write_text(urdf_text(layout), encoding="utf-8")
    except OSError as error:
        raise LayoutError(f"cannot be written: {error.strerror}", source=str(path)) from None


def urdf_text(layout: Layout) -> str:
    """The contents of the URDF file."""
    robot = Element("robot", name=layout.name)
    base = SubElement(robot, "link", name=ROOT)
    body = layout.body
    if body is not None and body.mass_kg is not None:
        _inertial(base, body.mass_kg, body.inertia_kgm2 or (1e-3,) * 3)
    if body is not None and body.hull is not None and body.hull.size_m is not None:
        visual = SubElement(base, "visual")
        SubElement(visual, "origin", xyz=_text(body.hull.center_m), rpy="0 0 0")
        SubElement(SubElement(visual, "geometry"), "box", size=_text(body.hull.size_m))
    for fin in layout.fins:
        link = SubElement(robot, "link", name=fin.name)
        _inertial(link, BLADE_MASS, (1e-6,) * 3)
        visual = SubElement(link, "visual")
        # Drawn beside its shaft, towards where it pushes from when its zero direction is 0.
        SubElement(visual, "origin", xyz=_text((BLADE[0] / 2, -BLADE[1] / 2, 0.0)), rpy="0 0 0")
        SubElement(SubElement(visual, "geometry"), "box", size=_text(BLADE))
        joint = SubElement(robot, "joint", name=f"{fin.name}_joint", type="continuous")
        SubElement(joint, "parent", link=ROOT)
        SubElement(joint, "child", link=fin.name)
        SubElement(joint, "origin", xyz=_text(fin.position), rpy=_text((0.0, 0.0, fin.mounting_angle)))
        SubElement(joint, "axis", xyz="1 0 0")
    ElementTree.indent(robot)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(robot, encoding="unicode") + "\n"


def _inertial(link: Element, mass: float, moments: tuple[float, ...]) -> None:
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "mass", value=repr(float(mass)))
    x, y, z = (repr(float(moment)) for moment in moments)
    SubElement(inertial, "inertia", ixx=x, iyy=y, izz=z, ixy="0", ixz="0", iyz="0")


def _text(values: tuple[float, ...]) -> str:
    return " ".join(repr(float(value)) for value in values)
