"""Robot descriptions, URDF of ROS or SDF of Gazebo: where links and joints are, what they weigh,
and plugins.

A description is taken in its zero position, in the frame of its root link or model: x forward, y
left, z up (REP-103). Nothing but its text is read: models inside a model are parts of it, and what
is included is named.
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
from finlab.exchange.xacro_files import expanded
from finlab.exchange.xml_models import Drives, Named, chosen, is_xacro, parts_of, root_of

ADDED = ("xx", "yy", "zz", "pp", "qq", "rr")
"""Diagonal of SDF's <fluid_added_mass>."""
MOMENTS = ("xx", "xy", "xz", "yy", "yz", "zz")
"""Names of the entries of an inertia."""
TURNING = ("revolute", "continuous")
"""Kinds of joints that turn."""


class Joint(NamedTuple):
    """A joint, in the frame of its description: its place (3,) [m], the axis (3,) that it turns
    about, of length 1 unless it is fixed, and least and greatest angle [rad], infinite where
    nothing limits it."""

    name: str
    kind: str
    parent: str
    child: str
    place: Array
    axis: Array
    ends: tuple[float, float]


@dataclass(frozen=True)
class Description:
    """What a description says, in its own frame."""

    name: str
    joints: dict[str, Joint]
    """Those that move a link, by their own names, and by the names of the links."""
    movers: dict[str, Joint]
    mass: float
    """[kg], 0 where no link has one, and centre of gravity (3,) [m]."""
    center: Array
    inertia: Array | None
    """(3, 3) about the centre of gravity [kg m^2]; None where a link with a mass has none."""
    added: dict[str, float]
    """Added mass by the name of its entry (`xx`), all links together [kg, kg m^2]."""
    plugins: list[tuple[str, Element]]
    """With the scope of the names in them; what the description includes is named, and not read."""
    included: list[str]


def parse_description(root: Element, name: str, drives: Drives, exchange: Exchange) -> Description:
    """Returns what the outermost element of URDF or SDF says; `name` is the robot's where it has
    none.

    Of several models it is the one that `exchange` names, or the first with a plugin that `drives`
    one. Raises LayoutError: it is neither, it uses what is not allowed, or something in it is
    missing or no number."""
    if is_xacro(root):
        root = root_of(expanded(exchange.path))
        exchange.note("It was expanded by xacro.")
    top = chosen(root, drives, exchange)
    named, plugins, included = parts_of(top)
    movers = {
        said(part, "child@link"): key for key, (_, part) in named.items() if part.tag == "joint"
    }
    poses = _placed({key: _hung(*each, named, movers) for key, each in named.items()}, included)
    old = root.tag == "sdf" and root.get("version", "") in ("1.0", "1.1", "1.2", "1.3", "1.4")
    known = [each for key, each in named.items() if each[1].tag == "joint" and key in poses]
    moving = [_joint(*each, named, poses, old) for each in known]
    joints = {joint.name: joint for joint in moving if f"link {joint.child}" in named}
    if included:
        exchange.note(f"What it includes is left out, with its mass: {', '.join(included)[:300]}.")
    by_link = {joint.child: joint for joint in joints.values()}
    return Description(
        top.get("name") or name, joints, by_link, *_masses(named, poses), plugins, included
    )


def said(element: Element, paths: str, usual: str = "") -> str:
    """Returns the first text among some paths below an element, an attribute behind @; else what is
    usual."""
    for path in paths.split():
        place, _, attribute = path.partition("@")
        part = element.find(place)
        if part is not None:
            text = part.get(attribute) if attribute else part.text
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


def _hung(scope: str, part: Element, named: Named, movers: dict[str, str]) -> tuple[str, Array]:
    """What a frame hangs on ("" for the description itself), and its pose there: in URDF a joint on
    its parent, and a link where its joint is; in SDF a link or model on the model, and a joint on
    its child."""
    base = said(part, "pose@relative_to") or part.get("attached_to", "")
    if not base and part.tag == "joint":
        base = said(part, "parent@link child")
    mover = movers.get(part.get("name", "")) if part.tag == "link" and not base else None
    return mover or _key(scope, base, named), _pose(part)


def _key(scope: str, name: str, named: Named) -> str:
    """The key of the frame that a description calls by a name in a scope."""
    if name in ("", "__model__"):
        return f"model {scope[:-2]}" if scope else ""
    keys = (f"{tag} {scope}{name}" for tag in ("link", "joint", "frame", "model"))
    return next((key for key in keys if key in named), f"{scope}{name}")


def _pose(part: Element) -> Array:
    """The pose (4, 4) that a part has as <origin> in URDF, or as <pose> in SDF."""
    if part.find("origin") is None and part.find("pose") is None:
        return np.eye(4)
    what = f"the pose of {part.tag} {part.get('name', '')!r:.60}"
    origin = " ".join(said(part, f"origin@{key}", "0 0 0") for key in ("xyz", "rpy"))
    quaternion = said(part, "pose@rotation_format") == "quat_xyzw"
    values = numbers(said(part, "pose", origin), 7 if quaternion else 6, what)
    pose = np.eye(4)
    turn = values[3:]
    pose[:3, 3] = values[:3]
    if quaternion and not turn.any():
        raise LayoutError(f"{what} has a quaternion without length")
    if turn.any():
        angles = np.radians(turn) if said(part, "pose@degrees") == "true" else turn
        rotation = Rotation.from_quat(turn) if quaternion else Rotation.from_euler("xyz", angles)
        pose[:3, :3] = rotation.as_matrix()
    return pose


def _placed(hung: dict[str, tuple[str, Array]], included: list[str]) -> dict[str, Array]:
    """Poses (4, 4) of frames in the description's own, from what each hangs on and its pose there;
    without those that hang on what is included."""
    poses = {"": np.eye(4)}
    lost = {*included}
    outside = tuple(f"{name}::" for name in included)
    try:
        for key in TopologicalSorter(
            {key: [base] for key, (base, _) in hung.items()}
        ).static_order():
            base, pose = hung.get(key, ("", poses[""]))
            if base in lost or (key not in hung and key.startswith(outside)):
                lost.add(key)
            elif key and key not in lost:
                poses[key] = poses[base] @ hung[key][1]
    except (CycleError, KeyError) as error:
        where = f"{error.args[-1]!r:.80}"
        raise LayoutError(
            f"has no place for {where}: missing, or hangs on itself in a circle"
        ) from None
    return poses


def _joint(scope: str, part: Element, named: Named, poses: dict[str, Array], old: bool) -> Joint:
    """A joint; in `old` SDF an axis is seen from the model, as where use_parent_model_frame says
    so."""
    own = part.get("name", "")
    kind = part.get("type", "")
    name = f"{scope}{own}"
    what = f"joint {own!r:.60}"
    seen_from = said(part, "axis/xyz@expressed_in")
    of_model = said(part, "axis/use_parent_model_frame", str(int(old))).lower() in ("1", "true")
    frame = (
        _key(scope, seen_from or "__model__", named) if seen_from or of_model else f"joint {name}"
    )
    if frame not in poses:
        raise LayoutError(
            f"has no frame {seen_from!r:.60}, in which the axis of {what} is expressed"
        )
    usual = "1 0 0" if part.find("parent[@link]") is not None else "0 0 1"
    axis = poses[frame][:3, :3] @ numbers(
        said(part, "axis@xyz axis/xyz", usual), 3, f"the axis of {what}"
    )
    length = float(np.linalg.norm(axis))
    if length == 0.0 and kind in TURNING:
        raise LayoutError(f"the axis of {what} has no length")
    try:
        low, high = (
            float(said(part, f"limit@{end} axis/limit/{end}", "inf")) for end in ("lower", "upper")
        )
    except ValueError:
        raise LayoutError(f"a limit of {what} is no number") from None
    ends = (
        (low, high)
        if max(abs(low), abs(high)) < 1e9 and kind != "continuous"
        else (-math.inf, math.inf)
    )
    parent, child = (
        _link(scope, said(part, f"{end}@link {end}"), named) for end in ("parent", "child")
    )
    return Joint(
        name, kind, parent, child, poses[f"joint {name}"][:3, 3], axis / (length or 1.0), ends
    )


def _link(scope: str, name: str, named: Named) -> str:
    """The name of a link with its scope; a frame stands for the link that it is attached to."""
    for _ in range(20):
        key = _key(scope, name, named)
        if not key.startswith("frame "):
            return key.removeprefix("link ")
        scope, part = named[key]
        name = part.get("attached_to", "")
    return name


def _masses(
    named: Named, poses: dict[str, Array]
) -> tuple[float, Array, Array | None, dict[str, float]]:
    """Mass, centre of gravity (3,), inertia (3, 3) about it and added mass of all links
    together."""
    parts = []
    added = dict[str, float]()
    known = True
    for key, (_, link) in named.items():
        inertial = link.find("inertial") if key in poses else None
        if inertial is not None:
            pose = poses[key] @ _pose(inertial)
            mass = number(inertial, "mass@value mass")
            paths = [f"inertia@i{moment} inertia/i{moment}" for moment in MOMENTS]
            inertia = np.array([number(inertial, path) for path in paths])[
                [[0, 1, 2], [1, 3, 4], [2, 4, 5]]
            ]
            known &= mass == 0.0 or all(said(inertial, paths[k]) for k in (0, 3, 5))
            parts.append((mass, pose[:3, 3], pose[:3, :3] @ inertia @ pose[:3, :3].T))
            for axis in ADDED:
                if said(inertial, f"fluid_added_mass/{axis}"):
                    added[axis] = added.get(axis, 0.0) + number(
                        inertial, f"fluid_added_mass/{axis}"
                    )
    total = sum(part[0] for part in parts)
    center = np.zeros(3)
    about = np.zeros((3, 3))
    if total > 0.0:
        center = sum((kg * at for kg, at, _ in parts), center) / total
        for kg, at, own in parts:
            arm = at - center
            about += own + kg * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return total, center, about if known else None, added
