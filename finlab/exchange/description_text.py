"""Layouts as robot descriptions, URDF or SDF, with the plugins of gz-sim that drive them.

The base link's frame is the layout's: x forward, y left, z up, at the centre of gravity. Each
actuator is a link on a joint about its shaft, axis or turn axis; the propeller of an azimuth is a
link on that link.
"""

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from xml.etree import ElementTree

from finlab.axes import Vector3
from finlab.exchange.exchange import Exchange
from finlab.exchange.gazebo import DERIVATIVES
from finlab.layout import Actuator, Body, Layout

ROOT = "base_link"
MASS, MOMENT = 1e-11, 1e-4
"""Shares of the body's mass and inertia that the links of all actuators get: simulators want
some."""
URDF = {
    "robot": '<robot name="{name}">{parts}</robot>',
    "base": '<link name="{name}">{inertial}{hull}</link>',
    "link": '<link name="{name}">{inertial}</link>',
    "inertial": '<inertial><mass value="{mass}"/>'
    '<inertia ixx="{x}" iyy="{y}" izz="{z}" ixy="0" ixz="0" iyz="0"/></inertial>',
    "hull": '<visual name="hull"><origin xyz="{place}"/>'
    '<geometry><box size="{size}"/></geometry></visual>',
    "joint": '<joint name="{name}_joint" type="{kind}"><origin xyz="{place}"/>'
    '<parent link="{parent}"/><child link="{name}"/><axis xyz="{axis}"/>{limit}</joint>',
    "limit": '<limit lower="{least!r}" upper="{most!r}" effort="100" velocity="10"/>',
    "plugin": "<gazebo>{plugin}</gazebo>",
}
SDF = {
    "robot": '<sdf version="1.9"><model name="{name}">{parts}</model></sdf>',
    "base": URDF["base"],
    "link": '<link name="{name}">'
    '<pose relative_to="{parent}">{place} 0 0 0</pose>{inertial}</link>',
    "inertial": "<inertial><mass>{mass}</mass>"
    "<inertia><ixx>{x}</ixx><iyy>{y}</iyy><izz>{z}</izz></inertia></inertial>",
    "hull": '<visual name="hull"><pose>{place} 0 0 0</pose>'
    "<geometry><box><size>{size}</size></box></geometry></visual>",
    "joint": '<joint name="{name}_joint" type="{kind}">'
    "<parent>{parent}</parent><child>{name}</child><axis><xyz>{axis}</xyz>{limit}</axis></joint>",
    "limit": "<limit><lower>{least!r}</lower><upper>{most!r}</upper><effort>100</effort>"
    "<velocity>10</velocity></limit>",
    "plugin": "{plugin}",
}
"""Parts of a file; a link and its joint are at `place` [m], seen from the link `parent`."""


def description_text(layout: Layout, exchange: Exchange, form: Mapping[str, str]) -> str:
    """Returns the contents of a URDF or SDF file with a layout's places, axes, limits of force,
    mass and damping; `exchange` gets notes on what it has not."""
    body = layout.body or Body()
    links = [link for part in layout.actuators for link in _links(part)]
    hull = ""
    mass = body.mass_kg
    moments = body.inertia_kgm2 or (1e-3,) * 3
    share = MOMENT * min(moments) / len(links)
    if body.hull is not None and body.hull.size_m is not None:
        hull = form["hull"].format(place=_text(body.hull.center_m), size=_text(body.hull.size_m))
    inertial = _inertial(form, mass, [moment - share * len(links) for moment in moments])
    parts = [form["base"].format(name=ROOT, inertial=inertial, hull=hull)]
    inertial = _inertial(form, mass and mass * MASS / len(links), (share,) * 3)
    for name, parent, place, axis, ends in links:
        own = {"name": escape(name), "parent": escape(parent), "place": _text(place)}
        limit = "" if ends is None else form["limit"].format(least=ends[0], most=ends[1])
        kind = "continuous" if ends is None else "revolute"
        parts.append(form["link"].format(**own, inertial=inertial))
        parts.append(form["joint"].format(**own, kind=kind, axis=_text(axis), limit=limit))
    for part in layout.actuators:
        if part.KIND.force_number is not None:
            low = part.lower[part.KIND.force_number]
            high = part.upper[part.KIND.force_number]
            limits = {"min_thrust_cmd": low, "max_thrust_cmd": high}
            dead_band = getattr(part, "dead_band", 0.0)
            band = {"deadband": dead_band} if dead_band else {}
            parts.append(
                _plugin(form, "Thruster", {"joint_name": f"{part.name}_joint", **limits, **band})
            )
    damping: dict[str, float] = {}
    for field, tags in DERIVATIVES.items():
        damping |= dict(
            zip(tags.split(), (-value for value in getattr(body, field) or ()), strict=False)
        )
    if damping:
        parts.append(_plugin(form, "Hydrodynamics", {"link_name": ROOT, **damping}))
    if mass is None:
        exchange.note("The layout has no mass: no link has one, and simulators want one.")
    exchange.note(
        "A robot description has no place for power, reaction torques, rates and buoyancy."
    )
    if any(part.KIND.force_number is None for part in layout.actuators):
        exchange.note(
            "Others than thrusters are joints that push nothing; --fins names the fins among them."
        )
    text = form["robot"].format(name=escape(layout.name), parts="".join(parts))
    root = ElementTree.fromstring(text)
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _links(
    part: Actuator,
) -> Iterator[tuple[str, str, Vector3, Vector3, tuple[float, float] | None]]:
    """Links of an actuator: name, parent, place seen from it [m], axis, and limits of the angle
    [rad]."""
    parent = ROOT
    place = part.position
    for suffix, axis, ends in part.joints:
        yield part.name + suffix, parent, place, axis, ends
        parent = part.name + suffix
        place = (0.0, 0.0, 0.0)


def _inertial(form: Mapping[str, str], mass: float | None, moments: Sequence[float]) -> str:
    """What weighs a link: mass [kg], nothing where that is unknown, and moments (3,) [kg m^2]."""
    x, y, z = map(repr, moments)
    return "" if mass is None else form["inertial"].format(mass=repr(mass), x=x, y=y, z=z)


def _plugin(form: Mapping[str, str], kind: str, values: Mapping[str, str | float]) -> str:
    tags = "".join(f"<{key}>{escape(str(value))}</{key}>" for key, value in values.items())
    names = f'filename="gz-sim-{kind.lower()}-system" name="gz::sim::systems::{kind}"'
    return form["plugin"].format(plugin=f"<plugin {names}>{tags}</plugin>")


def _text(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
