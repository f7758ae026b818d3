"""Plugins of simulators that drive thrusters: their kinds, joints and limits of force.

A plugin Thruster of gz-sim pushes in newtons, or by an angular velocity w with C rho D^4 w |w|
(thrust coefficient C, density rho, diameter D). `libuuv_thruster_ros_plugin` (Plankton and DAVE
have it, too) clamps its command, and converts it to newtons.
"""

import math
from xml.etree.ElementTree import Element

from finlab.errors import LayoutError
from finlab.exchange.description import Description, number, text_at
from finlab.exchange.exchange import Exchange
from finlab.exchange.links import Joint

DEFAULT_LIMIT = 1000.0
"""What gz-sim takes for a limit of a thruster that is left out [N]."""
UUV_THRUSTER = "uuv_thruster"
"""A part of the file name of uuv_simulator's plugin for a thruster."""


def is_gz_plugin(plugin: Element, kind: str) -> bool:
    """Whether a plugin is the one of gz-sim that has a name, such as `Thruster`."""
    file = plugin.get("filename", "")
    return plugin.get("name", "").endswith(f"::{kind}") or f"{kind.lower()}-system" in file


def drives_thruster(plugin: Element) -> bool:
    """Whether a plugin drives a thruster, by gz-sim or by uuv_simulator."""
    return is_gz_plugin(plugin, "Thruster") or UUV_THRUSTER in plugin.get("filename", "")


def driven_joint(description: Description, scope: str, plugin: Element) -> Joint:
    """Returns the joint that a thruster's plugin drives.

    Args:
        description: the description that holds the plugin.
        scope: the scope of the names in the plugin.
        plugin: the plugin.

    Raises:
        LayoutError: no joint of that name moves a link.
    """
    name = text_at(plugin, "joint_name jointName")
    link = text_at(plugin, "linkName")
    joint = description.joints.get(f"{scope}{name}") or description.joints.get(name)
    if joint is None and not name and UUV_THRUSTER in plugin.get("filename", ""):
        joint = description.joint_of_link.get(link)
    if joint is None:
        included = ", ".join(description.included)[:200]
        where = f", or stands in what is included: {included}" if included else ""
        raise LayoutError(
            f"a thruster's plugin names joint {name!r:.60}, which moves no link in it{where}"
        )
    return joint


def force_limits(plugin: Element, name: str, exchange: Exchange) -> tuple[float, float] | None:
    """Returns least and most force of a thruster's plugin [N]; None where it has no limits.

    Args:
        plugin: the plugin.
        name: the thruster's name, for the notes.
        exchange: gets the notes.

    Raises:
        LayoutError: a value of the plugin is no number.
    """
    if UUV_THRUSTER in plugin.get("filename", ""):
        return _uuv_force_limits(plugin, name, exchange)
    if not text_at(plugin, "min_thrust_cmd max_thrust_cmd"):
        return None
    low = number(plugin, "min_thrust_cmd", -DEFAULT_LIMIT)
    high = number(plugin, "max_thrust_cmd", DEFAULT_LIMIT)
    if text_at(plugin, "use_angvel_cmd").lower() in ("1", "true"):
        density = number(plugin, "fluid_density", 1000.0)
        diameter = number(plugin, "propeller_diameter", 0.02)
        gain = number(plugin, "thrust_coefficient", 1.0) * density * diameter**4
        return _quadratic_limits(gain, low, high)
    return low, high


def _uuv_force_limits(plugin: Element, name: str, exchange: Exchange) -> tuple[float, float] | None:
    """As `force_limits`, of a plugin of uuv_simulator."""
    conversion = text_at(plugin, "conversion/type")
    low = -math.inf
    high = math.inf
    if text_at(plugin, "clampMin") and text_at(plugin, "clampMax") and conversion == "Basic":
        speed_gain = number(plugin, "gain", 1.0) * number(plugin, "propeller_efficiency", 1.0)
        slowest = speed_gain * number(plugin, "clampMin")
        fastest = speed_gain * number(plugin, "clampMax")
        efficiency = number(plugin, "thrust_efficiency", 1.0)
        gain = efficiency * number(plugin, "conversion/rotorConstant")
        low, high = _quadratic_limits(gain, slowest, fastest)
        exchange.note(
            f"uuv_thruster of {name}: clamps and conversion {conversion} give {low:g} to {high:g} "
            "N."
        )
    else:
        exchange.note(
            f"uuv_thruster of {name}: no clamps, or conversion {conversion!r:.40}, which is not "
            "read."
        )
    if text_at(plugin, "thrustMin") and text_at(plugin, "thrustMax"):
        low = max(low, number(plugin, "thrustMin"))
        high = min(high, number(plugin, "thrustMax"))
    return (low, high) if math.isfinite(low) else None


def _quadratic_limits(gain: float, slowest: float, fastest: float) -> tuple[float, float]:
    """Least and most force gain w |w| [N] between two angular velocities, in order."""
    at_slowest = gain * slowest * abs(slowest)
    at_fastest = gain * fastest * abs(fastest)
    return min(at_slowest, at_fastest), max(at_slowest, at_fastest)
