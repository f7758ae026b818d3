"""Plugins of simulators that drive a thruster, and their forces: gz-sim, uuv_simulator and its heirs.

A plugin Thruster of gz-sim pushes along its joint's axis, in newtons, or by an angular velocity w with
CT density D^4 w |w|. libuuv_thruster_ros_plugin (Plankton and DAVE have it, too) clamps its command, and
converts it.
"""

import math
from xml.etree.ElementTree import Element

from finlab.errors import LayoutError
from finlab.exchange.description import Description, Joint, number, said
from finlab.exchange.exchange import Exchange

MOST = 1000.0
"""What gz-sim takes for a limit of a thruster that is left out [N]."""


def is_plugin(plugin: Element, kind: str) -> bool:
    """Whether a plugin is of a kind of gz-sim's."""
    file = plugin.get("filename", "")
    return plugin.get("name", "").endswith(f"::{kind}") or f"{kind.lower()}-system" in file


def drives(plugin: Element) -> bool:
    """Whether a plugin drives a thruster, so that it can be read."""
    return is_plugin(plugin, "Thruster") or _is_uuv(plugin)


def _is_uuv(plugin: Element) -> bool:
    return "uuv_thruster" in plugin.get("filename", "")


def driven(robot: Description, scope: str, plugin: Element) -> Joint:
    """Returns the joint that a thruster's plugin drives. Raises LayoutError: it moves no link."""
    name, link = said(plugin, "joint_name jointName"), said(plugin, "linkName")
    joint = robot.joints.get(f"{scope}{name}") or robot.joints.get(name)
    joint = robot.movers.get(link) if joint is None and not name and _is_uuv(plugin) else joint
    if joint is None:
        inside = ", ".join(robot.included)[:200]
        where = f", or stands in what is included: {inside}" if inside else ""
        raise LayoutError(f"a thruster's plugin names joint {name!r:.60}, which moves no link in it{where}")
    return joint


def force_of(plugin: Element, name: str, exchange: Exchange) -> tuple[float, float] | None:
    """Returns least and most force [N] of a plugin; None where it has no limits. Raises LayoutError: a value
    of it is no number."""
    if _is_uuv(plugin):
        return _uuv_force(plugin, name, exchange)
    if not said(plugin, "min_thrust_cmd max_thrust_cmd"):
        return None
    low, high = number(plugin, "min_thrust_cmd", -MOST), number(plugin, "max_thrust_cmd", MOST)
    if said(plugin, "use_angvel_cmd").lower() in ("1", "true"):
        density, size = number(plugin, "fluid_density", 1000.0), number(plugin, "propeller_diameter", 0.02)
        gain = number(plugin, "thrust_coefficient", 1.0) * density * size**4
        low, high = sorted(gain * end * abs(end) for end in (low, high))
    return low, high


def _uuv_force(plugin: Element, name: str, exchange: Exchange) -> tuple[float, float] | None:
    kind, low, high = said(plugin, "conversion/type"), -math.inf, math.inf
    if said(plugin, "clampMin") and said(plugin, "clampMax") and kind == "Basic":
        scale = number(plugin, "gain", 1.0) * number(plugin, "propeller_efficiency", 1.0)
        speeds = (scale * number(plugin, "clampMin"), scale * number(plugin, "clampMax"))
        gain = number(plugin, "thrust_efficiency", 1.0) * number(plugin, "conversion/rotorConstant")
        low, high = sorted(gain * speed * abs(speed) for speed in speeds)
        exchange.note(f"uuv_thruster of {name}: clamps and conversion {kind} give {low:g} to {high:g} N.")
    else:
        exchange.note(f"uuv_thruster of {name}: no clamps, or conversion {kind!r:.40}, which is not read.")
    if said(plugin, "thrustMin") and said(plugin, "thrustMax"):
        low, high = max(low, number(plugin, "thrustMin")), min(high, number(plugin, "thrustMax"))
    return (low, high) if math.isfinite(low) else None
