"""Layouts of robot descriptions: what plugins of gz-sim drive, and links that the user names.

A plugin Thruster pushes at its joint, along the joint's axis, in newtons, or by an angular velocity w
with CT density D^4 w |w|. On a link that turns itself it is an azimuth. Hydrodynamics has derivatives after
Fossen, which are negative. A fin's joint sits where its force acts, and its axis is the shaft.
"""

import math
from dataclasses import replace
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange.description import TURNING, Description, Joint, number, parse_description, said
from finlab.exchange.exchange import T200_POWER, Exchange, vector
from finlab.layout import MAX_ACTUATORS, Actuator, Azimuth, Body, Fin, Layout
from finlab.layout.angles import TURN
from finlab.layout.axes import Vector

MAX_TILT = math.radians(5.0)
"""Most that a fin's shaft may leave the horizontal plane [rad] and still be taken for horizontal."""
MAX_LEAN = 0.02
"""Most that the thrust of an azimuth may lean out of the plane in which it turns [rad]."""
BESIDE = 0.01
"""Most that the line of an azimuth's thrust may pass by its turning axis and count as through it [m]."""
MOST = 1000.0
"""What gz-sim takes for a limit of a thruster that is left out [N]."""
DERIVATIVES = {
    "added_mass": "xDotU yDotV zDotW kDotP mDotQ nDotR",
    "linear_damping": "xU yV zW kP mQ nR",
    "quadratic_damping": "xUabsU yVabsV zWabsW kPabsP mQabsQ nRabsR",
}
"""Fields of a body, and their tags in the plugin Hydrodynamics."""


def read_description(text: str, name: str, exchange: Exchange) -> Layout:
    """Returns the layout in a URDF or SDF text; `name` is what it is called where the text has none.

    Raises:
        LayoutError: it cannot be read, lacks a link or joint, or nothing in it is an actuator.
    """
    robot = parse_description(text, name)
    at_gravity = exchange.origin == "gravity"
    if at_gravity and robot.mass <= 0:
        raise LayoutError(
            "has no masses, so its centre of gravity is unknown; use --origin base if that is at it"
        )
    start = robot.center if at_gravity else np.zeros(3)
    driven = [(_driven(robot, plugin), plugin) for plugin in _plugins(robot, "Thruster")[: MAX_ACTUATORS + 1]]
    driven += [(_joint_of(robot, link), Element("plugin")) for link in exchange.thrusters]
    parts: list[Actuator] = [_propeller(robot, joint, plugin, start, exchange) for joint, plugin in driven]
    parts += [_fin(_joint_of(robot, link), start, exchange) for link in exchange.fins]
    if not parts:
        raise LayoutError(
            "has no plugin Thruster of gz-sim; name the links that are fins (--fins LINK...) or thrusters "
            f"(--thrusters LINK...); a joint moves {_moved(robot)}"
        )
    place = "centre of gravity" if at_gravity else "base frame"
    return Layout(robot.name, tuple(parts), f"Origin at the {place}.", _body(robot, at_gravity, exchange))


def _plugins(robot: Description, kind: str) -> list[Element]:
    """The plugins of gz-sim of a kind."""
    file = f"{kind.lower()}-system"
    names = ((each.get("name", ""), each.get("filename", ""), each) for each in robot.plugins)
    return [each for name, library, each in names if name.endswith(f"::{kind}") or file in library]


def _driven(robot: Description, plugin: Element) -> Joint:
    name = said(plugin, "joint_name")
    joint = robot.joints.get(name)
    if joint is None:
        raise LayoutError(f"a thruster's plugin names joint {name!r:.60}, which moves no link in it")
    return joint


def _joint_of(robot: Description, link: str) -> Joint:
    if link not in robot.movers:
        raise LayoutError(f"has no link {link!r:.60} that a joint moves; such links: {_moved(robot)}")
    return robot.movers[link]


def _moved(robot: Description) -> str:
    return f"{', '.join(sorted(robot.movers)) or 'none'}"[:300]


def _propeller(
    robot: Description, joint: Joint, plugin: Element, start: Array, exchange: Exchange
) -> Actuator:
    """The thruster that a joint spins, or the azimuth where its mount turns, too."""
    place = joint.place - start
    part = exchange.thruster(joint.child, place, joint.axis, _force(plugin))
    part = replace(part, dead_band=number(plugin, "deadband"))
    mount = robot.movers.get(joint.parent)
    if mount is None or mount.kind not in TURNING or not mount.ends[0] < mount.ends[1]:
        return part
    along = float(mount.axis @ joint.axis)
    if abs(along) > MAX_LEAN:
        raise LayoutError(f"the thrust of {joint.child!r:.60} leans out of the plane in which it turns")
    zero = (joint.axis - along * mount.axis) / math.sqrt(1.0 - along * along)
    arm = joint.place - mount.place
    if abs(arm @ np.cross(mount.axis, zero)) > BESIDE:
        exchange.note(
            f"{joint.child} sits beside the axis about which it turns: its place at angle 0 is taken."
        )
    arc = mount.ends if mount.ends[1] - mount.ends[0] < TURN else (-math.pi, math.pi)
    # Where it sits along its thrust changes nothing, but for what turns with it.
    position, turn = vector(place - (arm @ zero) * zero), (vector(mount.axis), vector(zero))
    return Azimuth(part.name, position, *turn, part.force, T200_POWER, arc, part.dead_band)


def _force(plugin: Element) -> tuple[float, float] | None:
    """Least and most force [N] of a plugin; None where it has no limits."""
    if not said(plugin, "min_thrust_cmd max_thrust_cmd"):
        return None
    ends = [number(plugin, "min_thrust_cmd", -MOST), number(plugin, "max_thrust_cmd", MOST)]
    if said(plugin, "use_angvel_cmd").lower() in ("1", "true"):
        density, size = number(plugin, "fluid_density", 1000.0), number(plugin, "propeller_diameter", 0.02)
        gain = number(plugin, "thrust_coefficient", 1.0) * density * size**4
        ends = sorted(gain * end * abs(end) for end in ends)
    return ends[0], ends[1]


def _fin(joint: Joint, start: Array, exchange: Exchange) -> Fin:
    """The fin that a joint moves."""
    if joint.kind not in TURNING:
        raise LayoutError(
            f"joint {joint.name!r:.60} is {joint.kind}; a fin's joint is {' or '.join(TURNING)}"
        )
    axis, place = joint.axis, joint.place - start
    if abs(axis[2]) <= math.sin(MAX_TILT):
        # A joint may turn about the same line the other way round; finlab's shafts point out of the hull.
        outward = axis if axis[:2] @ place[:2] >= 0 else -axis
        return Fin(joint.child, vector(place), math.atan2(outward[1], outward[0]))
    exchange.note("Thrust of fins whose shaft is not horizontal is taken to point forward at direction 0.")
    ahead = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
    zero = ahead - (ahead @ axis) * axis
    return Fin(joint.child, vector(place), shaft=vector(axis), zero=vector(zero / np.linalg.norm(zero)))


def _body(robot: Description, at_gravity: bool, exchange: Exchange) -> Body | None:
    """What the description says of the body; it is known at its centre of gravity only."""
    if not at_gravity:
        return None
    told: dict[str, Any] = {"added_mass": tuple(robot.added.tolist())} if robot.added.any() else {}
    for plugin in _plugins(robot, "Hydrodynamics")[:1]:
        for field, tags in DERIVATIVES.items():
            values = tuple(abs(number(plugin, tag)) for tag in tags.split())
            if any(values) or field not in told:
                told[field] = values
        exchange.note("Its buoyancy is not read: it is taken for the weight, at the centre of gravity.")
    moments: Vector = vector(np.diag(robot.inertia))
    if np.abs(robot.inertia - np.diag(moments)).max() > 0.05 * max(moments):
        exchange.note("Products of inertia are left out.")
    return Body(mass_kg=robot.mass, inertia_kgm2=moments if min(moments) > 0 else None, **told)
