"""Writes layouts as robot descriptions, URDF or SDF, with the plugins of gz-sim that drive them.

The base link's frame is the layout's: x forward, y left, z up, at the centre of gravity. Each
actuator is a link on a joint about its shaft, axis or turn axis; the propeller of an azimuth is a
link on that link.
"""

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import NamedTuple
from xml.etree import ElementTree

from finlab.axes import Vector3
from finlab.exchange.description_body import DERIVATIVES
from finlab.exchange.exchange import Exchange
from finlab.layout import Actuator, Body, Layout

ROOT = "base_link"
MASS_SHARE = 1e-11
"""Share of the body's mass that the links of all actuators get: simulators want some."""
INERTIA_SHARE = 1e-4
"""Share of the body's least moment of inertia that they get."""
DEFAULT_INERTIA = (1e-3, 1e-3, 1e-3)
"""Moments of inertia of a body whose layout has none [kg m^2]."""
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
"""Templates of URDF; a link and its joint are at `place` [m], in the frame of the link `parent`."""
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
"""Templates of SDF, with the same fields."""


class _Link(NamedTuple):
    """A link of an actuator, on a joint of its own."""

    name: str
    parent: str
    """The link that its joint is mounted on."""
    position: Vector3
    """(3,) [m] in the frame of that link."""
    axis: Vector3
    """The axis (3,) of the joint, of length 1."""
    limits: tuple[float, float] | None
    """Least and greatest angle [rad]; None where it turns freely."""


def description_text(layout: Layout, exchange: Exchange, form: Mapping[str, str]) -> str:
    """Returns the text of a URDF or SDF file.

    It has the layout's positions, axes, limits of force, mass, inertia and damping.

    Args:
        layout: the layout to write.
        exchange: gets notes on what the file cannot hold.
        form: `URDF` or `SDF`.
    """
    body = layout.body or Body()
    links = [link for actuator in layout.actuators for link in _links(actuator)]
    texts = [_base_text(body, len(links), form)]
    mass = body.mass_kg
    link_mass = mass and mass * MASS_SHARE / len(links)
    link_inertia = _link_inertia(body, len(links))
    inertial = _inertial(form, link_mass, (link_inertia,) * 3)
    for link in links:
        fields = {
            "name": escape(link.name),
            "parent": escape(link.parent),
            "place": _text(link.position),
        }
        limit = ""
        kind = "continuous"
        if link.limits is not None:
            limit = form["limit"].format(least=link.limits[0], most=link.limits[1])
            kind = "revolute"
        texts.append(form["link"].format(**fields, inertial=inertial))
        axis = _text(link.axis)
        texts.append(form["joint"].format(**fields, kind=kind, axis=axis, limit=limit))
    for actuator in layout.actuators:
        if actuator.KIND.force_number is not None:
            values: dict[str, str | float] = {
                "joint_name": f"{actuator.name}_joint",
                "min_thrust_cmd": actuator.lower[actuator.KIND.force_number],
                "max_thrust_cmd": actuator.upper[actuator.KIND.force_number],
            }
            dead_band = getattr(actuator, "dead_band", 0.0)
            if dead_band:
                values["deadband"] = dead_band
            texts.append(_plugin(form, "Thruster", values))
    texts.append(_hydrodynamics(body, form))
    if mass is None:
        exchange.note("The layout has no mass: no link has one, and simulators want one.")
    exchange.note(
        "A robot description has no place for power, reaction torques, rates and buoyancy."
    )
    if any(actuator.KIND.force_number is None for actuator in layout.actuators):
        exchange.note(
            "Others than thrusters are joints that push nothing", "--fins names the fins among them"
        )
    text = form["robot"].format(name=escape(layout.name), parts="".join(texts))
    root = ElementTree.fromstring(text)
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _hydrodynamics(body: Body, form: Mapping[str, str]) -> str:
    """The plugin with the body's added mass and damping, as derivatives after Fossen, which are
    negative; empty where the body has neither."""
    derivatives: dict[str, float] = {}
    for field, tags in DERIVATIVES.items():
        for tag, value in zip(tags.split(), getattr(body, field) or (), strict=False):
            derivatives[tag] = -value
    if not derivatives:
        return ""
    return _plugin(form, "Hydrodynamics", {"link_name": ROOT, **derivatives})


def _base_text(body: Body, n_links: int, form: Mapping[str, str]) -> str:
    """The base link: the body's inertia without that of the actuators' links, and its hull."""
    link_inertia = _link_inertia(body, n_links)
    moments = [moment - link_inertia * n_links for moment in body.inertia_kgm2 or DEFAULT_INERTIA]
    hull = ""
    if body.hull is not None and body.hull.size_m is not None:
        hull = form["hull"].format(place=_text(body.hull.center_m), size=_text(body.hull.size_m))
    inertial = _inertial(form, body.mass_kg, moments)
    return form["base"].format(name=ROOT, inertial=inertial, hull=hull)


def _link_inertia(body: Body, n_links: int) -> float:
    """Moment of inertia of each actuator's link about any axis [kg m^2]."""
    return INERTIA_SHARE * min(body.inertia_kgm2 or DEFAULT_INERTIA) / n_links


def _links(actuator: Actuator) -> Iterator[_Link]:
    """The links of an actuator, each on the one before it and at the same point."""
    parent = ROOT
    position = actuator.position
    for suffix, axis, limits in actuator.joints:
        name = actuator.name + suffix
        yield _Link(name, parent, position, axis, limits)
        parent = name
        position = (0.0, 0.0, 0.0)


def _inertial(form: Mapping[str, str], mass: float | None, moments: Sequence[float]) -> str:
    """A link's mass [kg] and moments (3,) [kg m^2]; empty where the mass is unknown."""
    if mass is None:
        return ""
    x, y, z = map(repr, moments)
    return form["inertial"].format(mass=repr(mass), x=x, y=y, z=z)


def _plugin(form: Mapping[str, str], kind: str, values: Mapping[str, str | float]) -> str:
    """A plugin of gz-sim with its values, each in a tag of its own."""
    tags = "".join(f"<{key}>{escape(str(value))}</{key}>" for key, value in values.items())
    names = f'filename="gz-sim-{kind.lower()}-system" name="gz::sim::systems::{kind}"'
    return form["plugin"].format(plugin=f"<plugin {names}>{tags}</plugin>")


def _text(values: Sequence[float]) -> str:
    """Numbers as an attribute or a tag has them, such that they read back as the same floats."""
    return " ".join(repr(float(value)) for value in values)
