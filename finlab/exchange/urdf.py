"""Robot descriptions to layouts and back: each named link is a fin, its joint says where and how it sits.

A robot description is taken in its zero position. A joint's origin is where the fin's force acts, its axis is
the fin's shaft. REP-103 frames (x forward, y left, z up) are finlab's own; only the origin moves, to the
centre of gravity.
"""

import io
import logging
import math
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from finlab.arrays import Array
from finlab.distribution import install
from finlab.errors import LayoutError
from finlab.files.guarded import read_text
from finlab.layout import Body, Fin, Layout
from finlab.layout.file_form import under
from finlab.whole_file import write_whole

MAX_BYTES = 5_000_000
"""Largest file that is read; meshes are files of their own and are not touched."""
MAX_TILT = math.radians(5.0)
"""Most that a shaft may leave the horizontal plane [rad], in which finlab's fins have theirs."""
ORIGINS = ("gravity", "base")
"""Where the layout's origin goes: the centre of gravity of all links, or the frame of the root link."""


def read_urdf(path: str | os.PathLike[str], fins: Sequence[str], origin: str = "gravity") -> Layout:
    """The layout in a URDF file.

    Args:
        path: the file; expand xacro first.
        fins: names of the links that are fins, in the order of the layout.
        origin: one of `ORIGINS`. With `gravity`, links need masses.

    Raises:
        LayoutError: it cannot be read, lacks a link, or a shaft is not horizontal.
    """
    if origin not in ORIGINS:
        raise LayoutError(f"origin: expected one of {', '.join(ORIGINS)}, got {origin!r:.40}")
    text = read_text(path, MAX_BYTES, "a URDF file", LayoutError)
    with under(source=str(path)):
        if not fins:
            raise LayoutError("name the links that are fins: --fins LINK...")
        robot = _robot(text)
        joints = {str(joint.child): joint for joint in robot.joints}
        poses = _poses(robot, joints)
        mass, center, inertia = _masses(robot, poses)
        if origin == "gravity" and mass <= 0:
            raise LayoutError(
                "has no masses, so its centre of gravity is unknown; use --origin base if that is at it"
            )
        start = center if origin == "gravity" else np.zeros(3)
        made = []
        for name in fins:
            if name not in joints or name not in poses:
                links = ", ".join(sorted(set(joints) & set(poses))) or "none"
                raise LayoutError(f"has no link {name!r:.60} that a joint moves; such links: {links}")
            made.append(_fin(joints[name], poses[name], start))
        # The inertia is about the centre of gravity; a layout keeps its diagonal.
        diagonal = tuple(np.diag(inertia).tolist())
        body = None
        if origin == "gravity":
            body = Body(mass_kg=mass, inertia_kgm2=diagonal if min(diagonal) > 0 else None)
        place = "centre of gravity" if body else "base frame"
        description = f"From {Path(path).name}, origin at the {place}."
        return Layout(str(robot.name or Path(path).stem), tuple(made), description, body)


def _robot(text: str) -> Any:
    """The parsed description; nothing but its text is read."""
    try:
        from yourdfpy import URDF
    except ImportError:
        raise LayoutError(f"reading URDF needs yourdfpy; run: {install('urdf')}") from None
    logging.getLogger("yourdfpy.urdf").setLevel(logging.CRITICAL)  # what it prints is in the sentence
    # Entities could pull in other files or grow without bound; robot descriptions have no use for them. No
    # other encoding can hide them: the text is UTF-8, whatever its first line says.
    text = re.sub(r"^\s*<\?xml[^>]*\?>", "", text)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise LayoutError("declares a DOCTYPE or entities, which are not allowed; remove them")
    try:
        with_files = {"build_scene_graph": False, "load_meshes": False, "load_collision_meshes": False}
        return URDF.load(io.BytesIO(text.encode()), **with_files).robot
    except Exception as error:  # the reader raises whatever its own parser and conversions do
        reason = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise LayoutError(f"is not a readable URDF: {reason}") from None


def _poses(robot: Any, joints: dict[str, Any]) -> dict[str, Array]:
    """Pose (4, 4) of every link in the root link's frame, all joints at zero."""
    poses: dict[str, Array] = {}
    for link in robot.links:
        chain: list[Any] = []
        name = link.name
        while name in joints and name not in poses:
            chain.append(joints[name])
            name = joints[name].parent
            if len(chain) > len(robot.links):
                raise LayoutError(f"has joints in a circle around link {link.name!r:.60}")
        pose = poses.setdefault(name, np.eye(4))
        for joint in reversed(chain):
            pose = pose @ _numbers(joint.origin, np.eye(4), f"the origin of joint {joint.name!r:.60}")
            poses[str(joint.child)] = pose
    return poses


def _numbers(value: Any, usual: Array, what: str) -> Array:
    """A value of the description as an array of the shape of the usual one, which is taken for None."""
    try:
        array = usual if value is None else np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != usual.shape or not (np.abs(array) < 1e9).all():
        raise LayoutError(f"{what} is not {usual.size} numbers of ordinary size")
    return array


def _masses(robot: Any, poses: dict[str, Array]) -> tuple[float, Array, Array]:
    """Mass [kg], centre of gravity (3,) [m] and inertia (3, 3) about it [kg m^2] of all links together."""
    parts = []
    for link in robot.links:
        inertial = link.inertial
        if inertial is None or not inertial.mass:
            continue
        of = f"of link {link.name!r:.60}"
        pose = poses[link.name] @ _numbers(inertial.origin, np.eye(4), f"the centre {of}")
        own = _numbers(inertial.inertia, np.zeros((3, 3)), f"the inertia {of}")
        mass = float(_numbers(inertial.mass, np.zeros(()), f"the mass {of}"))
        parts.append((mass, pose[:3, 3], pose[:3, :3] @ own @ pose[:3, :3].T))
    mass = sum(part[0] for part in parts)
    if mass <= 0:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    center = sum((m * at for m, at, _ in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for m, at, own in parts:
        arm = at - center
        inertia += own + m * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return mass, center, inertia


def _fin(joint: Any, pose: Array, origin: Array) -> Fin:
    """The fin that a joint moves."""
    if joint.type not in ("revolute", "continuous"):
        raise LayoutError(
            f"joint {joint.name!r:.60} is {joint.type}; a fin's joint turns: revolute or continuous"
        )
    axis = pose[:3, :3] @ _numbers(joint.axis, np.eye(3)[0], f"the axis of joint {joint.name!r:.60}")
    size = float(np.linalg.norm(axis))
    tilt = math.asin(min(abs(axis[2]) / size, 1.0)) if size > 0 else math.pi / 2
    if tilt > MAX_TILT:
        raise LayoutError(
            f"the axis of joint {joint.name!r:.60} leaves the horizontal plane by {math.degrees(tilt):.0f} "
            f"degrees; finlab's fins have horizontal shafts (up to {math.degrees(MAX_TILT):.0f})"
        )
    position = pose[:3, 3] - origin
    # A joint may turn about the same line the other way round; finlab's shafts point out of the hull.
    outward = axis if axis[:2] @ position[:2] >= 0 else -axis
    x, y, z = position.tolist()
    return Fin(str(joint.child), (x, y, z), math.atan2(outward[1], outward[0]))


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
    write_whole(path, urdf_text(layout))


def urdf_text(layout: Layout) -> str:
    """The contents of the URDF file."""
    layout.only_fins("a URDF file", horizontal=True)
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
        SubElement(joint, "origin", xyz=_text(fin.position), rpy=_text((0.0, 0.0, fin.shaft_azimuth)))
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
