"""Plugins of simulators that drive a thruster, and their forces: gz-sim, uuv_simulator and its heirs.

A plugin Thruster of gz-sim pushes along its joint's axis, in newtons, or by an angular velocity w with
CT density D^4 w |w|. libuuv_thruster_ros_plugin (Plankton and DAVE have it, too) clamps its command, and
converts it.
"""

from xml.etree.ElementTree import Element

import numpy as np

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange.description import Description, Joint, number, said
from finlab.exchange.exchange import Exchange

MOST = 1000.0
"""What gz-sim takes for a limit of a thruster that is left out [N]."""
UUV = "uuv_thruster"
"""Part of the name of the library of uuv_simulator."""


def is_plugin(plugin: Element, kind: str) -> bool:
    """Whether a plugin is of a kind of gz-sim's."""
    return plugin.get("name", "").endswith(f"::{kind}") or f"{kind.lower()}-system" in plugin.get(
        "filename", ""
    )


def drives(plugin: Element) -> bool:
    """Whether a plugin drives a thruster, so that it can be read."""
    return is_plugin(plugin, "Thruster") or UUV in plugin.get("filename", "")


def driven(robot: Description, scope: str, plugin: Element) -> Joint:
    """Returns the joint that a thruster's plugin drives.

    Raises:
        LayoutError: it moves no link.
    """
    name = said(plugin, "joint_name jointName")
    joint = robot.joints.get(f"{scope}{name}") or robot.joints.get(name)
    if joint is None and not name and UUV in plugin.get("filename", ""):
        name = said(plugin, "linkName")
        joint = robot.movers.get(name)
    if joint is None:
        where = (
            f", or stands in what is included: {', '.join(robot.included)[:200]}" if robot.included else ""
        )
        raise LayoutError(f"a thruster's plugin names joint {name!r:.60}, which moves no link in it{where}")
    return joint


def force_of(plugin: Element, name: str, exchange: Exchange) -> tuple[float, float] | None:
    """Returns least and most force [N] of a plugin; None where it has no limits.

    Raises:
        LayoutError: a value of it is no number.
    """
    if UUV in plugin.get("filename", ""):
        return _uuv_force(plugin, name, exchange)
    if not said(plugin, "min_thrust_cmd max_thrust_cmd"):
        return None
    ends = [number(plugin, "min_thrust_cmd", -MOST), number(plugin, "max_thrust_cmd", MOST)]
    if said(plugin, "use_angvel_cmd").lower() in ("1", "true"):
        density, size = number(plugin, "fluid_density", 1000.0), number(plugin, "propeller_diameter", 0.02)
        gain = number(plugin, "thrust_coefficient", 1.0) * density * size**4
        ends = sorted(gain * end * abs(end) for end in ends)
    return ends[0], ends[1]


def _uuv_force(plugin: Element, name: str, exchange: Exchange) -> tuple[float, float] | None:
    kind, ends = said(plugin, "conversion/type"), None
    if said(plugin, "clampMin") and said(plugin, "clampMax") and kind in ("Basic", "Bessa", "LinearInterp"):
        scale = number(plugin, "gain", 1.0) * number(plugin, "propeller_efficiency", 1.0)
        speeds = np.array([scale * number(plugin, "clampMin"), scale * number(plugin, "clampMax")])
        forces = number(plugin, "thrust_efficiency", 1.0) * _converted(plugin, kind, speeds)
        ends = float(forces.min()), float(forces.max())
        exchange.note(
            f"uuv_thruster of {name}: clamps and conversion {kind} give {ends[0]:g} to {ends[1]:g} N."
        )
    else:
        exchange.note(f"uuv_thruster of {name}: no clamps, or conversion {kind!r:.40}, which is not read.")
    least, most = (said(plugin, f"thrust{end}") for end in ("Min", "Max"))
    if least and most:
        low, high = number(plugin, "thrustMin"), number(plugin, "thrustMax")
        ends = (low, high) if ends is None else (max(low, ends[0]), min(high, ends[1]))
    return ends


def _converted(plugin: Element, kind: str, speeds: Array) -> Array:
    """Thrust [N] at some commands (2,)."""
    turned: Array = speeds * np.abs(speeds)
    if kind == "Basic":
        turned *= number(plugin, "conversion/rotorConstant")
        return turned
    if kind == "Bessa":
        left, right = (number(plugin, f"conversion/delta{side}") for side in "LR")
        sides = [number(plugin, f"conversion/rotorConstant{side}") for side in "LR"]
        forces = np.where(turned < left, sides[0] * (turned - left), sides[1] * (turned - right))
        forces = np.where((turned >= left) & (turned <= right), 0.0, forces)
        return forces
    told = [said(plugin, f"conversion/{key}Values").split() for key in ("input", "output")]
    try:
        inputs, outputs = (np.array(values, dtype=np.float64) for values in told)
        return np.array(np.interp(speeds, inputs, outputs))
    except ValueError:
        raise LayoutError("conversion LinearInterp expects as many inputValues as outputValues") from None
