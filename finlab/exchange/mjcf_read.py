"""Reads MuJoCo models (MJCF): a motor or a general actuator that pushes at a site is a thruster.

The wrench of an actuator at a site is gain x ctrl x gear, gear[0:3] the force and gear[3:6] the
torque, in the frame of the site. A site on a body that a hinge turns makes an azimuth; a body whose
hinge is a fin's shaft is named by the user (`--fins`). The robot is the outermost body around the
sites, in its zero position and its own frame: x forward, y left, z up.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange.description import Description, numbers
from finlab.exchange.description_body import body_of
from finlab.exchange.exchange import Exchange
from finlab.exchange.labels import listed
from finlab.exchange.link_names import questions_of_links
from finlab.exchange.links import TURNING, Joint, LinkMass, combined
from finlab.exchange.mjcf_file import ACTUATOR_TAGS, Attributes, MjcfFile
from finlab.exchange.mjcf_geom import Geom, read_geom, solid_of
from finlab.exchange.mjcf_mass import geom_mass
from finlab.exchange.mounts import fin_on, on_mount
from finlab.exchange.questions import QuestionError, which_origin, which_robot
from finlab.exchange.visuals import Solid, hull_of, note_meshes
from finlab.layout import MAX_ACTUATORS, Actuator, Body, Layout, Thruster

MAX_PARTS = 20_000
"""Most bodies, frames, joints, sites and geoms of a robot."""
SPIN = 1.0 - 1e-6
"""Cosine from which on a thrust is along the hinge of its body: a propeller that spins."""
NO_FORCE = 1e-9
"""Force of a gear below which it is one of torque alone [N per unit]."""
JOINT_KINDS = {"hinge": "revolute", "slide": "prismatic", "ball": "ball", "free": "floating"}
"""Kinds of joints as descriptions call them."""
MOTOR_LIKE = {"gaintype": "fixed", "biastype": "none"}
"""What a general actuator has that gives gain x ctrl."""
MAKERS = ("replicate", "composite", "flexcomp", "attach")
"""Elements that make bodies, which are not made here."""
FLUID = ("density", "viscosity")
"""Attributes of <option> of the water as MuJoCo has it."""


class _Site(NamedTuple):
    """A site of the robot."""

    link: str
    """The body that it is on."""
    pose: Array
    """(4, 4) in the frame of the robot [m]."""


@dataclass
class _Robot:
    """Joints, sites and masses of one outermost body, in its frame."""

    name: str
    sites: dict[str, _Site] = field(default_factory=dict)
    joints: dict[str, Joint] = field(default_factory=dict)
    joint_of_link: dict[str, Joint] = field(default_factory=dict)
    masses: list[LinkMass] = field(default_factory=list)
    is_free: bool = False
    """Whether it has a free joint."""
    solids: list[Solid] = field(default_factory=list)
    """What the bodies that do not move in it look like."""
    meshes: list[str] = field(default_factory=list)
    """Names of the bodies that look like a mesh, of those that do not move in it."""
    without_mass: list[str] = field(default_factory=list)
    """Geoms whose mass is that of a mesh, or of a hull without thickness."""
    not_made: list[str] = field(default_factory=list)
    """Elements in it that would make bodies."""


class _Push(NamedTuple):
    """What a motor gives for its ctrl."""

    name: str
    site: str
    gear: Array
    """Force and torque (6,) for each unit of gain x ctrl, in the frame of the site [N, N m]."""
    gain: float
    limits: tuple[float, float] | None
    """Least and most gain x ctrl; None where nothing limits it."""
    time_constant: float | None
    """[s]; None where the force follows at once."""


def read_mjcf(root: Element, name: str, exchange: Exchange) -> Layout:
    """Returns the layout in a model of MuJoCo.

    Args:
        root: the outermost element.
        name: the layout's name where the model has none.
        exchange: which bodies are fins or thrusters, and what to take for the origin; gets the
            notes.

    Raises:
        LayoutError: the model cannot be read, or nothing in it pushes.
    """
    file = MjcfFile(root, exchange)
    pushes, others = _actuators(file)
    robot = _robot(file, pushes, exchange)
    total = combined(robot.masses)
    at_gravity = exchange.origin == "gravity"
    if at_gravity and (robot.without_mass or total.mass <= 0.0):
        geoms = f": that of a mesh is not computed ({listed(robot.without_mass)})"
        raise QuestionError(
            f"has no mass of body {robot.name!r:.60}{geoms if robot.without_mass else ''}; give it "
            "an <inertial>, or take --origin base if its origin is the centre of gravity",
            questions=(which_origin(f"The file has no mass of body {robot.name}."),),
        )
    origin = total.center if at_gravity else np.zeros(3)
    description = Description(
        name=(root.get("model") or "").strip()[:64] or name,
        joints=robot.joints,
        joint_of_link=robot.joint_of_link,
        mass=total.mass,
        center=total.center,
        inertia=total.inertia,
        added_mass={},
        plugins=[],
        included=[],
        visuals=[],
    )
    actuators, turned = _layout_actuators(robot, pushes, origin, others, exchange)
    left_out = {key: why for key, why in others.items() if key not in turned}
    if not actuators:
        raise QuestionError(
            "has no motor or general that pushes at a site of a body; it has "
            f"{listed(_shown(left_out))}; bodies on joints may be named --fins or --thrusters: "
            f"{listed(robot.joint_of_link)}",
            questions=questions_of_links(robot.joint_of_link),
        )
    if left_out:
        exchange.note(f"Left out, since they are no thrusters: {listed(_shown(left_out))}.")
    _note_model(file, robot, description, exchange)
    body = body_of(description, exchange) if at_gravity else None
    note_meshes(robot.meshes, "body", exchange)
    hull = hull_of(robot.solids, "body", origin, exchange)
    if hull is not None:
        body = replace(body or Body(), hull=hull)
    origin_name = "centre of gravity" if at_gravity else f"frame of body {robot.name}"
    return Layout(description.name, tuple(actuators), f"Origin at the {origin_name}.", body)


def _shown(others: Mapping[str, str]) -> list[str]:
    """Actuators that are left out, as a sentence names them."""
    return [f"{name} ({why})" for name, why in others.items()]


def _note_model(
    file: MjcfFile, robot: _Robot, description: Description, exchange: Exchange
) -> None:
    """Says what was read of a model, and what was not."""
    exchange.note(
        f"Body {robot.name} of model {description.name} was read, x forward, y left, z up, in m, "
        "kg and N."
    )
    if not robot.is_free:
        exchange.note(f"Body {robot.name} has no free joint, and is taken as the robot.")
    if robot.not_made:
        exchange.note(f"What it makes is not read, with its mass: {listed(robot.not_made)}.")
    fluid = []
    for option in file.root.findall("option"):
        for key in FLUID:
            if option.get(key, "0").strip() not in ("0", "0.0"):
                fluid.append(key)
    if fluid:
        exchange.note(
            f"The water of MuJoCo ({', '.join(fluid)}) is not read: added mass and damping are "
            "unknown.",
            field="body.added_mass",
        )
    for key in ("settotalmass", "boundmass", "boundinertia", "balanceinertia"):
        if file.compiler.get(key, "false") not in ("false", "0", "-1"):
            exchange.note(f"{key} of <compiler> is not read: masses are those that are written.")


def _actuators(file: MjcfFile) -> tuple[list[_Push], dict[str, str]]:
    """The actuators that push at a site, and why each of the others does not."""
    pushes: list[_Push] = []
    others: dict[str, str] = {}
    elements: list[Element] = []
    for section in file.root.findall("actuator"):
        elements += [element for element in section if element.tag in ACTUATOR_TAGS]
    for k, element in enumerate(elements):
        attributes = file.attributes(element)
        site = attributes.get("site", "")
        name = attributes.get("name") or site or f"{element.tag}{k + 1}"
        why = _why_not(attributes, element.tag)
        if why:
            others[name] = why
        elif len(pushes) > MAX_ACTUATORS:
            break  # one too many, for the layout to refuse
        else:
            pushes.append(_push(file, attributes, name, site))
    return pushes, others


def _why_not(attributes: Attributes, tag: str) -> str:
    """Why an actuator is no thruster; empty where it is one."""
    for key in ("joint", "jointinparent", "tendon", "body", "cranksite"):
        if key in attributes:
            return f"{tag} of {key} {attributes[key]}"[:100]
    if "site" not in attributes:
        return f"{tag} of no site"
    if "refsite" in attributes:
        return f"{tag} between two sites"
    if tag not in ("motor", "general"):
        return f"{tag} of site {attributes['site']}"[:100]
    for key in ("gaintype", "biastype"):
        if attributes.get(key, MOTOR_LIKE[key]) != MOTOR_LIKE[key]:
            return f"{tag} of {key} {attributes[key]}"[:100]
    if attributes.get("dyntype", "none") not in ("none", "filter", "filterexact"):
        return f"{tag} of dyntype {attributes['dyntype']}"[:100]
    return ""


def _push(file: MjcfFile, attributes: Attributes, name: str, site: str) -> _Push:
    """What an actuator at a site gives."""
    what = f"actuator {name!r:.60}"
    words = attributes.get("gear", "1").split()[:6]
    gear = numbers(" ".join([*words, *["0"] * (6 - len(words))]), 6, f"gear of {what}")
    gain = numbers(attributes.get("gainprm", "1").split()[0], 1, f"gainprm of {what}")[0]
    limits = _range_of(file, attributes, "ctrl", what)
    time_constant = None
    if attributes.get("dyntype", "none") != "none":
        time_constant = numbers(attributes.get("dynprm", "1").split()[0], 1, f"dynprm of {what}")[0]
        limits = _narrower(limits, _range_of(file, attributes, "act", what))
    if limits is not None:
        low, high = sorted((gain * limits[0], gain * limits[1]))
        limits = (low, high)
    limits = _narrower(limits, _range_of(file, attributes, "force", what))
    if limits is not None and not limits[0] <= 0.0 <= limits[1]:
        low, high = limits
        raise LayoutError(
            f"{what} cannot stop: its force goes from {low:g} to {high:g} of its gear"
        )
    return _Push(name, site, gear, float(gain), limits, time_constant)


def _range_of(
    file: MjcfFile, attributes: Attributes, kind: str, what: str
) -> tuple[float, float] | None:
    """The range of ctrl, act or force of an actuator; None where it is not limited."""
    key = f"{kind}range"
    is_limited = attributes.get(f"{kind}limited", "auto")
    if is_limited == "auto":
        is_automatic = file.compiler.get("autolimits", "true") != "false"
        is_limited = "true" if key in attributes and is_automatic else "false"
    if is_limited != "true":
        return None
    low, high = numbers(attributes.get(key, "0 0"), 2, f"{key} of {what}").tolist()
    if not low < high:
        raise LayoutError(f"{key} of {what} is {low:g} to {high:g}, expected one that rises")
    return low, high


def _narrower(
    one: tuple[float, float] | None, other: tuple[float, float] | None
) -> tuple[float, float] | None:
    """The range that two have in common; one of them where the other has no limits."""
    if one is None or other is None:
        return one or other
    return max(one[0], other[0]), min(one[1], other[1])


def _robot(file: MjcfFile, pushes: list[_Push], exchange: Exchange) -> _Robot:
    """The outermost body that is the robot: the one that the user names, or the first with sites of
    actuators or bodies that the user names."""
    top: list[tuple[Element, str]] = []
    stack = [(section, "") for section in reversed(file.root.findall("worldbody"))]
    while stack:
        element, child_class = stack.pop()
        for child in element:
            inherited = child.get("childclass", child_class)
            if child.tag == "body":
                top.append((child, inherited))
            elif child.tag == "frame":
                stack.append((child, inherited))
    names = [body.get("name", "") for body, _ in top]
    if not top:
        raise LayoutError("has no <body>, expected a model of a robot")
    if exchange.model is not None:
        if exchange.model not in names:
            raise LayoutError(f"has no body {exchange.model!r:.60}; it has {listed(names)}")
        return _parts(file, *top[names.index(exchange.model)])
    wanted_sites = {push.site for push in pushes}
    wanted_links = {*exchange.fins, *exchange.thrusters}
    likely = []
    for body, child_class in top:
        sites = {site.get("name", "") for site in body.iter("site")}
        links = {link.get("name", "") for link in body.iter("body")}
        if sites & wanted_sites or links & wanted_links:
            likely.append((body, child_class))
    robot, *unread = likely or top
    if unread:
        kind = "robots" if likely else "bodies"
        unread_names = listed([body.get("name", "") for body, _ in unread])
        names = [body.get("name", "") for body, _ in (robot, *unread)]
        exchange.note(
            f"It holds other {kind}: {unread_names}",
            "--model NAME for one of them",
            question=which_robot(names, kind),
        )
    return _parts(file, *robot)


class _Part(NamedTuple):
    """A joint, site, geom, inertia or body right in a body."""

    element: Element
    pose: Array
    """(4, 4) of what is around it, in the frame of the robot [m]."""
    child_class: str
    """The class of defaults that holds where it names none."""


def _parts(file: MjcfFile, base: Element, child_class: str) -> _Robot:
    """Joints, sites and masses of an outermost body and all inside it."""
    robot = _Robot(base.get("name", "robot"))
    stack = [(_Part(base, np.eye(4), child_class), robot.name, "", False)]
    count = 0
    while stack:
        body, link, parent, moves = stack.pop()
        parts = _parts_in(file, body)
        if parent:
            moves |= any(part.element.tag == "joint" for part in parts)
        count += len(parts)
        if count > MAX_PARTS:
            raise LayoutError(f"has a robot of more than {MAX_PARTS:,} parts; make it smaller")
        for i, part in enumerate(parts):
            element = part.element
            name = element.get("name", "")
            if element.tag == "body":
                what = f"body {name!r:.60}"
                place = part.pose @ file.pose(element.attrib, what)
                inner = _Part(element, place, part.child_class)
                stack.append((inner, name or f"body {i + 1} of {link:.40}", link, moves))
            elif element.tag == "site":
                if name in robot.sites:
                    raise LayoutError(f"has two sites of the name {name!r:.60}")
                attributes = file.attributes(element, part.child_class)
                place = part.pose @ file.pose(attributes, f"site {name!r:.60}")
                robot.sites[name] = _Site(link, place)
            elif element.tag in ("joint", "freejoint"):
                _add_joint(robot, file, part, link, parent)
            elif element.tag in MAKERS:
                robot.not_made.append(f"<{element.tag}> in {link}")
        geoms = _geoms_of(file, parts)
        _add_mass(robot, file, parts, geoms, link)
        if not moves:
            _add_solids(robot, geoms, link)
    return robot


def _parts_in(file: MjcfFile, body: _Part) -> list[_Part]:
    """The parts of a body; what a <frame> in it holds has the pose of that frame."""
    parts: list[_Part] = []
    child_class = body.element.get("childclass", body.child_class)
    pending = [_Part(child, body.pose, child_class) for child in reversed(body.element)]
    while pending:
        part = pending.pop()
        element = part.element
        if element.tag != "frame":
            parts.append(part)
            continue
        what = f"frame {element.get('name', '')!r:.60}"
        pose = part.pose @ file.pose(element.attrib, what)
        inherited = element.get("childclass", part.child_class)
        pending += [_Part(child, pose, inherited) for child in reversed(element)]
    return parts


def _geoms_of(file: MjcfFile, parts: list[_Part]) -> list[Geom]:
    """The geoms among the parts of a body."""
    geoms = []
    for part in parts:
        if part.element.tag == "geom":
            geoms.append(read_geom(file, part.element, part.pose, part.child_class))
    return geoms


def _add_mass(
    robot: _Robot, file: MjcfFile, parts: list[_Part], geoms: list[Geom], link: str
) -> None:
    """Adds the mass of a body, which its <inertial> or its geoms tell."""
    inertials = [part for part in parts if part.element.tag == "inertial"]
    source = file.compiler.get("inertiafromgeom", "auto")
    if source == "false" or (source == "auto" and inertials):
        robot.masses += [_inertial(file, part) for part in inertials[:1]]
        return
    for geom in geoms:
        mass = geom_mass(geom)
        if mass is None:
            robot.without_mass.append(f"{geom.name or 'one'} of {link}")
        else:
            robot.masses.append(mass)


def _add_solids(robot: _Robot, geoms: list[Geom], link: str) -> None:
    """Adds what a body looks like."""
    for geom in geoms:
        solid = solid_of(geom, link)
        if solid is not None:
            robot.solids.append(solid)
        elif geom.is_mesh:
            robot.meshes.append(link)


def _add_joint(robot: _Robot, file: MjcfFile, part: _Part, link: str, parent: str) -> None:
    """Adds a joint of a body; those of the outermost body move the whole robot."""
    element = part.element
    is_free = element.tag == "freejoint"
    attributes = Attributes() if is_free else file.attributes(element, part.child_class)
    kind = "free" if is_free else attributes.get("type", "hinge")
    if not parent:
        robot.is_free |= kind == "free"
        return
    name = element.get("name") or f"joint of {link}"
    what = f"joint {name!r:.60}"
    place = np.append(numbers(attributes.get("pos", "0 0 0"), 3, f"pos of {what}"), 1.0)
    axis = part.pose[:3, :3] @ numbers(attributes.get("axis", "0 0 1"), 3, f"axis of {what}")
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        raise LayoutError(f"{what} has an axis without length")
    limits = _range_of(file, attributes, "", what) if kind == "hinge" else None
    low, high = limits or (-math.inf, math.inf)
    joint = Joint(
        name=name,
        kind=JOINT_KINDS.get(kind, kind),
        parent=parent,
        child=link,
        position=(part.pose @ place)[:3],
        axis=axis / length,
        limits=(low * file.angle, high * file.angle),
    )
    robot.joints[name] = joint
    # Of several joints of a body the last that turns is nearest to what sits on it.
    if joint.kind in TURNING or link not in robot.joint_of_link:
        robot.joint_of_link[link] = joint


def _inertial(file: MjcfFile, part: _Part) -> LinkMass:
    """The mass in an <inertial>."""
    element = part.element
    pose = part.pose @ file.pose(element.attrib, "<inertial>")
    mass = float(numbers(element.get("mass", "0"), 1, "mass of <inertial>")[0])
    if "fullinertia" in element.attrib:
        xx, yy, zz, xy, xz, yz = numbers(element.attrib["fullinertia"], 6, "fullinertia")
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    else:
        inertia = np.diag(numbers(element.get("diaginertia", "0 0 0"), 3, "diaginertia"))
    rotation = pose[:3, :3]
    return LinkMass(mass, pose[:3, 3], rotation @ inertia @ rotation.T)


def _layout_actuators(
    robot: _Robot, pushes: list[_Push], origin: Array, others: dict[str, str], exchange: Exchange
) -> tuple[list[Actuator], set[str]]:
    """The actuators of the layout.

    Args:
        robot: the robot.
        pushes: what pushes at sites.
        origin: the layout's origin in the frame of the robot, (3,) [m].
        others: why each of the other actuators of the model is no thruster; gets more of them.
        exchange: defaults, and the links that the user named; gets the notes.

    Returns:
        The actuators, and names of the others that turn one of them.
    """
    actuators: list[Actuator] = []
    mounts = set()
    per_unit = []
    for push in pushes:
        site = robot.sites.get(push.site)
        if site is None:
            others[push.name] = f"site {push.site:.60} is not on body {robot.name:.60}"
        elif float(np.linalg.norm(push.gear[:3])) * abs(push.gain) < NO_FORCE:
            others[push.name] = "no force, but a torque"
        elif site.link not in exchange.fins:
            thruster = _thruster(push, site, origin, exchange)
            mount = _mount(robot, site, thruster)
            actuators.append(on_mount(thruster, mount, origin, exchange))
            mounts |= {mount.name} if mount else set()
            newtons = float(np.linalg.norm(push.gear[:3])) * abs(push.gain)
            if abs(newtons - 1.0) > 1e-9:
                per_unit.append(f"{newtons:g} N of {push.name}")
    if per_unit:
        exchange.note(f"A ctrl of 1 is {listed(per_unit)}: divide its force by that.")
    for link in exchange.thrusters:
        joint = _joint_of(robot, link)
        thruster = exchange.thruster(link, joint.position - origin, joint.axis, None)
        mount = robot.joint_of_link.get(joint.parent)
        actuators.append(on_mount(thruster, mount, origin, exchange))
        mounts.add(joint.name)
    for link in exchange.fins:
        joint = _joint_of(robot, link)
        actuators.append(fin_on(joint, origin, exchange))
        mounts.add(joint.name)
    turned = {name for name, why in others.items() if why.partition(" joint ")[2] in mounts}
    return actuators, turned


def _joint_of(robot: _Robot, link: str) -> Joint:
    """The joint that moves a body which the user named."""
    if link not in robot.joint_of_link:
        bodies = listed(robot.joint_of_link)
        raise LayoutError(f"has no body {link!r:.60} that a joint moves; such bodies: {bodies}")
    return robot.joint_of_link[link]


def _mount(robot: _Robot, site: _Site, thruster: Thruster) -> Joint | None:
    """The joint that turns the thrust at a site: not the one about which a propeller spins."""
    joint = robot.joint_of_link.get(site.link)
    if joint is not None and abs(float(joint.axis @ np.array(thruster.axis))) > SPIN:
        joint = robot.joint_of_link.get(joint.parent)
    return joint


def _thruster(push: _Push, site: _Site, origin: Array, exchange: Exchange) -> Thruster:
    """The thruster of an actuator at a site.

    Its torque t beside the force f is tau = t / |f| per newton: along the axis a = f / |f| it is a
    reaction torque, and what is across is a force on another line, through the point a x tau beyond
    the site.
    """
    rotation = site.pose[:3, :3]
    force = rotation @ push.gear[:3]
    newtons = float(np.linalg.norm(push.gear[:3]))
    sign = math.copysign(1.0, push.gain)
    axis = sign * force / newtons  # where a positive ctrl pushes
    torque = sign * (rotation @ push.gear[3:]) / newtons
    shift = np.cross(axis, torque)
    if float(np.linalg.norm(shift)) > 1e-9:
        exchange.note(
            f"{push.name} has a torque across its force: the thruster sits {shift[0]:g} "
            f"{shift[1]:g} {shift[2]:g} m beside the site, where its force alone gives the same."
        )
    limits = None
    if push.limits is not None:
        low, high = sorted((sign * push.limits[0], sign * push.limits[1]))
        limits = (low * newtons, high * newtons)
    thruster = exchange.thruster(
        push.name, site.pose[:3, 3] - origin + shift, axis, limits, float(torque @ axis)
    )
    if push.time_constant is not None:
        thruster = replace(thruster, time_constant=push.time_constant)
    return thruster
