"""Layouts of robot descriptions: thrusters, azimuths and fins by their joints, and the body.

A thruster pushes at its joint, along the joint's axis; on a link that turns itself it is an
azimuth. A fin's joint sits where its force acts, and its axis is the shaft. Thrusters are the
joints that plugins drive, and the links that the user names; fins are named by the user alone.
"""

import math
from dataclasses import replace
from xml.etree.ElementTree import Element

import numpy as np

from finlab.arrays import Array
from finlab.axes import TURN
from finlab.errors import LayoutError
from finlab.exchange.description import TURNING, Description, Joint, number, parse_description
from finlab.exchange.description_body import UUV_OBJECT, body_of
from finlab.exchange.exchange import T200_POWER, Exchange, vector
from finlab.exchange.labels import listed
from finlab.exchange.thruster_plugins import (
    driven_joint,
    drives_thruster,
    force_limits,
    is_gz_plugin,
)
from finlab.exchange.xml_models import root_of
from finlab.layout import MAX_ACTUATORS, Actuator, Azimuth, Fin, Layout

MAX_TILT = math.radians(5.0)
"""Most that a fin's shaft may leave the horizontal plane [rad] and still be taken for
horizontal."""
MAX_LEAN = 0.02
"""Most that the thrust of an azimuth may lean out of the plane in which it turns [rad]."""
MAX_OFFSET = 0.01
"""Most that the line of an azimuth's thrust may pass by its turning axis and count as through it
[m]."""


def read_description(text: str, name: str, exchange: Exchange) -> Layout:
    """Returns the layout in a text of URDF or SDF.

    Args:
        text: the description.
        name: the layout's name where the description has none.
        exchange: which links are actuators, and what to take for the origin; gets the notes.

    Raises:
        LayoutError: the description cannot be read, lacks a link or joint, or has no actuator.
    """
    root = root_of(text)
    at_gravity = exchange.origin == "gravity"
    if root.tag == "scenario":
        hint = "give thrusters by place and direction, in YAML"
        raise LayoutError(f"is a scenario of Stonefish, which is not read; {hint}")
    description = parse_description(root, name, drives_thruster, exchange)
    if at_gravity and description.mass <= 0:
        raise _no_mass(description)
    origin = description.center if at_gravity else np.zeros(3)
    actuators = _actuators(description, origin, exchange)
    unread = _unread_plugins(description)
    if not actuators:
        raise LayoutError(
            "has no thruster's plugin of gz-sim or uuv; name the links that are fins (--fins "
            "LINK...) or thrusters (--thrusters LINK...); a joint moves "
            f"{_moving_links(description)}; its plugins: {listed(unread)}"
        )
    if unread:
        exchange.note(f"Plugins that are not read: {listed(unread)}.")
    exchange.note(f"Model {description.name} was read, x forward, y left, z up, in m, kg and N.")
    body = body_of(description, exchange) if at_gravity else None
    origin_name = "centre of gravity" if at_gravity else "base frame"
    return Layout(description.name, tuple(actuators), f"Origin at the {origin_name}.", body)


def _no_mass(description: Description) -> LayoutError:
    """The error for a description without masses, which has no centre of gravity."""
    included = ", ".join(description.included)[:300]
    if included:
        return LayoutError(
            f"has no masses but in <include> {included}, which is not opened: give its model.sdf"
        )
    return LayoutError(
        "has no masses, so no centre of gravity; use --origin base if its origin is there"
    )


def _actuators(description: Description, origin: Array, exchange: Exchange) -> list[Actuator]:
    """The actuators that plugins drive, and those that the user names."""
    driving = [(scope, plugin) for scope, plugin in description.plugins if drives_thruster(plugin)]
    driven = []
    for scope, plugin in driving[: MAX_ACTUATORS + 1]:  # one too many, for the layout to refuse
        driven.append((driven_joint(description, scope, plugin), plugin))
    for link in exchange.thrusters:
        driven.append((_joint_of_link(description, link), Element("plugin")))
    actuators = [
        _thruster_or_azimuth(description, joint, plugin, origin, exchange)
        for joint, plugin in driven
    ]
    for link in exchange.fins:
        actuators.append(_fin(_joint_of_link(description, link), origin, exchange))
    return actuators


def _unread_plugins(description: Description) -> list[str]:
    """Names of the plugins that say nothing that a layout could have, each once."""
    names = []
    for _, plugin in description.plugins:
        file = plugin.get("filename", "")
        is_body = is_gz_plugin(plugin, "Hydrodynamics") or UUV_OBJECT in file
        if not drives_thruster(plugin) and not is_body:
            names.append(file or plugin.get("name", ""))
    return list(dict.fromkeys(names))


def _joint_of_link(description: Description, link: str) -> Joint:
    """The joint that moves a link which the user named."""
    if link not in description.joint_of_link:
        raise LayoutError(
            f"has no link {link!r:.60} that a joint moves; such links: {_moving_links(description)}"
        )
    return description.joint_of_link[link]


def _moving_links(description: Description) -> str:
    """The links that a joint moves, for an error: those on joints that turn come first."""
    joint_of_link = description.joint_of_link
    links = sorted(joint_of_link, key=lambda link: (joint_of_link[link].kind not in TURNING, link))
    return listed(links)


def _thruster_or_azimuth(
    description: Description, joint: Joint, plugin: Element, origin: Array, exchange: Exchange
) -> Actuator:
    """The thruster at a joint that a propeller spins about, or the azimuth where its mount turns.

    Args:
        description: the description.
        joint: the propeller's joint.
        plugin: the plugin that drives it; an empty one where the user named the link.
        origin: the layout's origin in the description's frame, (3,) [m].
        exchange: defaults and notes.
    """
    position = joint.position - origin
    force = force_limits(plugin, joint.child, exchange)
    thruster = exchange.thruster(joint.child, position, joint.axis, force)
    thruster = replace(thruster, dead_band=number(plugin, "deadband"))
    mount = description.joint_of_link.get(joint.parent)
    if mount is None or mount.kind not in TURNING or not mount.limits[0] < mount.limits[1]:
        return thruster
    along = float(mount.axis @ joint.axis)
    if abs(along) > MAX_LEAN:
        raise LayoutError(
            f"the thrust of {joint.child!r:.60} leans out of the plane in which it turns"
        )
    zero = (joint.axis - along * mount.axis) / math.sqrt(1.0 - along * along)
    arm = joint.position - mount.position
    if abs(arm @ np.cross(mount.axis, zero)) > MAX_OFFSET:
        exchange.note(
            f"{joint.child} sits off the axis about which it turns: its place at angle 0 is taken."
        )
    turns_freely = mount.limits[1] - mount.limits[0] >= TURN
    return Azimuth(
        thruster.name,
        # Where it sits along its thrust changes nothing, but for what turns with it.
        vector(position - (arm @ zero) * zero),
        vector(mount.axis),
        vector(zero),
        thruster.force,
        T200_POWER,
        (-math.pi, math.pi) if turns_freely else mount.limits,
        thruster.dead_band,
    )


def _fin(joint: Joint, origin: Array, exchange: Exchange) -> Fin:
    """The fin whose shaft is the axis of a joint; `origin` as in `_thruster_or_azimuth`."""
    if joint.kind not in TURNING:
        kinds = " or ".join(TURNING)
        raise LayoutError(f"joint {joint.name!r:.60} is {joint.kind}; a fin's joint is {kinds}")
    axis = joint.axis
    position = joint.position - origin
    if abs(axis[2]) <= math.sin(MAX_TILT):
        # A joint may turn about the same line the other way round; finlab's shafts point out of the
        # hull.
        outward = axis if axis[:2] @ position[:2] >= 0 else -axis
        return Fin(joint.child, vector(position), math.atan2(outward[1], outward[0]))
    exchange.note(
        "Thrust of fins whose shaft is not horizontal is taken to point forward at direction 0."
    )
    forward = np.array([1.0, 0.0, 0.0])
    up = np.array([0.0, 0.0, 1.0])
    ahead = forward if abs(axis[0]) < 0.9 else up  # up, where the shaft itself points forward
    zero = ahead - (ahead @ axis) * axis
    zero = zero / np.linalg.norm(zero)
    return Fin(joint.child, vector(position), shaft=vector(axis), zero=vector(zero))
