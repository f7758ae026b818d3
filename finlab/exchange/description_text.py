"""Layouts as robot descriptions, URDF or SDF, with the plugins of gz-sim that drive them.

The base link's frame is the layout's: x forward, y left, z up, at the centre of gravity. Each actuator is a
link on a joint about its shaft, axis or turn axis; the propeller of an azimuth is a link on that link.
"""

from collections.abc import Sequence
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from finlab.arrays import Array
from finlab.exchange.exchange import Exchange
from finlab.exchange.gazebo import DERIVATIVES
from finlab.layout import Actuator, Azimuth, Body, Fin, Layout, Rudder, Thruster
from finlab.layout.angles import is_full_turn
from finlab.layout.axes import Vector

BLADE = (0.10, 0.18, 0.005)
"""Length along the shaft, width and thickness of a fin as drawn [m]; a picture, not physics."""
SHARE = 1e-4
"""Share of the body's mass and inertia that all actuators get together: simulators want some."""
ROOT = "base_link"


def description_text(layout: Layout, exchange: Exchange, form: str) -> str:
    """Returns the contents of a `urdf` or `sdf` file with a layout's places, axes, limits of force, mass and
    damping; `exchange` gets notes on what it has not."""
    writer = _Writer(layout.name, form == "sdf")
    writer.base(layout)
    for part in layout.actuators:
        writer.actuator(part)
    body = layout.body or Body()
    told = {
        tag: -value
        for field, tags in DERIVATIVES.items()
        for tag, value in zip(tags.split(), getattr(body, field) or (), strict=False)
    }
    if told:
        writer.plugin("Hydrodynamics", link_name=ROOT, **told)
    if body.mass_kg is None:
        exchange.note("The layout has no mass: no link has one, and simulators want one.")
    if any(isinstance(part, Fin | Rudder) for part in layout.actuators):
        exchange.note(
            "Fins and rudders are joints without force; read again, --fins names those that are fins."
        )
    lost = "power, reaction torques, time constants, rates, laws of fins and rudders, buoyancy"
    exchange.note(f"A robot description has no place for {lost}.")
    ElementTree.indent(writer.root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(writer.root, encoding="unicode") + "\n"


class _Writer:
    """The two dialects: what URDF has as attributes, SDF has as elements."""

    def __init__(self, name: str, sdf: bool) -> None:
        self.sdf = sdf
        self.root = Element("sdf", version="1.9") if sdf else Element("robot", name=name)
        self.top = SubElement(self.root, "model", name=name) if sdf else self.root
        self.mass, self.moment = 0.0, 0.0

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

    def pose(self, parent: Element, place: Sequence[float], yaw: float = 0.0) -> None:
        if self.sdf:
            SubElement(parent, "pose").text = _text((*place, 0.0, 0.0, yaw))
        else:
            SubElement(parent, "origin", xyz=_text(place), rpy=_text((0.0, 0.0, yaw)))

    def inertial(self, link: Element, place: Sequence[float], mass: float, inertia: Array) -> None:
        inertial = SubElement(link, "inertial")
        self.pose(inertial, place)
        self.put(inertial, "mass", value=repr(float(mass)))
        pairs = {f"i{'xyz'[i]}{'xyz'[j]}": repr(float(inertia[i, j])) for i in range(3) for j in range(i, 3)}
        self.put(inertial, "inertia", **pairs)

    def box(self, link: Element, size: Sequence[float], place: Sequence[float]) -> None:
        visual = SubElement(link, "visual", name=f"{link.get('name')}_visual")
        self.pose(visual, place)
        self.put(SubElement(visual, "geometry"), "box", size=_text(size))

    def base(self, layout: Layout) -> None:
        """The hull; with the links of the actuators it has the mass and inertia of the body."""
        link, body = SubElement(self.top, "link", name=ROOT), layout.body or Body()
        if body.mass_kg is not None:
            places = [place for part in layout.actuators for place in [part.position] * len(_links(part))]
            moments = body.inertia_kgm2 or (1e-3,) * 3
            self.mass, self.moment = SHARE * body.mass_kg / len(places), SHARE * min(moments) / len(places)
            own = body.mass_kg - self.mass * len(places)
            center = -np.sum(places, axis=0) * self.mass / own
            inertia = np.diag(moments) - self.moment * len(places) * np.eye(3)
            for mass, arm in [(own, center), *((self.mass, np.array(place)) for place in places)]:
                inertia -= mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
            self.inertial(link, center.tolist(), own, inertia)
        if body.hull is not None and body.hull.size_m is not None:
            self.box(link, body.hull.size_m, body.hull.center_m)

    def actuator(self, part: Actuator) -> None:
        parent, place = ROOT, part.position
        for name, axis, ends in _links(part):
            yaw = part.mounting_angle if isinstance(part, Fin) else None
            link = SubElement(self.top, "link", name=name)
            if self.mass:
                self.inertial(link, (0.0, 0.0, 0.0), self.mass, self.moment * np.eye(3))
            if yaw is not None:  # beside its shaft, towards where it pushes from at zero direction 0
                self.box(link, BLADE, (BLADE[0] / 2, -BLADE[1] / 2, 0.0))
            kind = "continuous" if ends is None else "revolute"
            joint = SubElement(self.top, "joint", name=f"{name}_joint", type=kind)
            self.pose(
                link if self.sdf else joint, place if self.sdf or parent == ROOT else (0.0,) * 3, yaw or 0.0
            )
            self.put(joint, "parent", link=parent)
            self.put(joint, "child", link=name)
            turned = self.put(joint, "axis", xyz=_text(axis if yaw is None else (1.0, 0.0, 0.0)))
            if ends is not None:
                more = {} if self.sdf else {"effort": "1", "velocity": "10"}
                self.put(
                    turned if self.sdf else joint, "limit", lower=repr(ends[0]), upper=repr(ends[1]), **more
                )
            parent = name
        if isinstance(part, Thruster | Azimuth):
            limits = {"min_thrust_cmd": part.force[0], "max_thrust_cmd": part.force[1]}
            band = {"deadband": part.dead_band} if part.dead_band else {}
            self.plugin("Thruster", joint_name=f"{part.name}_joint", **limits, **band)

    def plugin(self, kind: str, **values: str | float) -> None:
        holder = self.top if self.sdf else SubElement(self.top, "gazebo")
        names = {"filename": f"gz-sim-{kind.lower()}-system", "name": f"gz::sim::systems::{kind}"}
        plugin = SubElement(holder, "plugin", names)
        for key, value in values.items():
            SubElement(plugin, key).text = value if isinstance(value, str) else repr(float(value))


def _links(part: Actuator) -> list[tuple[str, Vector, tuple[float, float] | None]]:
    """Links of an actuator from the base on: name, axis in the body frame, and limits of the angle [rad]."""
    if isinstance(part, Azimuth):
        arc = None if is_full_turn(part.arc[1] - part.arc[0]) else part.arc
        return [(f"{part.name}_mount", part.turn_axis, arc), (part.name, part.zero, None)]
    return [(part.name, part.frame[0], part.deflection if isinstance(part, Rudder) else None)]


def _text(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
