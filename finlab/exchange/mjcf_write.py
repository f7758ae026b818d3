"""Writes layouts as models of MuJoCo (MJCF); `mjcf_control.py` has the ctrl of such a model.

The robot is one body with a free joint, whose frame is the layout's: x forward, y left, z up, at
the centre of gravity. A thruster is a site whose z is its axis, and a motor in newtons. What turns
its thrust, an azimuth by its pod or a fin by its zero direction, is a body on a hinge, with a motor
for the thrust and a servo for the angle. The weight is compensated; the water's drag is not there.
"""

from collections.abc import Sequence
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from finlab.axes import is_full_turn
from finlab.exchange.description_text import DEFAULT_INERTIA
from finlab.exchange.exchange import Exchange
from finlab.exchange.mjcf_control import drive_of
from finlab.layout import Actuator, Body, Hull, Layout

BASE = "base_link"
"""Name of the robot's body."""
WORLD = "world"
"""Name that MuJoCo has taken for the body of the world."""
SERVO = "_angle"
"""What follows the name of an actuator in that of the servo that turns it."""
DEFAULT_MASS = 10.0
"""Mass of a body whose layout has none [kg]."""
LINK_SHARE = 1e-12
"""Mass and moment of inertia of a body that turns, as shares of the robot's."""
LEAST_LINK = 1e-14
"""Least of either [kg, kg m^2]; MuJoCo wants 1e-15."""
ARMATURE = 0.01
"""Inertia of a servo about its hinge [kg m^2]: the servo turns that, and not the hull."""
STIFFNESS = 4.0
"""Torque of a servo per angle [N m/rad]: with `ARMATURE` it swings at 20 rad/s."""
DAMPING = 0.4
"""Torque of a servo per angular velocity [N m s/rad], which lets it swing no more."""
THRUSTER_SIZE = (0.04, 0.02)
"""Radius of the disc that stands for a thruster, and half its length [m]."""
HULL_COLOR = "0.9 0.75 0.2 0.3"
"""Red, green, blue and opacity of the hull."""
WATER = {
    "type": "skybox",
    "builtin": "gradient",
    "rgb1": "0.35 0.55 0.7",
    "rgb2": "0.02 0.1 0.2",
    "width": "64",
    "height": "64",
}
"""What stands behind the robot."""
GEOMS = {"box": "box", "ucat": "box", "ellipsoid": "ellipsoid", "torpedo": "ellipsoid"}
"""Types of geoms by the shape of a hull."""


def write_mjcf(layout: Layout, exchange: Exchange, _suffix: str) -> str:
    """Returns the text of a model of MuJoCo.

    Args:
        layout: the layout to write.
        exchange: gets notes on what the model cannot hold.
    """
    body = layout.body or Body()
    turning = [actuator for actuator in layout.actuators if drive_of(actuator).turns]
    moments = body.inertia_kgm2 or DEFAULT_INERTIA
    mass = body.mass_kg or DEFAULT_MASS
    root = Element("mujoco", model=layout.name)
    compiler = SubElement(root, "compiler", angle="radian", autolimits="true")
    if 2.0 * max(moments) > sum(moments):
        compiler.set("balanceinertia", "true")
        exchange.note("No solid has its moments of inertia: MuJoCo balances them.")
    SubElement(root, "option", integrator="implicitfast")
    assets = SubElement(root, "asset")
    SubElement(assets, "texture", WATER)
    world = SubElement(root, "worldbody")
    SubElement(world, "light", pos="0 0 5", dir="0 0 -1", directional="true")
    base = SubElement(world, "body", name=_base_name(layout), gravcomp="1")
    SubElement(base, "freejoint", name=f"{_base_name(layout)}_joint")
    _add_inertial(base, mass, moments)
    if body.hull is not None:
        _add_hull(base, body.hull, exchange)
    drives = Element("actuator")
    for actuator in layout.actuators:
        place = base
        if actuator in turning:
            link = _link_name(actuator, layout.names)
            position = _text(actuator.position)
            place = SubElement(base, "body", name=link, pos=position, gravcomp="1")
            _add_hinge(place, actuator)
            link_mass = max(LINK_SHARE * mass, LEAST_LINK)
            link_moment = max(LINK_SHARE * min(moments), LEAST_LINK)
            _add_inertial(place, link_mass, [link_moment] * 3)
        _add_drive(place, drives, actuator, layout.names)
    root.append(drives)
    _note_what_is_left_out(layout, exchange)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _base_name(layout: Layout) -> str:
    """The name of the robot's body, which no actuator has."""
    return BASE if BASE not in layout.names else f"{BASE} of {layout.name}"[:80]


def _link_name(actuator: Actuator, names: Sequence[str]) -> str:
    """The name of the body of an actuator that turns: its own, but for that of the world."""
    name = actuator.name
    while name == WORLD or (name != actuator.name and name in names):
        name += "_"
    return name


def _add_inertial(body: Element, mass: float, moments: Sequence[float]) -> None:
    """Adds a mass [kg] and moments (3,) [kg m^2] at the origin of a body."""
    SubElement(body, "inertial", pos="0 0 0", mass=repr(mass), diaginertia=_text(moments))


def _add_hull(base: Element, hull: Hull, exchange: Exchange) -> None:
    """Adds the hull, which is drawn, and neither weighs nor touches anything."""
    if hull.shape is None or hull.size_m is None:
        exchange.note("The mesh of the hull is left out.")
        return
    SubElement(
        base,
        "geom",
        name="hull",
        type=GEOMS[hull.shape],
        pos=_text(hull.center_m),
        size=_text([0.5 * length for length in hull.size_m]),
        mass="0",
        contype="0",
        conaffinity="0",
        rgba=HULL_COLOR,
    )


def _add_hinge(body: Element, actuator: Actuator) -> None:
    """Adds the joint that turns an actuator, with its limits."""
    joint = SubElement(
        body,
        "joint",
        name=f"{actuator.name}_joint",
        type="hinge",
        axis=_text(actuator.frame[0]),
        armature=repr(ARMATURE),
    )
    limits = _limits_of_angle(actuator)
    if limits is not None:
        joint.set("range", _text(limits))


def _limits_of_angle(actuator: Actuator) -> tuple[float, float] | None:
    """The limits of the angle of an actuator that turns [rad]; None of one that may turn all round,
    and of fins, whose thrust may point elsewhere than they do."""
    number = actuator.KIND.aiming_number or 0
    low = actuator.lower[number]
    high = actuator.upper[number]
    is_fin = actuator.KIND.force_number is None and not actuator.KIND.driven_by_flow
    return None if is_fin or is_full_turn(high - low) else (low, high)


def _add_drive(place: Element, drives: Element, actuator: Actuator, names: Sequence[str]) -> None:
    """Adds the site, the motor and the servo of an actuator.

    Args:
        place: the body that it is on: its own where it turns.
        drives: gets the motor and the servo.
        actuator: the actuator.
        names: names of all actuators.
    """
    drive = drive_of(actuator)
    if drive.row >= 0:
        site = SubElement(
            place,
            "site",
            name=actuator.name,
            type="cylinder",
            size=_text(THRUSTER_SIZE),
            zaxis=_text(actuator.frame[drive.row]),
        )
        if not drive.turns:
            site.set("pos", _text(actuator.position))
        reaction = getattr(actuator, "torque_per_newton", 0.0)
        SubElement(
            drives,
            "motor",
            name=actuator.name,
            site=actuator.name,
            gear=_text([0.0, 0.0, 1.0, 0.0, 0.0, reaction]),
            ctrlrange=_text(_limits_of_force(actuator)),
        )
    if drive.turns:
        name = actuator.name + (SERVO if drive.row >= 0 else "")
        while drive.row >= 0 and name in names:
            name += "_"
        servo = SubElement(
            drives,
            "position",
            name=name,
            joint=f"{actuator.name}_joint",
            kp=repr(STIFFNESS),
            kv=repr(DAMPING),
        )
        limits = _limits_of_angle(actuator)
        if limits is not None:
            servo.set("ctrlrange", _text(limits))


def _limits_of_force(actuator: Actuator) -> tuple[float, float]:
    """Least and most force of an actuator [N]; of a fin the most that it can push at all."""
    number = actuator.KIND.force_number
    if number is None:
        return 0.0, actuator.largest(0.0)
    return actuator.lower[number], actuator.upper[number]


def _note_what_is_left_out(layout: Layout, exchange: Exchange) -> None:
    """Says what the model has no place for."""
    body = layout.body or Body()
    if body.mass_kg is None:
        exchange.note(
            f"The layout has no mass: {DEFAULT_MASS:g} kg are written, since a simulation wants "
            "one; correct <inertial>."
        )
    elif body.inertia_kgm2 is None:
        exchange.note("The layout has no moments of inertia; correct `diaginertia`.")
    has_water = body.added_mass or body.linear_damping or body.quadratic_damping
    water = ", added mass, damping and the centre of buoyancy" if has_water else ""
    exchange.note(
        f"MJCF has no place for power, dead bands, rates and lags{water}; the weight is "
        "compensated (gravcomp)."
    )
    for actuator in layout.actuators:
        words = _words_of(actuator)
        if words is not None:
            exchange.note(*words)


def _words_of(actuator: Actuator) -> tuple[str, str] | None:
    """What is to be known of how an actuator stands in a model, and what to do about it; None of a
    thruster."""
    drive = drive_of(actuator)
    if drive.row < 0:
        return "A rudder is a joint with a servo: the flow's force on it is not MuJoCo's", ""
    if drive.turns and actuator.KIND.force_number is None:
        return (
            "A fin is a hinge at its zero direction and a motor of its mean thrust; finlab.exchange"
            ".mujoco_control makes their ctrl of an answer",
            "--fins names the fins again",
        )
    if drive.turns:
        return "What turns has a motor NAME [N] and a servo NAME_angle [rad]", ""
    return None


def _text(values: Sequence[float]) -> str:
    """Numbers as an attribute has them, such that they read back as the same floats."""
    return " ".join(repr(float(value)) for value in values)
