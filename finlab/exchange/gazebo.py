"""Layouts of robot descriptions: what plugins of simulators drive, and links that the user names.

A thruster pushes at its joint, along the joint's axis; on a link that turns itself it is an azimuth. A fin's
joint sits where its force acts, and its axis is the shaft.
"""

import math
from dataclasses import replace
from xml.etree.ElementTree import Element

import numpy as np

from finlab.arrays import Array
from finlab.axes import TURN
from finlab.errors import LayoutError
from finlab.exchange.description import TURNING, Description, Joint, number, parse_description
from finlab.exchange.exchange import T200_POWER, Exchange, vector
from finlab.exchange.labels import listed
from finlab.exchange.simulator_plugins import UUV, body_of, driven, drives, force_of, is_plugin
from finlab.exchange.xml_models import root_of
from finlab.layout import MAX_ACTUATORS, Actuator, Azimuth, Fin, Layout

MAX_TILT = math.radians(5.0)
"""Most that a fin's shaft may leave the horizontal plane [rad] and still be taken for horizontal."""
MAX_LEAN = 0.02
"""Most that the thrust of an azimuth may lean out of the plane in which it turns [rad]."""
OFF_AXIS = 0.01
"""Most that the line of an azimuth's thrust may pass by its turning axis and count as through it [m]."""


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
        raise LayoutError("has no masses, so no centre of gravity; use --origin base if its origin is there")
    start = robot.center if at_gravity else np.zeros(3)
    plugins = [each for each in robot.plugins if drives(each[1])][: MAX_ACTUATORS + 1]
    pushing = [(driven(robot, scope, plugin), plugin) for scope, plugin in plugins]
    pushing += [(_joint_of(robot, link), Element("plugin")) for link in exchange.thrusters]
    parts: list[Actuator] = [_propeller(robot, joint, plugin, start, exchange) for joint, plugin in pushing]
    parts += [_fin(_joint_of(robot, link), start, exchange) for link in exchange.fins]
    left = dict.fromkeys(
        plugin.get("filename", "") or plugin.get("name", "")
        for _, plugin in robot.plugins
        if not (drives(plugin) or is_plugin(plugin, "Hydrodynamics") or UUV in plugin.get("filename", ""))
    )
    if not parts:
        raise LayoutError(
            "has no thruster's plugin of gz-sim or uuv; name the links that are fins (--fins LINK...) or "
            f"thrusters (--thrusters LINK...); a joint moves {_moved(robot)}; its plugins: {listed(left)}"
        )
    if left:
        exchange.note(f"Plugins that are not read: {listed(left)}.")
    exchange.note(f"Model {robot.name} was read, x forward, y left, z up, in m, kg and N.")
    place, body = ("centre of gravity", body_of(robot, exchange)) if at_gravity else ("base frame", None)
    return Layout(robot.name, tuple(parts), f"Origin at the {place}.", body)


def _joint_of(robot: Description, link: str) -> Joint:
    if link not in robot.movers:
        raise LayoutError(f"has no link {link!r:.60} that a joint moves; such links: {_moved(robot)}")
    return robot.movers[link]


def _moved(robot: Description) -> str:
    turning = [link for link, joint in robot.movers.items() if joint.kind in TURNING]
    return listed(sorted(robot.movers, key=lambda link: (link not in turning, link)))


def _propeller(
    robot: Description, joint: Joint, plugin: Element, start: Array, exchange: Exchange
) -> Actuator:
    """The thruster that a joint spins, or the azimuth where its mount turns, too."""
    place = joint.place - start
    part = exchange.thruster(joint.child, place, joint.axis, force_of(plugin, joint.child, exchange))
    part = replace(part, dead_band=number(plugin, "deadband"))
    mount = robot.movers.get(joint.parent)
    if mount is None or mount.kind not in TURNING or not mount.ends[0] < mount.ends[1]:
        return part
    along = float(mount.axis @ joint.axis)
    if abs(along) > MAX_LEAN:
        raise LayoutError(f"the thrust of {joint.child!r:.60} leans out of the plane in which it turns")
    zero = (joint.axis - along * mount.axis) / math.sqrt(1.0 - along * along)
    arm = joint.place - mount.place
    if abs(arm @ np.cross(mount.axis, zero)) > OFF_AXIS:
        exchange.note(f"{joint.child} sits off the axis about which it turns: its place at angle 0 is taken.")
    arc = mount.ends if mount.ends[1] - mount.ends[0] < TURN else (-math.pi, math.pi)
    # Where it sits along its thrust changes nothing, but for what turns with it.
    position, turn = vector(place - (arm @ zero) * zero), (vector(mount.axis), vector(zero))
    return Azimuth(part.name, position, *turn, part.force, T200_POWER, arc, part.dead_band)


def _fin(joint: Joint, start: Array, exchange: Exchange) -> Fin:
    if joint.kind not in TURNING:
        kinds = " or ".join(TURNING)
        raise LayoutError(f"joint {joint.name!r:.60} is {joint.kind}; a fin's joint is {kinds}")
    axis, place = joint.axis, joint.place - start
    if abs(axis[2]) <= math.sin(MAX_TILT):
        # A joint may turn about the same line the other way round; finlab's shafts point out of the hull.
        outward = axis if axis[:2] @ place[:2] >= 0 else -axis
        return Fin(joint.child, vector(place), math.atan2(outward[1], outward[0]))
    exchange.note("Thrust of fins whose shaft is not horizontal is taken to point forward at direction 0.")
    ahead = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
    zero = ahead - (ahead @ axis) * axis
    return Fin(joint.child, vector(place), shaft=vector(axis), zero=vector(zero / np.linalg.norm(zero)))
