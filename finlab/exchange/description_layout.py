"""Layouts of robot descriptions: thrusters, azimuths and fins by their joints, and the body.

A thruster pushes at its joint, along the joint's axis; on a link that turns itself it is an
azimuth. A fin's joint sits where its force acts, and its axis is the shaft. Thrusters are the
joints that plugins drive, and the links that the user names; fins are named by the user alone.
"""

from dataclasses import replace
from xml.etree.ElementTree import Element

import numpy as np

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange.description import Description, number, parse_description
from finlab.exchange.description_body import UUV_OBJECT, body_of
from finlab.exchange.exchange import Exchange
from finlab.exchange.labels import listed
from finlab.exchange.link_names import (
    is_thruster_name,
    questions_of_links,
    turning_first,
    which_idle,
)
from finlab.exchange.links import Joint
from finlab.exchange.mounts import fin_on, on_mount
from finlab.exchange.questions import QuestionError, which_origin
from finlab.exchange.thruster_plugins import (
    driven_joint,
    drives_thruster,
    force_limits,
    is_gz_plugin,
)
from finlab.exchange.visuals import hull_in
from finlab.layout import MAX_ACTUATORS, Actuator, Body, Layout


def read_description(root: Element, name: str, exchange: Exchange) -> Layout:
    """Returns the layout in a description in URDF or SDF.

    Args:
        root: its outermost element.
        name: the layout's name where the description has none.
        exchange: which links are actuators, and what to take for the origin; gets the notes.

    Raises:
        LayoutError: the description cannot be read, lacks a link or joint, or has no actuator.
    """
    at_gravity = exchange.origin == "gravity"
    description = parse_description(root, name, drives_thruster, exchange)
    if at_gravity and description.mass <= 0:
        raise _no_mass(description)
    origin = description.center if at_gravity else np.zeros(3)
    actuators = _actuators(description, origin, exchange)
    unread = _unread_plugins(description)
    if not actuators:
        raise QuestionError(
            "has no thruster's plugin of gz-sim or uuv; name the links that are fins (--fins "
            "LINK...) or thrusters (--thrusters LINK...); a joint moves "
            f"{_moving_links(description)}; its plugins: {listed(unread)}",
            questions=questions_of_links(description.joint_of_link),
        )
    if unread:
        exchange.note(f"Plugins that are not read: {listed(unread)}.")
    idle = _idle_thrusters(description, {actuator.name for actuator in actuators})
    if idle:
        exchange.note(
            f"Left out, since no plugin drives them: {listed(idle)}",
            "--thrusters names the links among them that push",
            question=which_idle(idle),
        )
    exchange.note(f"Model {description.name} was read, x forward, y left, z up, in m, kg and N.")
    body = body_of(description, exchange) if at_gravity else None
    hull = hull_in(description, origin, exchange)
    if hull is not None:
        body = replace(body or Body(), hull=hull)
    origin_name = "centre of gravity" if at_gravity else "base frame"
    return Layout(description.name, tuple(actuators), f"Origin at the {origin_name}.", body)


def _no_mass(description: Description) -> LayoutError:
    """The error for a description without masses, which has no centre of gravity."""
    included = ", ".join(description.included)[:300]
    if included:
        return LayoutError(
            f"has no masses but in <include> {included}, which is not opened: give its model.sdf"
        )
    return QuestionError(
        "has no masses, so no centre of gravity; use --origin base if its origin is there",
        questions=(which_origin("The file has no masses."),),
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
        actuators.append(fin_on(_joint_of_link(description, link), origin, exchange))
    return actuators


def _idle_thrusters(description: Description, names: set[str]) -> list[str]:
    """Links that are called thrusters or propellers and are none of the layout's actuators, nor
    what these are mounted on, or mounted on them."""
    joint_of_link = description.joint_of_link
    touching = set(names)
    for link, joint in joint_of_link.items():
        if link in names:
            touching.add(joint.parent)
        if joint.parent in names:
            touching.add(link)
    return [
        link
        for link, joint in joint_of_link.items()
        if link not in touching and is_thruster_name(f"{link} {joint.name}")
    ]


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
    return listed(turning_first(joint_of_link))


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
    force = force_limits(plugin, joint.child, exchange)
    thruster = exchange.thruster(joint.child, joint.position - origin, joint.axis, force)
    thruster = replace(thruster, dead_band=number(plugin, "deadband"))
    return on_mount(thruster, description.joint_of_link.get(joint.parent), origin, exchange)
