"""Layouts of robot descriptions: what plugins of simulators drive, links that the user names, and
the body.

A thruster pushes at its joint, along the joint's axis; on a link that turns itself it is an
azimuth. A fin's joint sits where its force acts, and its axis is the shaft. A plugin Thruster of
gz-sim pushes in newtons, or by an angular velocity w with CT density D^4 w |w|.
libuuv_thruster_ros_plugin (Plankton and DAVE have it, too) clamps its command, and converts it.
Derivatives after Fossen are negative, and a body has their magnitudes; of a body what is not said
stays unknown.
"""

import math
from dataclasses import replace
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from finlab.arrays import Array
from finlab.axes import TURN, Vector3
from finlab.errors import LayoutError
from finlab.exchange.description import (
    ADDED,
    TURNING,
    Description,
    Joint,
    number,
    parse_description,
    said,
)
from finlab.exchange.exchange import T200_POWER, Exchange, vector
from finlab.exchange.labels import listed, numbers_in
from finlab.exchange.xml_models import root_of
from finlab.layout import MAX_ACTUATORS, Actuator, Azimuth, Body, Fin, Layout

MAX_TILT = math.radians(5.0)
"""Most that a fin's shaft may leave the horizontal plane [rad] and still be taken for
horizontal."""
MAX_LEAN = 0.02
"""Most that the thrust of an azimuth may lean out of the plane in which it turns [rad]."""
OFF_AXIS = 0.01
"""Most that the line of an azimuth's thrust may pass by its turning axis and count as through it
[m]."""


def read_description(text: str, name: str, exchange: Exchange) -> Layout:
    """Returns the layout in a URDF or SDF text; `name` is its name where the text has none. Raises
    LayoutError: it cannot be read, lacks a link or joint, or nothing in it is an actuator."""
    root = root_of(text)
    at_gravity = exchange.origin == "gravity"
    if root.tag == "scenario":
        hint = "give thrusters by place and direction, in YAML"
        raise LayoutError(f"is a scenario of Stonefish, which is not read; {hint}")
    robot = parse_description(root, name, drives, exchange)
    if at_gravity and robot.mass <= 0:
        if inside := ", ".join(robot.included)[:300]:
            raise LayoutError(
                f"has no masses but in <include> {inside}, which is not opened: give its model.sdf"
            )
        raise LayoutError(
            "has no masses, so no centre of gravity; use --origin base if its origin is there"
        )
    start = robot.center if at_gravity else np.zeros(3)
    plugins = [each for each in robot.plugins if drives(each[1])][: MAX_ACTUATORS + 1]
    pushing = [(driven(robot, scope, plugin), plugin) for scope, plugin in plugins]
    pushing += [(_joint_of(robot, link), Element("plugin")) for link in exchange.thrusters]
    parts: list[Actuator] = [
        _propeller(robot, joint, plugin, start, exchange) for joint, plugin in pushing
    ]
    parts += [_fin(_joint_of(robot, link), start, exchange) for link in exchange.fins]
    left = dict.fromkeys(
        plugin.get("filename", "") or plugin.get("name", "")
        for _, plugin in robot.plugins
        if not (
            drives(plugin)
            or is_plugin(plugin, "Hydrodynamics")
            or UUV in plugin.get("filename", "")
        )
    )
    if not parts:
        raise LayoutError(
            "has no thruster's plugin of gz-sim or uuv; name the links that are fins (--fins "
            "LINK...) or "
            f"thrusters (--thrusters LINK...); a joint moves {_moved(robot)}; its plugins: "
            f"{listed(left)}"
        )
    if left:
        exchange.note(f"Plugins that are not read: {listed(left)}.")
    exchange.note(f"Model {robot.name} was read, x forward, y left, z up, in m, kg and N.")
    place, body = (
        ("centre of gravity", body_of(robot, exchange)) if at_gravity else ("base frame", None)
    )
    return Layout(robot.name, tuple(parts), f"Origin at the {place}.", body)


def _joint_of(robot: Description, link: str) -> Joint:
    if link not in robot.movers:
        raise LayoutError(
            f"has no link {link!r:.60} that a joint moves; such links: {_moved(robot)}"
        )
    return robot.movers[link]


def _moved(robot: Description) -> str:
    turning = [link for link, joint in robot.movers.items() if joint.kind in TURNING]
    return listed(sorted(robot.movers, key=lambda link: (link not in turning, link)))


def _propeller(
    robot: Description, joint: Joint, plugin: Element, start: Array, exchange: Exchange
) -> Actuator:
    """The thruster that a joint spins, or the azimuth where its mount turns, too."""
    place = joint.place - start
    part = exchange.thruster(
        joint.child, place, joint.axis, force_of(plugin, joint.child, exchange)
    )
    part = replace(part, dead_band=number(plugin, "deadband"))
    mount = robot.movers.get(joint.parent)
    if mount is None or mount.kind not in TURNING or not mount.ends[0] < mount.ends[1]:
        return part
    along = float(mount.axis @ joint.axis)
    if abs(along) > MAX_LEAN:
        raise LayoutError(
            f"the thrust of {joint.child!r:.60} leans out of the plane in which it turns"
        )
    zero = (joint.axis - along * mount.axis) / math.sqrt(1.0 - along * along)
    arm = joint.place - mount.place
    if abs(arm @ np.cross(mount.axis, zero)) > OFF_AXIS:
        exchange.note(
            f"{joint.child} sits off the axis about which it turns: its place at angle 0 is taken."
        )
    arc = mount.ends if mount.ends[1] - mount.ends[0] < TURN else (-math.pi, math.pi)
    # Where it sits along its thrust changes nothing, but for what turns with it.
    position = vector(place - (arm @ zero) * zero)
    turn = (vector(mount.axis), vector(zero))
    return Azimuth(part.name, position, *turn, part.force, T200_POWER, arc, part.dead_band)


def _fin(joint: Joint, start: Array, exchange: Exchange) -> Fin:
    if joint.kind not in TURNING:
        kinds = " or ".join(TURNING)
        raise LayoutError(f"joint {joint.name!r:.60} is {joint.kind}; a fin's joint is {kinds}")
    axis = joint.axis
    place = joint.place - start
    if abs(axis[2]) <= math.sin(MAX_TILT):
        # A joint may turn about the same line the other way round; finlab's shafts point out of the
        # hull.
        outward = axis if axis[:2] @ place[:2] >= 0 else -axis
        return Fin(joint.child, vector(place), math.atan2(outward[1], outward[0]))
    exchange.note(
        "Thrust of fins whose shaft is not horizontal is taken to point forward at direction 0."
    )
    ahead = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
    zero = ahead - (ahead @ axis) * axis
    return Fin(
        joint.child, vector(place), shaft=vector(axis), zero=vector(zero / np.linalg.norm(zero))
    )


MOST = 1000.0
"""What gz-sim takes for a limit of a thruster that is left out [N]."""
DERIVATIVES = {
    "added_mass": "xDotU yDotV zDotW kDotP mDotQ nDotR",
    "linear_damping": "xU yV zW kP mQ nR",
    "quadratic_damping": "xUabsU yVabsV zWabsW kPabsP mQabsQ nRabsR",
}
"""Fields of a body, and their tags in the plugin Hydrodynamics."""
OLD = "xUU yVV zWW kPP mQQ nRR"
"""Tags of quadratic damping before gz-sim 7."""
UUV, UUV_THRUSTER = "uuv_underwater_object", "uuv_thruster"
"""Words in the names of uuv_simulator's plugins."""
Known = dict[str, tuple[float, ...]]


def is_plugin(plugin: Element, kind: str) -> bool:
    """Whether a plugin is of a kind of gz-sim's."""
    file = plugin.get("filename", "")
    return plugin.get("name", "").endswith(f"::{kind}") or f"{kind.lower()}-system" in file


def drives(plugin: Element) -> bool:
    """Whether a plugin drives a thruster, so that it can be read."""
    return is_plugin(plugin, "Thruster") or UUV_THRUSTER in plugin.get("filename", "")


def driven(robot: Description, scope: str, plugin: Element) -> Joint:
    """Returns the joint that a thruster's plugin drives. Raises LayoutError: it moves no link."""
    name = said(plugin, "joint_name jointName")
    link = said(plugin, "linkName")
    joint = robot.joints.get(f"{scope}{name}") or robot.joints.get(name)
    if joint is None and not name and UUV_THRUSTER in plugin.get("filename", ""):
        joint = robot.movers.get(link)
    if joint is None:
        inside = ", ".join(robot.included)[:200]
        where = f", or stands in what is included: {inside}" if inside else ""
        raise LayoutError(
            f"a thruster's plugin names joint {name!r:.60}, which moves no link in it{where}"
        )
    return joint


def force_of(plugin: Element, name: str, exchange: Exchange) -> tuple[float, float] | None:
    """Returns least and most force [N] of a plugin; None where it has no limits. Raises
    LayoutError: a value of it is no number."""
    if UUV_THRUSTER in plugin.get("filename", ""):
        return _uuv_force(plugin, name, exchange)
    if not said(plugin, "min_thrust_cmd max_thrust_cmd"):
        return None
    low = number(plugin, "min_thrust_cmd", -MOST)
    high = number(plugin, "max_thrust_cmd", MOST)
    if said(plugin, "use_angvel_cmd").lower() in ("1", "true"):
        density = number(plugin, "fluid_density", 1000.0)
        size = number(plugin, "propeller_diameter", 0.02)
        gain = number(plugin, "thrust_coefficient", 1.0) * density * size**4
        low, high = sorted(gain * end * abs(end) for end in (low, high))
    return low, high


def _uuv_force(plugin: Element, name: str, exchange: Exchange) -> tuple[float, float] | None:
    kind = said(plugin, "conversion/type")
    low = -math.inf
    high = math.inf
    if said(plugin, "clampMin") and said(plugin, "clampMax") and kind == "Basic":
        scale = number(plugin, "gain", 1.0) * number(plugin, "propeller_efficiency", 1.0)
        speeds = (scale * number(plugin, "clampMin"), scale * number(plugin, "clampMax"))
        gain = number(plugin, "thrust_efficiency", 1.0) * number(plugin, "conversion/rotorConstant")
        low, high = sorted(gain * speed * abs(speed) for speed in speeds)
        exchange.note(
            f"uuv_thruster of {name}: clamps and conversion {kind} give {low:g} to {high:g} N."
        )
    else:
        exchange.note(
            f"uuv_thruster of {name}: no clamps, or conversion {kind!r:.40}, which is not read."
        )
    if said(plugin, "thrustMin") and said(plugin, "thrustMax"):
        low = max(low, number(plugin, "thrustMin"))
        high = min(high, number(plugin, "thrustMax"))
    return (low, high) if math.isfinite(low) else None


def body_of(robot: Description, exchange: Exchange) -> Body:
    """Returns what the description says of the body at its centre of gravity. Raises LayoutError: a
    value is no number, or out of bounds."""
    known: Known = {}
    _keep(known, "added_mass", {axis: str(value) for axis, value in robot.added.items()}, exchange)
    water = [plugin for _, plugin in robot.plugins if is_plugin(plugin, "Hydrodynamics")]
    objects = [plugin for _, plugin in robot.plugins if UUV in plugin.get("filename", "")]
    models = [model for plugin in objects for model in plugin.findall("link/hydrodynamic_model")]
    for read, plugins, what in (
        (_of_gz, water, "Hydrodynamics"),
        (_of_uuv, models, "hydrodynamic_model"),
    ):
        for plugin in plugins[:1]:
            read(plugin, known, exchange)
        if len(plugins) > 1:
            exchange.note(f"It has {len(plugins)} plugins with {what}: the first was read.")
    if water or objects:
        exchange.note(
            "Its buoyancy is not read: it is taken for the weight, at the centre of gravity."
        )
    moments: Vector3 | None = None
    if robot.inertia is None:
        exchange.note("A link with a mass has no inertia, so that of the body is unknown.")
    else:
        moments = vector(np.diag(robot.inertia))
        if np.abs(robot.inertia - np.diag(moments)).max() > 0.05 * max(moments):
            exchange.note("Products of inertia are left out.")
    values: dict[str, Any] = dict(known)
    return Body(
        mass_kg=robot.mass, inertia_kgm2=moments if moments and min(moments) > 0 else None, **values
    )


def _keep(known: Known, field: str, tags: dict[str, str], exchange: Exchange) -> None:
    """Keeps the values of six tags where all are said."""
    values = numbers_in([*tags.values()])
    if len(tags) == 6 and values is not None:
        known[field] = tuple(np.abs(values).tolist())
        exchange.note(f"{field} was read from {', '.join(tags)}.")
        wrong = [
            tag for tag, value in zip(tags, values, strict=True) if value > 0 and tag not in ADDED
        ]
        if wrong:
            why = "against the sign of a derivative: the magnitude is taken"
            exchange.note(f"{', '.join(wrong)} > 0, {why}.")
    elif tags:
        words = ", ".join(f"{tag} {value:.20}" for tag, value in tags.items())
        why = "is not six numbers" if len(tags) == 6 else "says these alone of six"
        exchange.note(f"{field} is left out: the file {why}: {words}.")


def _of_gz(plugin: Element, known: Known, exchange: Exchange) -> None:
    read = {"link_name", "water_density"}
    for field, tags in (*DERIVATIVES.items(), ("quadratic_damping", OLD)):
        values = {tag: value for tag in tags.split() if (value := said(plugin, tag))}
        if field not in known or tags != OLD:
            _keep(known, field, values, exchange)
            read |= set(values)
    if len(read) == 2:
        exchange.note(
            "Hydrodynamics holds no derivatives by known tags: added mass and damping are unknown."
        )
    if others := dict.fromkeys(each.tag for each in plugin if each.tag not in read):
        exchange.note(f"Not read of Hydrodynamics: {', '.join(others)[:300]}.")


def _of_uuv(model: Element, known: Known, exchange: Exchange) -> None:
    """A block of Fossen's model of uuv_simulator: six numbers, or the diagonal of 36."""
    kind = said(model, "type")
    for field in DERIVATIVES if kind == "fossen" else ():
        words = said(model, field).split()
        table = numbers_in(words) if len(words) == 36 else None
        if table is not None:
            words = words[::7]
            if np.count_nonzero(table) > np.count_nonzero(table[::7]):
                exchange.note(f"Of {field} the diagonal was read.")
        tags = dict(zip(ADDED, words, strict=True)) if len(words) == 6 else {"all": " ".join(words)}
        _keep(known, field, tags if words else {}, exchange)
    if kind != "fossen":
        exchange.note(
            f"hydrodynamic_model of type {kind!r:.40} is not read: the water's forces are unknown."
        )
    if said(model, "linear_damping_forward_speed"):
        exchange.note("linear_damping_forward_speed is not read.")
