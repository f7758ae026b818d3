"""Parses robot descriptions, URDF of ROS or SDF of Gazebo: joints, masses and plugins.

A description is taken in its zero position, in the frame of its root link or model: x forward, y
left, z up (REP-103). Nothing but its text is read: models inside a model are parts of it, and what
is included is named. `description_layout` makes a layout of the result.

Links, joints, frames and models have keys such as `link arm::hand`: the tag, the scope of the
models around it, and the name. The key of the description itself is empty.
"""

import math
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange.exchange import Exchange
from finlab.exchange.labels import listed
from finlab.exchange.links import TURNING, Joint, LinkMass, combined
from finlab.exchange.xacro_files import expand
from finlab.exchange.xml_models import (
    DrivesThruster,
    Elements,
    ScopedElement,
    is_xacro,
    model_elements,
    robot_model,
    root_of,
)

ADDED_MASS_TAGS = ("xx", "yy", "zz", "pp", "qq", "rr")
"""Tags of the diagonal of SDF's <fluid_added_mass>."""
INERTIA_ENTRIES = ("xx", "xy", "xz", "yy", "yz", "zz")
"""Entries of the upper triangle of an inertia, row by row."""
OLD_SDF = ("1.0", "1.1", "1.2", "1.3", "1.4")
"""Versions of SDF in which the axis of a joint is expressed in the frame of its model."""
MAX_ATTACHMENTS = 20
"""Most frames that are attached to one another in a row."""


class Visual(NamedTuple):
    """What a link looks like, or is taken for where it collides."""

    link: str
    """Name of the link."""
    element: Element
    """Its <visual> or <collision>."""
    pose: Array
    """Its pose (4, 4) in the frame of the description [m]."""


@dataclass(frozen=True)
class Description:
    """The content of a description, in its own frame."""

    name: str
    joints: dict[str, Joint]
    """Joints that move a link, by their names."""
    joint_of_link: dict[str, Joint]
    """The same joints by the names of the links that they move."""
    mass: float
    """Mass of all links [kg]; 0 where none has one."""
    center: Array
    """Centre of gravity of all links, (3,) [m]."""
    inertia: Array | None
    """(3, 3) about the centre of gravity [kg m^2]; None where a link with a mass has none."""
    added_mass: dict[str, float]
    """Added mass of all links by ADDED_MASS_TAGS [kg, kg m^2]; without tags that no link has."""
    plugins: list[tuple[str, Element]]
    """Plugins, with the scope of the names in each."""
    included: list[str]
    """Names of what is included from other files, and not read."""
    visuals: list[Visual]
    """What all links look like."""


class _Attachment(NamedTuple):
    """The pose of a link, joint, frame or model in another one."""

    base: str
    """Key of the other one; empty for the description itself."""
    pose: Array
    """(4, 4) [m]."""


def parse_description(
    root: Element, name: str, drives_thruster: DrivesThruster, exchange: Exchange
) -> Description:
    """Returns the content of a description.

    Of several models it is the one that `exchange` names, or the first with thrusters.

    Args:
        root: the outermost element.
        name: the robot's name where the description has none.
        drives_thruster: whether a plugin drives a thruster.
        exchange: the model, the path of the file, and the links that the user named; gets notes.

    Raises:
        LayoutError: it is neither URDF nor SDF, uses what is not allowed, or a value is missing or
            no number.
    """
    if is_xacro(root):
        root = root_of(expand(exchange.path))
        exchange.note("It was expanded by xacro.")
    model = robot_model(root, drives_thruster, exchange)
    elements, plugins, included = model_elements(model)
    joint_of_child = {
        text_at(element, "child@link"): key
        for key, (_, element) in elements.items()
        if element.tag == "joint"
    }
    attachments = {
        key: _attachment(scoped, elements, joint_of_child) for key, scoped in elements.items()
    }
    poses = _poses_in_description(attachments, included)
    axis_in_model = root.tag == "sdf" and root.get("version", "") in OLD_SDF
    joints: dict[str, Joint] = {}
    for key, scoped in elements.items():
        if scoped.element.tag == "joint" and key in poses:
            joint = _joint(scoped, elements, poses, axis_in_model)
            if f"link {joint.child}" in elements:
                joints[joint.name] = joint
    if included:
        exchange.note(f"What it includes is left out, with its mass: {', '.join(included)[:300]}.")
    is_sdf = root.tag in ("sdf", "model")
    masses = _masses(elements, poses, is_sdf, exchange)
    return Description(
        name=model.get("name") or name,
        joints=joints,
        joint_of_link={joint.child: joint for joint in joints.values()},
        mass=masses.total.mass,
        center=masses.total.center,
        inertia=masses.total.inertia if masses.is_inertia_known else None,
        added_mass=masses.added_mass,
        plugins=plugins,
        included=included,
        visuals=_visuals(elements, poses),
    )


def text_at(element: Element, paths: str, default: str = "") -> str:
    """Returns the first text at one of some paths below an element.

    Args:
        element: the element.
        paths: paths with blanks between; `path@name` is the attribute of what stands at the path.
        default: what is returned where nothing stands at any of them.
    """
    for path in paths.split():
        tags, _, attribute = path.partition("@")
        child = element.find(tags)
        if child is not None:
            text = child.get(attribute) if attribute else child.text
            if text and text.strip():
                return text.strip()
    return default


def numbers(text: str, count: int, what: str) -> Array:
    """Returns the numbers (count,) in a text, with blanks between; `what` goes into the error."""
    try:
        values = np.array(text.split(), dtype=np.float64)
    except ValueError:
        values = np.empty(0)
    if values.shape != (count,) or not (np.abs(values) < 1e9).all():
        expected = "a number" if count == 1 else f"{count} numbers"
        raise LayoutError(f"{what} is not {expected} of ordinary size")
    return values


def angles(text: str, what: str) -> Array:
    """Returns roll, pitch and yaw (3,) [rad] in a text, as `numbers`; one written as the rounded or
    cut decimals of quarter turns, or with three decimals or more of eighths, is as many exactly.

    Files say 1.5708 for a right angle. Taken to the letter, a thruster that points up would push
    ahead by some millionths, and hence along no axis alone.
    """
    values = numbers(text, 3, what)
    return np.array([_exact_angle(*pair) for pair in zip(values, text.split(), strict=True)])


def _exact_angle(angle: float, written: str) -> float:
    """An angle [rad], or the whole eighths of a turn that its decimals stand for."""
    decimals = written.partition(".")[2]
    digits = len(decimals)
    if not decimals.isdigit() or digits < 2:
        return float(angle)
    part = math.pi / 4 if digits >= 3 else math.pi / 2
    exact = abs(round(angle / part)) * part
    shift = 10.0**digits
    stands_for_it = round(abs(angle) * shift) in (math.floor(exact * shift), round(exact * shift))
    return math.copysign(exact, angle) if stands_for_it else float(angle)


def number(element: Element, paths: str, default: float = 0.0) -> float:
    """Returns the number at one of some paths, as `text_at`; the default where there is none."""
    text = text_at(element, paths)
    return float(numbers(text, 1, f"<{paths}>")[0]) if text else default


def _attachment(
    scoped: ScopedElement, elements: Elements, joint_of_child: dict[str, str]
) -> _Attachment:
    """The frame that an element is posed in, and its pose there.

    In URDF a joint is posed in its parent, and a link sits where its joint is; in SDF a link or
    model is posed in the model around it, and a joint in its child.
    """
    scope, element = scoped
    base = text_at(element, "pose@relative_to") or element.get("attached_to", "")
    if not base and element.tag == "joint":
        base = text_at(element, "parent@link child")
    if not base and element.tag == "link":
        joint = joint_of_child.get(element.get("name", ""))
        if joint:
            return _Attachment(joint, _pose(element))
    return _Attachment(_key(scope, base, elements), _pose(element))


def _key(scope: str, name: str, elements: Elements) -> str:
    """The key of the frame that a description calls by a name in a scope."""
    if name in ("", "__model__"):
        return f"model {scope[:-2]}" if scope else ""
    for tag in ("link", "joint", "frame", "model"):
        key = f"{tag} {scope}{name}"
        if key in elements:
            return key
    return f"{scope}{name}"


def _pose(element: Element) -> Array:
    """The pose (4, 4) that an element has as <origin> in URDF, or as <pose> in SDF."""
    if element.find("origin") is None and element.find("pose") is None:
        return np.eye(4)
    what = f"the pose of {element.tag} {element.get('name', '')!r:.60}"
    origin = " ".join(text_at(element, f"origin@{key}", "0 0 0") for key in ("xyz", "rpy"))
    is_quaternion = text_at(element, "pose@rotation_format") == "quat_xyzw"
    text = text_at(element, "pose", origin)
    values = numbers(text, 7 if is_quaternion else 6, what)
    pose = np.eye(4)
    pose[:3, 3] = values[:3]
    rotation = values[3:]
    if is_quaternion and not rotation.any():
        raise LayoutError(f"{what} has a quaternion without length")
    if is_quaternion:
        pose[:3, :3] = Rotation.from_quat(rotation).as_matrix()
    elif rotation.any():
        in_degrees = text_at(element, "pose@degrees") == "true"
        turns = np.radians(rotation) if in_degrees else angles(" ".join(text.split()[3:]), what)
        pose[:3, :3] = Rotation.from_euler("xyz", turns).as_matrix()
    return pose


def _poses_in_description(
    attachments: dict[str, _Attachment], included: list[str]
) -> dict[str, Array]:
    """Poses (4, 4) in the description's frame by key, without what is attached to something
    included, which is not read."""
    poses = {"": np.eye(4)}
    unknown = {*included}
    scopes_of_included = tuple(f"{name}::" for name in included)
    bases = {key: [attachment.base] for key, attachment in attachments.items()}
    try:
        for key in TopologicalSorter(bases).static_order():
            attachment = attachments.get(key)
            if attachment is None:  # named as a base, and no element of the description
                if key.startswith(scopes_of_included):
                    unknown.add(key)
                elif key and key not in unknown:
                    raise KeyError(key)
            elif attachment.base in unknown:
                unknown.add(key)
            elif key not in unknown:
                poses[key] = poses[attachment.base] @ attachment.pose
    except (CycleError, KeyError) as error:
        where = f"{error.args[-1]!r:.80}"
        raise LayoutError(
            f"has no place for {where}: missing, or hangs on itself in a circle"
        ) from None
    return poses


def _joint(
    scoped: ScopedElement, elements: Elements, poses: dict[str, Array], axis_in_model: bool
) -> Joint:
    """A joint in the description's frame.

    Args:
        scoped: its element.
        elements: all elements by key.
        poses: their poses by key.
        axis_in_model: whether its axis is expressed in the frame of its model where it does not say
            so itself (use_parent_model_frame); else in that of the joint.
    """
    scope, element = scoped
    local_name = element.get("name", "")
    name = f"{scope}{local_name}"
    kind = element.get("type", "")
    what = f"joint {local_name!r:.60}"
    expressed_in = text_at(element, "axis/xyz@expressed_in")
    in_model = text_at(element, "axis/use_parent_model_frame", str(int(axis_in_model)))
    if expressed_in or in_model.lower() in ("1", "true"):
        frame = _key(scope, expressed_in or "__model__", elements)
    else:
        frame = f"joint {name}"
    if frame not in poses:
        raise LayoutError(
            f"has no frame {expressed_in!r:.60}, in which the axis of {what} is expressed"
        )
    is_urdf = element.find("parent[@link]") is not None
    axis_text = text_at(element, "axis@xyz axis/xyz", "1 0 0" if is_urdf else "0 0 1")
    axis = poses[frame][:3, :3] @ numbers(axis_text, 3, f"the axis of {what}")
    length = float(np.linalg.norm(axis))
    if length == 0.0 and kind in TURNING:
        raise LayoutError(f"the axis of {what} has no length")
    try:
        lower = float(text_at(element, "limit@lower axis/limit/lower", "inf"))
        upper = float(text_at(element, "limit@upper axis/limit/upper", "inf"))
    except ValueError:
        raise LayoutError(f"a limit of {what} is no number") from None
    is_limited = max(abs(lower), abs(upper)) < 1e9 and kind != "continuous"
    return Joint(
        name=name,
        kind=kind,
        parent=_link_name(scope, text_at(element, "parent@link parent"), elements),
        child=_link_name(scope, text_at(element, "child@link child"), elements),
        position=poses[f"joint {name}"][:3, 3],
        axis=axis / (length or 1.0),
        limits=(lower, upper) if is_limited else (-math.inf, math.inf),
    )


def _link_name(scope: str, name: str, elements: Elements) -> str:
    """The name of a link with its scope; a frame stands for the link that it is attached to."""
    for _ in range(MAX_ATTACHMENTS):
        key = _key(scope, name, elements)
        if not key.startswith("frame "):
            return key.removeprefix("link ")
        scope, element = elements[key]
        name = element.get("attached_to", "")
    return name


def _visuals(elements: Elements, poses: dict[str, Array]) -> list[Visual]:
    """What all links look like, and where they collide."""
    visuals = []
    for key, (scope, element) in elements.items():
        if key not in poses or element.tag != "link":
            continue
        for child in element:
            if child.tag not in ("visual", "collision"):
                continue
            base = text_at(child, "pose@relative_to")
            frame = _key(scope, base, elements) if base else key
            if frame in poses:
                pose = poses[frame] @ _pose(child)
                visuals.append(Visual(key.removeprefix("link "), child, pose))
    return visuals


class _Masses(NamedTuple):
    """Masses of all links together."""

    total: LinkMass
    is_inertia_known: bool
    """Whether every link with a mass has an inertia."""
    added_mass: dict[str, float]
    """As in `Description`."""


def _masses(
    elements: Elements, poses: dict[str, Array], is_sdf: bool, exchange: Exchange
) -> _Masses:
    """The masses of all links together.

    A link that says no mass has none. SDF would give it 1 kg and 1 kg m^2, which is no propeller's
    and moves the centre of gravity: a note says so.
    """
    links = []
    added_mass: dict[str, float] = {}
    is_inertia_known = True
    without_mass = []
    for key, (_, element) in elements.items():
        if key not in poses or element.tag != "link":
            continue
        inertial = element.find("inertial")
        has_mass = inertial is not None and bool(text_at(inertial, "mass@value mass"))
        if is_sdf and not has_mass:
            without_mass.append(key.removeprefix("link "))
        if inertial is None:
            continue
        pose = poses[key] @ _pose(inertial)
        mass = number(inertial, "mass@value mass")
        paths = {entry: f"inertia@i{entry} inertia/i{entry}" for entry in INERTIA_ENTRIES}
        triangle = np.array([number(inertial, path) for path in paths.values()])
        inertia = triangle[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]]  # (3, 3), symmetric
        has_inertia = all(text_at(inertial, paths[entry]) for entry in ("xx", "yy", "zz"))
        is_inertia_known &= mass == 0.0 or has_inertia
        rotation = pose[:3, :3]
        links.append(LinkMass(mass, pose[:3, 3], rotation @ inertia @ rotation.T))
        for tag in ADDED_MASS_TAGS:
            path = f"fluid_added_mass/{tag}"
            if text_at(inertial, path):
                added_mass[tag] = added_mass.get(tag, 0.0) + number(inertial, path)
    total = combined(links)
    if without_mass and total.mass > 0.0:
        exchange.note(
            f"No mass stands at link {listed(without_mass)}: 0 is taken, where SDF takes 1 kg and "
            "1 kg m^2, which moves the centre of gravity",
            "give it an <inertial>",
            field="body.mass_kg",
        )
    return _Masses(total, is_inertia_known, added_mass)
