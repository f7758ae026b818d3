"""Plugins of simulators in robot descriptions: what drives a thruster, and hydrodynamics of the body.

A plugin Thruster of gz-sim pushes along its joint's axis, in newtons, or by an angular velocity w with
CT density D^4 w |w|. libuuv_thruster_ros_plugin (Plankton and DAVE have it, too) clamps its command, and
converts it. Of a body what is not said stays unknown; derivatives after Fossen are negative, and a body has
their magnitudes.
"""

import math
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from finlab.axes import Vector
from finlab.errors import LayoutError
from finlab.exchange.description import ADDED, Description, Joint, number, said
from finlab.exchange.exchange import Exchange, vector
from finlab.exchange.labels import numbers_in
from finlab.layout import Body

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
    name, link = said(plugin, "joint_name jointName"), said(plugin, "linkName")
    joint = robot.joints.get(f"{scope}{name}") or robot.joints.get(name)
    if joint is None and not name and UUV_THRUSTER in plugin.get("filename", ""):
        joint = robot.movers.get(link)
    if joint is None:
        inside = ", ".join(robot.included)[:200]
        where = f", or stands in what is included: {inside}" if inside else ""
        raise LayoutError(f"a thruster's plugin names joint {name!r:.60}, which moves no link in it{where}")
    return joint


def force_of(plugin: Element, name: str, exchange: Exchange) -> tuple[float, float] | None:
    """Returns least and most force [N] of a plugin; None where it has no limits. Raises LayoutError: a value
    of it is no number."""
    if UUV_THRUSTER in plugin.get("filename", ""):
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


def body_of(robot: Description, exchange: Exchange) -> Body:
    """Returns what the description says of the body at its centre of gravity. Raises LayoutError: a value is
    no number, or out of bounds."""
    known: Known = {}
    _keep(known, "added_mass", {axis: str(value) for axis, value in robot.added.items()}, exchange)
    water = [plugin for _, plugin in robot.plugins if is_plugin(plugin, "Hydrodynamics")]
    objects = [plugin for _, plugin in robot.plugins if UUV in plugin.get("filename", "")]
    models = [model for plugin in objects for model in plugin.findall("link/hydrodynamic_model")]
    for read, plugins, what in ((_of_gz, water, "Hydrodynamics"), (_of_uuv, models, "hydrodynamic_model")):
        for plugin in plugins[:1]:
            read(plugin, known, exchange)
        if len(plugins) > 1:
            exchange.note(f"It has {len(plugins)} plugins with {what}: the first was read.")
    if water or objects:
        exchange.note("Its buoyancy is not read: it is taken for the weight, at the centre of gravity.")
    moments: Vector | None = None
    if robot.inertia is None:
        exchange.note("A link with a mass has no inertia, so that of the body is unknown.")
    else:
        moments = vector(np.diag(robot.inertia))
        if np.abs(robot.inertia - np.diag(moments)).max() > 0.05 * max(moments):
            exchange.note("Products of inertia are left out.")
    values: dict[str, Any] = dict(known)
    return Body(mass_kg=robot.mass, inertia_kgm2=moments if moments and min(moments) > 0 else None, **values)


def _keep(known: Known, field: str, tags: dict[str, str], exchange: Exchange) -> None:
    """Keeps the values of six tags where all are said."""
    values = numbers_in([*tags.values()])
    if len(tags) == 6 and values is not None:
        known[field] = tuple(np.abs(values).tolist())
        exchange.note(f"{field} was read from {', '.join(tags)}.")
        wrong = [tag for tag, value in zip(tags, values, strict=True) if value > 0 and tag not in ADDED]
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
        exchange.note("Hydrodynamics holds no derivatives by known tags: added mass and damping are unknown.")
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
        exchange.note(f"hydrodynamic_model of type {kind!r:.40} is not read: the water's forces are unknown.")
    if said(model, "linear_damping_forward_speed"):
        exchange.note("linear_damping_forward_speed is not read.")
