"""Robot descriptions, URDF of ROS or SDF of Gazebo: where links and joints are, what they weigh, and plugins.

A description is taken in its zero position, in the frame of its root link or model: x forward, y left, z up
(REP-103). Nothing but its text is read; models inside a model and <include> stay closed.
"""

import math
import re
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from typing import NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from finlab.arrays import Array
from finlab.errors import LayoutError

Named = dict[str, Element]
"""Links, joints and frames by `link NAME`, `joint NAME` and `frame NAME`."""
ADDED = ("xx", "yy", "zz", "pp", "qq", "rr")
"""Diagonal of SDF's <fluid_added_mass>."""
MOMENTS = ("xx", "xy", "xz", "yy", "yz", "zz")
"""Names of the entries of an inertia."""
TURNING = ("revolute", "continuous")
"""Kinds of joints that turn."""


class Joint(NamedTuple):
    """A joint, in the frame of its description."""

    name: str
    kind: str
    parent: str
    child: str
    place: Array
    """Where it is (3,) [m]."""
    axis: Array
    """What it turns about (3,), of length 1; of any length for a fixed joint."""
    ends: tuple[float, float]
    """Least and greatest angle [rad]; infinite where nothing limits it."""


@dataclass(frozen=True)
class Description:
    """What a description says, in its own frame."""

    name: str
    joints: dict[str, Joint]
    """Those that move a link, by their own names."""
    movers: dict[str, Joint]
    """The same by the names of the links."""
    mass: float
    """[kg]; 0 where no link has one."""
    center: Array
    """Centre of gravity (3,) [m]."""
    inertia: Array
    """(3, 3) about the centre of gravity [kg m^2]."""
    added: Array
    """Added mass (6,), diagonal [kg, kg m^2]; 0 where no link has one."""
    plugins: list[Element]


def parse_description(text: str, name: str) -> Description:
    """Returns what a URDF or SDF text says; `name` is what the robot is called where it has none.

    Raises:
        LayoutError: it is neither, it uses what is not allowed, or something in it is missing or no number.
    """
    root = _root(text)
    models = [root] if root.tag == "robot" else list(root.iter("model"))
    if not models:
        raise LayoutError(f"expected a <robot> of URDF or a <model> of SDF, got <{root.tag:.40}>")
    top = next((model for model in models if model.find(".//plugin") is not None), models[0])
    named = {f"{tag} {_name(part)}": part for tag in ("link", "joint", "frame") for part in top.findall(tag)}
    movers = {said(part, "child@link"): key for key, part in named.items() if part.tag == "joint"}
    hung = {key: _hung(part, named, movers) for key, part in named.items()}
    poses = _placed(hung)
    moving = [_joint(part, named, poses) for part in top.findall("joint")]
    joints = {joint.name: joint for joint in moving if f"link {joint.child}" in named}
    movers_of = {joint.child: joint for joint in joints.values()}
    plugins = [*top.findall("gazebo/plugin"), *top.findall("plugin"), *top.findall("link/plugin")]
    return Description(top.get("name") or name, joints, movers_of, *_masses(named, poses), plugins)


def said(element: Element, paths: str, usual: str = "") -> str:
    """Returns the first text among some paths below an element, an attribute behind @; else what is usual."""
    for path in paths.split():
        place, _, attribute = path.partition("@")
        found = element.find(place)
        if found is not None:
            text = found.get(attribute) if attribute else found.text
            if text and text.strip():
                return text.strip()
    return usual


def numbers(text: str, count: int, what: str) -> Array:
    """Returns numbers (count,) with blanks between; `what` they are goes into the error."""
    try:
        values = np.array(text.split(), dtype=np.float64)
    except ValueError:
        values = np.empty(0)
    if values.shape != (count,) or not (np.abs(values) < 1e9).all():
        raise LayoutError(f"{what} is not {count} numbers of ordinary size")
    return values


def number(element: Element, paths: str, usual: float = 0.0) -> float:
    """Returns the number at one of some paths, as `said`; what is usual where there is none."""
    text = said(element, paths)
    return float(numbers(text, 1, f"<{paths}>")[0]) if text else usual


def _root(text: str) -> Element:
    """The outermost element. Entities could pull in other files or grow without bound, and descriptions have
    no use for them; as the text is UTF-8 whatever its first line says, no other encoding can hide them."""
    text = re.sub(r"^\s*<\?xml[^>]*\?>", "", text)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise LayoutError("declares a DOCTYPE or entities, which are not allowed; remove them")
    if re.search(r"<xacro:|\$\{|\$\((?:find|arg) ", re.sub(r"(?s)<!--.*?-->", "", text)):
        raise LayoutError("is a xacro file, not a robot description; run `xacro FILE > robot.urdf` first")
    try:
        return ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:
        raise LayoutError(f"is not readable XML: {str(error)[:120]}") from None


def _name(element: Element) -> str:
    name = element.get("name")
    if not name:
        raise LayoutError(f"has a <{element.tag}> without a name")
    return name


def _hung(part: Element, named: Named, movers: dict[str, str]) -> tuple[str, Array]:
    """What a frame hangs on ("" for the description itself), and its pose there: in URDF a joint on its
    parent, and a link where its joint is; in SDF a link on the model, and a joint on its child."""
    told = said(part, "pose@relative_to") or part.get("attached_to", "")
    if told:
        return _key(told, named), _pose(part)
    if part.tag == "joint":
        return f"link {said(part, 'parent@link child')}", _pose(part)
    return movers.get(part.get("name", ""), "") if part.tag == "link" else "", _pose(part)


def _key(name: str, named: Named) -> str:
    """The key of the frame that SDF calls by a name."""
    if name in ("", "__model__"):
        return ""
    return next((f"{tag} {name}" for tag in ("link", "joint", "frame") if f"{tag} {name}" in named), name)


def _pose(part: Element) -> Array:
    """The pose (4, 4) that a part has as <origin> in URDF, or as <pose> in SDF."""
    what, found = f"the pose of {part.tag} {part.get('name', '')!r:.60}", part.find("pose")
    text = " ".join(said(part, f"origin@{key}", "0 0 0") for key in ("xyz", "rpy"))
    quaternion = found is not None and found.get("rotation_format") == "quat_xyzw"
    values = numbers(said(part, "pose", text), 7 if quaternion else 6, what)
    if quaternion and not values[3:].any():
        raise LayoutError(f"{what} has a quaternion without length")
    degrees = found is not None and found.get("degrees") == "true"
    turn = Rotation.from_quat(values[3:]) if quaternion else Rotation.from_euler("xyz", values[3:], degrees)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn.as_matrix(), values[:3]
    return pose


def _placed(hung: dict[str, tuple[str, Array]]) -> dict[str, Array]:
    """Poses (4, 4) of frames in the description's own, from what each hangs on and its pose there."""
    poses = {"": np.eye(4)}
    try:
        for key in TopologicalSorter({key: [base] for key, (base, _) in hung.items()}).static_order():
            if key:
                base, pose = hung[key]
                poses[key] = poses[base] @ pose
    except (CycleError, KeyError) as error:
        where = f"{error.args[-1]!r:.80}"
        raise LayoutError(
            f"has no place for {where}: it is missing, or hangs on itself in a circle"
        ) from None
    return poses


def _joint(part: Element, named: Named, poses: dict[str, Array]) -> Joint:
    name, what = _name(part), f"joint {_name(part)!r:.60}"
    xyz, kind = part.find("axis/xyz"), part.get("type", "")
    seen_from = xyz.get("expressed_in") if xyz is not None else None
    frame = _key(seen_from, named) if seen_from else f"joint {name}"
    if frame not in poses:
        raise LayoutError(f"has no frame {seen_from!r:.60}, in which the axis of {what} is expressed")
    usual = "1 0 0" if part.find("parent[@link]") is not None else "0 0 1"
    axis = poses[frame][:3, :3] @ numbers(said(part, "axis@xyz axis/xyz", usual), 3, f"the axis of {what}")
    place = poses[f"joint {name}"][:3, 3]
    length = float(np.linalg.norm(axis))
    if length == 0.0 and kind in TURNING:
        raise LayoutError(f"the axis of {what} has no length")
    texts = (said(part, f"limit@{end} axis/limit/{end}") for end in ("lower", "upper"))
    try:
        low, high = (float(text or math.inf) if kind != "continuous" else math.inf for text in texts)
    except ValueError:
        raise LayoutError(f"a limit of {what} is no number") from None
    ends = (low, high) if max(abs(low), abs(high)) < 1e9 else (-math.inf, math.inf)
    names = said(part, "parent@link parent"), said(part, "child@link child")
    return Joint(name, kind, *names, place, axis / (length or 1.0), ends)


def _masses(named: Named, poses: dict[str, Array]) -> tuple[float, Array, Array, Array]:
    """Mass, centre of gravity (3,), inertia (3, 3) about it and added mass (6,) of all links together."""
    parts, added = [], np.zeros(6)
    for key, link in named.items():
        inertial = link.find("inertial")
        if inertial is not None:
            told = [number(inertial, f"inertia@i{moment} inertia/i{moment}") for moment in MOMENTS]
            inertia = np.array(told)[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]]
            pose = poses[key] @ _pose(inertial)
            own = pose[:3, :3] @ inertia @ pose[:3, :3].T
            parts.append((number(inertial, "mass@value mass"), pose[:3, 3], own))
            added += [number(inertial, f"fluid_added_mass/{axis}") for axis in ADDED]
    mass, center, inertia = sum(part[0] for part in parts), np.zeros(3), np.zeros((3, 3))
    if mass > 0.0:
        center = sum((kg * at for kg, at, _ in parts), center) / mass
        for kg, at, own in parts:
            arm = at - center
            inertia += own + kg * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return mass, center, inertia, added
