"""Layouts as robot descriptions, URDF or SDF, with the plugins of gz-sim that drive them.

The base link's frame is the layout's: x forward, y left, z up, at the centre of gravity. Each actuator is a
link on a joint about its shaft, axis or turn axis; the propeller of an azimuth is a link on that link.
"""

from collections.abc import Sequence
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from finlab.exchange.description import MOMENTS
from finlab.exchange.exchange import Exchange
from finlab.exchange.gazebo import DERIVATIVES
from finlab.layout import Actuator, Azimuth, Body, Layout, Rudder, Thruster
from finlab.layout.angles import is_full_turn
from finlab.layout.axes import Vector

ROOT = "base_link"
MASS, MOMENT = 1e-11, 1e-4
"""Shares of the body's mass and inertia that the links of all actuators get: simulators want some."""


def description_text(layout: Layout, exchange: Exchange, sdf: bool) -> str:
    """Returns the contents of a URDF or SDF file with a layout's places, axes, limits of force, mass and
    damping; `exchange` gets notes on what it has not."""
    writer, body, links = _Writer(layout.name, sdf), layout.body or Body(), _links(layout.actuators)
    moments = body.inertia_kgm2 or (1e-3,) * 3
    share = MOMENT * min(moments) / len(links)
    base = writer.link(ROOT, (0.0, 0.0, 0.0), body.mass_kg, [m - share * len(links) for m in moments])
    if body.hull is not None and body.hull.size_m is not None:
        visual = SubElement(base, "visual", name="hull")
        writer.pose(visual, body.hull.center_m)
        writer.put(SubElement(visual, "geometry"), "box", size=_text(body.hull.size_m))
    for name, parent, place, axis, ends in links:
        here = place if parent == ROOT else (0.0, 0.0, 0.0)
        writer.link(name, place, body.mass_kg and body.mass_kg * MASS / len(links), [share] * 3)
        writer.joint(name, parent, here, axis, ends)
    for part in layout.actuators:
        if isinstance(part, Thruster | Azimuth):
            limits = {"min_thrust_cmd": part.force[0], "max_thrust_cmd": part.force[1]}
            band = {"deadband": part.dead_band} if part.dead_band else {}
            writer.plugin("Thruster", joint_name=f"{part.name}_joint", **limits, **band)
    told: dict[str, float] = {}
    for field, tags in DERIVATIVES.items():
        told |= dict(zip(tags.split(), (-value for value in getattr(body, field) or ()), strict=False))
    if told:
        writer.plugin("Hydrodynamics", link_name=ROOT, **told)
    if body.mass_kg is None:
        exchange.note("The layout has no mass: no link has one, and simulators want one.")
    exchange.note("A robot description has no place for power, reaction torques, rates and buoyancy.")
    if any(not isinstance(part, Thruster | Azimuth) for part in layout.actuators):
        exchange.note(
            "Fins and rudders are joints that push nothing; --fins names the fins among them again."
        )
    ElementTree.indent(writer.root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(writer.root, encoding="unicode") + "\n"


def _links(parts: Sequence[Actuator]) -> list[tuple[str, str, Vector, Vector, tuple[float, float] | None]]:
    """Links of actuators: name, parent, place and axis in the body frame, and limits of the angle [rad]."""
    links: list[tuple[str, str, Vector, Vector, tuple[float, float] | None]] = []
    for part in parts:
        ends, mount = part.deflection if isinstance(part, Rudder) else None, f"{part.name}_mount"
        if isinstance(part, Azimuth):
            arc = None if is_full_turn(part.arc[1] - part.arc[0]) else part.arc
            links.append((mount, ROOT, part.position, part.turn_axis, arc))
            links.append((part.name, mount, part.position, part.zero, None))
        else:
            links.append((part.name, ROOT, part.position, part.frame[0], ends))
    return links


class _Writer:
    """The two dialects: what URDF has as attributes, SDF has as elements."""

    def __init__(self, name: str, sdf: bool) -> None:
        self.sdf = sdf
        self.root = Element("sdf", version="1.9") if sdf else Element("robot", name=name)
        self.top = SubElement(self.root, "model", name=name) if sdf else self.root

    def put(self, parent: Element, tag: str, **values: str) -> Element:
        element = SubElement(parent, tag)
        for key, value in values.items():
            if not self.sdf:
                element.set(key, value)
            elif key in ("value", "link"):
                element.text = value
            else:
                SubElement(element, key).text = value
        return element

    def pose(self, parent: Element, place: Sequence[float]) -> None:
        if self.sdf:
            SubElement(parent, "pose").text = _text((*place, 0.0, 0.0, 0.0))
        else:
            SubElement(parent, "origin", xyz=_text(place))

    def link(
        self, name: str, place: Sequence[float], mass: float | None, moments: Sequence[float]
    ) -> Element:
        link = SubElement(self.top, "link", name=name)
        if self.sdf:
            self.pose(link, place)
        if mass is not None:
            inertial, diagonal = (
                SubElement(link, "inertial"),
                dict(zip(("xx", "yy", "zz"), moments, strict=True)),
            )
            self.put(inertial, "mass", value=repr(mass))
            self.put(inertial, "inertia", **{f"i{key}": repr(diagonal.get(key, 0.0)) for key in MOMENTS})
        return link

    def joint(
        self, name: str, parent: str, place: Vector, axis: Vector, ends: tuple[float, float] | None
    ) -> None:
        kind = "continuous" if ends is None else "revolute"
        joint = SubElement(self.top, "joint", name=f"{name}_joint", type=kind)
        if not self.sdf:
            self.pose(joint, place)
        self.put(joint, "parent", link=parent)
        self.put(joint, "child", link=name)
        turned = self.put(joint, "axis", xyz=_text(axis))
        if ends is not None:
            limits = {"lower": repr(ends[0]), "upper": repr(ends[1]), "effort": "100", "velocity": "10"}
            self.put(turned if self.sdf else joint, "limit", **limits)

    def plugin(self, kind: str, **values: str | float) -> None:
        holder = self.top if self.sdf else SubElement(self.top, "gazebo")
        names = {"filename": f"gz-sim-{kind.lower()}-system", "name": f"gz::sim::systems::{kind}"}
        plugin = SubElement(holder, "plugin", names)
        for key, value in values.items():
            SubElement(plugin, key).text = value if isinstance(value, str) else repr(value)


def _text(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
