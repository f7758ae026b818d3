"""Reads robots of the simulator Stonefish: scenarios (.scn), and files of one robot for them.

Its frames have x forward, y to the right and z down. A thruster pushes along the x of its origin,
forwards by its thrust coefficient and largest setpoint; a left-handed propeller or an inverted
setpoint changes the sign of what is sent to it, and not where it pushes. Values may be `${...}`,
arithmetic that is evaluated by `expressions`, and nothing else is opened or run.

The models of thrust are those of version 1.5 (F = C rho D^4 n |n| of `fluid_dynamics`, in
revolutions per second, others by the angular velocity), and the older `specs` with `max_rpm`.
"""

import math
import re
from dataclasses import dataclass, field, replace
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange.description import numbers, text_at
from finlab.exchange.exchange import TO_FRD, Exchange
from finlab.exchange.expressions import evaluate
from finlab.exchange.labels import listed
from finlab.exchange.links import TURNING, Joint, LinkMass, combined
from finlab.exchange.mounts import on_mount
from finlab.exchange.questions import which_robot
from finlab.layout import MAX_ACTUATORS, Actuator, Body, Layout

SIMPLE = "simple_thruster"
"""A thruster whose setpoint is its force, whichever way its propeller turns."""
THRUSTERS = ("thruster", SIMPLE)
"""Types of actuators that are read."""
FLUID = "fluid_dynamics"
"""The model of thrust that is taken where the file names none."""
TABLE = "linear_interpolation"
"""The model of thrust by a table."""
SPEED_DRIVES = ("zero_order", "first_order", "mechanical_pi")
"""Dynamics of a rotor whose setpoint is an angular velocity [rad/s]."""
FALSE = ("false", "0")
"""What an attribute says that is false."""
DENSITY = 1000.0
"""Density of the water where the scenario does not say [kg/m^3]."""
MAX_LINKS = 1000
"""Most links of a robot."""
TO_FLU = TO_FRD[:3, 0]
"""Signs (3,) that turn vectors of Stonefish (y right, z down) to the layout's frame."""
_VALUE = re.compile(r"\$\{([^{}]{0,500})\}")
"""An expression in an attribute."""
_ARGUMENT = re.compile(r"\$\(\s*(?:arg|param)\s+([\w.-]{1,100})\s*\)")
"""An argument in an attribute, of Stonefish (`arg`) or of its package for ROS (`param`)."""


def is_stonefish(root: Element) -> bool:
    """Whether an XML file is a scenario or a robot of Stonefish."""
    return root.tag == "scenario" or (root.tag == "robot" and root.find("base_link") is not None)


class _Limits(NamedTuple):
    """The thrust of one thruster."""

    force: tuple[float, float] | None
    """Least and most force [N]; None where the file does not say."""
    torque_per_newton: float
    """Reaction torque about its axis over the force [m]."""
    time_constant: float | None
    """[s]; None where it is not a delay of first order."""


@dataclass
class _Robot:
    """The links of a robot in the frame of its base, x forward, y right, z down."""

    poses: dict[str, Array] = field(default_factory=dict)
    """Poses (4, 4) of links by name [m]."""
    joint_of_link: dict[str, Joint] = field(default_factory=dict)
    """Joints by the links that they move."""


def read_stonefish(root: Element, name: str, exchange: Exchange) -> Layout:
    """Returns the layout of a robot of Stonefish.

    Args:
        root: the outermost element: a scenario or a robot.
        name: the layout's name where the robot has none.
        exchange: which robot of several, and where the origin goes; gets the notes.

    Raises:
        LayoutError: there is no robot with thrusters, or a value is missing or no number.
    """
    values = _Values(root)
    robot = _robot_in(root, exchange)
    elements = [
        element for element in robot.findall("actuator") if element.get("type") in THRUSTERS
    ]
    if not elements:
        raise LayoutError(
            "is a robot of Stonefish without an actuator of type thruster, of which layouts are "
            f"made; its actuators: {listed(_shown(robot))}"
        )
    if len(elements) > MAX_ACTUATORS:
        raise LayoutError(f"expected up to {MAX_ACTUATORS} thrusters, got {len(elements)}")
    links = _links(robot, values)
    mass = _mass(robot, links, values) if exchange.origin == "gravity" else None
    origin = np.zeros(3) if mass is None else mass.center * TO_FLU
    density = values.number(root, "environment/ocean/water@density", DENSITY)
    actuators: list[Actuator] = []
    turned_round = []
    for i, element in enumerate(elements):
        thruster_name = _name(element, f"thruster{i + 1}")
        limits = _limits_or_none(element, thruster_name, density, values, exchange)
        actuators.append(_thruster(element, thruster_name, limits, links, origin, values, exchange))
        if _is_turned_round(element):
            turned_round.append(thruster_name)
    if turned_round:
        exchange.note(
            f"A positive setpoint of {listed(turned_round)} pushes backwards, by a left-handed "
            "propeller or an inverted setpoint: forces are those of the layout, along its axis."
        )
    others = [element for element in robot.findall("actuator") if element not in elements]
    if others:
        exchange.note(f"Other actuators are left out: {listed(_shown(robot, others))}.")
    robot_name = _name(robot, name)
    exchange.note(
        f"Robot {robot_name} of Stonefish was read, x forward, y right, z down, in m, kg and N."
    )
    if mass is not None:
        body = Body(mass_kg=mass.mass)
        return Layout(robot_name, tuple(actuators), "Origin at the centre of gravity.", body)
    if exchange.origin == "gravity":
        exchange.note(
            "Masses are those of materials and meshes, which are not computed: the origin is that "
            "of the base link",
            "where the centre of gravity lies elsewhere, correct `position_m`",
            field="position",
        )
    return Layout(robot_name, tuple(actuators), "Origin at the frame of its base link.")


def _name(element: Element, default: str) -> str:
    """The name of a robot or an actuator, without the arguments in it."""
    return _ARGUMENT.sub("", element.get("name", "")).strip("/_ \t\n")[:64].strip() or default


def _is_turned_round(element: Element) -> bool:
    """Whether a positive setpoint of a thruster pushes backwards."""
    is_left = text_at(element, "propeller@right", "true").lower() in FALSE
    return (is_left and element.get("type") != SIMPLE) != _is_inverted(element)


def _is_inverted(element: Element) -> bool:
    """Whether the setpoint of a thruster has the other sign."""
    inverted = text_at(element, "specs@inverted_setpoint specs@inverted", "false").lower()
    return inverted not in FALSE


class _Values:
    """Numbers in attributes, with arithmetic and the arguments that the file gives."""

    def __init__(self, root: Element) -> None:
        """Reads the arguments: <arg name= value=> (or default=)."""
        self._arguments: dict[str, str] = {}
        for element in root.iter("arg"):
            value = element.get("value", element.get("default"))
            if value is not None:
                self._arguments[element.get("name", "")] = value

    def text(self, text: str, what: str) -> str:
        """Returns a text in which arguments and expressions have their values; `what` goes into the
        error."""

        def argument(match: re.Match[str]) -> str:
            value = self._arguments.get(match[1])
            if value is None or "$" in value:
                raise LayoutError(
                    f"{what} has {match[0]}, whose value this file of Stonefish does not say"
                )
            return value

        def value(match: re.Match[str]) -> str:
            return str(evaluate(match[1], _no_names, _no_names))

        return _VALUE.sub(value, _ARGUMENT.sub(argument, text)) if "$" in text else text

    def number(self, element: Element, paths: str, default: float = math.nan) -> float:
        """Returns the number at one of some paths, as `description.number`."""
        text = text_at(element, paths)
        if not text:
            return default
        what = f"{paths} of {element.tag} {element.get('name', '')!r:.60}"
        return float(numbers(self.text(text, what), 1, what)[0])

    def pose(self, element: Element | None) -> Array:
        """Returns the pose (4, 4) in an <origin> or the like; that of its parent where there is
        none."""
        pose = np.eye(4)
        if element is not None:
            what = f"<{element.tag}>"
            place = self.text(element.get("xyz", "0 0 0"), what)
            angles = self.text(element.get("rpy", "0 0 0"), what)
            pose[:3, 3] = numbers(place, 3, f"xyz of {what}")
            turns = numbers(angles, 3, f"rpy of {what}")
            pose[:3, :3] = Rotation.from_euler("xyz", turns).as_matrix()
        return pose


def _no_names(name: str) -> float:
    """What an expression's name stands for: there are none."""
    raise KeyError(name)


def _robot_in(root: Element, exchange: Exchange) -> Element:
    """The robot that the user names, or the first with thrusters."""
    robots = [root] if root.tag == "robot" else root.findall("robot")
    names = [robot.get("name", "") for robot in robots]
    if exchange.model is not None:
        if exchange.model not in names:
            raise LayoutError(f"has no robot {exchange.model!r:.60}; it has {listed(names)}")
        return robots[names.index(exchange.model)]
    if not robots:
        included = [element.get("file", "") for element in root.iter("include")]
        shown = listed([file.rpartition("/")[2][:60] for file in included])
        where = f"; it includes {shown}, which are not opened: give the robot's" if included else ""
        raise LayoutError(f"is a scenario of Stonefish without a <robot>{where}")
    able = [
        robot
        for robot in robots
        if any(actuator.get("type") in THRUSTERS for actuator in robot.findall("actuator"))
    ]
    robot, *unread = able or robots
    if unread:
        others = listed([other.get("name", "") for other in unread])
        names = [element.get("name", "") for element in (robot, *unread)]
        exchange.note(
            f"It holds other robots: {others}",
            "--model NAME for one of them",
            question=which_robot(names),
        )
    return robot


def _shown(robot: Element, elements: list[Element] | None = None) -> list[str]:
    """Actuators of a robot with their types."""
    shown = robot.findall("actuator") if elements is None else elements
    return [f"{element.get('name', '')} ({element.get('type', '')})"[:80] for element in shown]


def _links(robot: Element, values: _Values) -> _Robot:
    """Poses of a robot's links by its joints."""
    base = robot.find("base_link")
    base_name = "" if base is None else base.get("name", "")
    links = _Robot({base_name: np.eye(4)})
    joints = robot.findall("joint")
    if len(joints) > MAX_LINKS:
        raise LayoutError(f"has more than {MAX_LINKS} joints; make it smaller")
    children: dict[str, list[Element]] = {}
    for joint in joints:
        children.setdefault(text_at(joint, "parent@name"), []).append(joint)
    pending = [base_name]
    while pending:
        parent = pending.pop()
        for joint in children.get(parent, []):
            child = text_at(joint, "child@name")
            if child in links.poses:
                raise LayoutError(f"link {child!r:.60} hangs on itself, or on two joints")
            pose = links.poses[parent] @ values.pose(joint.find("origin"))
            links.poses[child] = pose
            links.joint_of_link[child] = _joint(joint, parent, child, pose, values)
            pending.append(child)
    return links


def _joint(element: Element, parent: str, child: str, pose: Array, values: _Values) -> Joint:
    """A joint, in the frame of the layout's axes."""
    what = f"joint {element.get('name', '')!r:.60}"
    axis_text = values.text(text_at(element, "axis@xyz", "0 0 1"), what)
    axis = pose[:3, :3] @ numbers(axis_text, 3, f"axis of {what}")
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        raise LayoutError(f"{what} has an axis without length")
    # Half a turn about x takes one frame into the other, and leaves angles as they are.
    return Joint(
        name=element.get("name", ""),
        kind=element.get("type", ""),
        parent=parent,
        child=child,
        position=pose[:3, 3] * TO_FLU,
        axis=axis / length * TO_FLU,
        limits=(
            values.number(element, "limits@min", -math.inf),
            values.number(element, "limits@max", math.inf),
        ),
    )


def _limits_or_none(
    element: Element, name: str, density: float, values: _Values, exchange: Exchange
) -> _Limits:
    """The thrust of a thruster, without limits where the file leaves them open."""
    try:
        return _limits(element, density, values)
    except LayoutError as error:
        exchange.note(f"Limits of {name} are not read: {error.problem}.")
        return _Limits(None, 0.0, None)


def _thruster(
    element: Element,
    name: str,
    limits: _Limits,
    links: _Robot,
    origin: Array,
    values: _Values,
    exchange: Exchange,
) -> Actuator:
    """The thruster of an actuator; `origin` (3,) is the layout's, in its axes [m]."""
    link = text_at(element, "link@name")
    if link not in links.poses:
        raise LayoutError(f"thruster {name!r:.60} is on link {link!r:.60}, which is not there")
    pose = links.poses[link] @ values.pose(element.find("origin"))
    thruster = exchange.thruster(
        name,
        pose[:3, 3] * TO_FLU - origin,
        pose[:3, 0] * TO_FLU,
        limits.force,
        limits.torque_per_newton,
    )
    if limits.time_constant is not None:
        thruster = replace(thruster, time_constant=limits.time_constant)
    mount = links.joint_of_link.get(link)
    if mount is not None:
        above = links.joint_of_link.get(mount.parent)
        if above is not None and above.kind in TURNING and mount.kind in TURNING:
            exchange.note(f"{name} turns about {mount.name} alone: {above.name} is left at 0.")
    return on_mount(thruster, mount, origin, exchange)


def _limits(element: Element, density: float, values: _Values) -> _Limits:
    """The thrust of a thruster by its model."""
    lower = values.number(element, "specs@lower_thrust_limit")
    upper = values.number(element, "specs@upper_thrust_limit")
    kind = text_at(element, "thrust_model@type", FLUID)
    is_right = text_at(element, "propeller@right", "true").lower() not in FALSE
    torque_per_newton = 0.0
    if element.get("type") == SIMPLE or math.isfinite(upper):
        least, most = (-upper, -lower) if _is_inverted(element) else (lower, upper)
    elif kind == TABLE:
        least, most = _forces_of_table(element, values)
    elif kind == FLUID:
        least, most = _forces_of_propeller(element, density, values)
        torque_per_newton = _torque_per_newton(element, values) * (-1.0 if is_right else 1.0)
    else:
        least, most = _forces_of_square(element, values)
    if kind != FLUID and not is_right and element.get("type") != SIMPLE:
        least, most = -most, -least  # there a left-handed propeller turns the force itself round
    force = None
    if math.isfinite(least) and math.isfinite(most) and least <= 0.0 <= most and least < most:
        force = (least, most)
    time_constant = None
    if text_at(element, "rotor_dynamics@type") == "first_order":
        time_constant = values.number(element, "rotor_dynamics/time_constant@value")
    return _Limits(force, torque_per_newton, time_constant)


def _fastest(element: Element, values: _Values) -> float:
    """The largest angular velocity of a thruster [rad/s]; NaN where its setpoint is a torque or a
    voltage, or nothing is said."""
    if text_at(element, "specs@max_rpm"):
        return values.number(element, "specs@max_rpm") / 60.0 * 2.0 * math.pi
    if text_at(element, "rotor_dynamics@type", SPEED_DRIVES[0]) not in SPEED_DRIVES:
        return math.nan
    return values.number(element, "specs@max_setpoint")


def _coefficients(element: Element, values: _Values) -> tuple[float, float]:
    """The thrust coefficients ahead and astern."""
    path = "thrust_model/thrust_coeff"
    ahead = values.number(element, f"{path}@forward {path}@value specs@thrust_coeff")
    astern = values.number(element, f"{path}@reverse specs@thrust_coeff_backward", ahead)
    return ahead, astern


def _forces_of_propeller(element: Element, density: float, values: _Values) -> tuple[float, float]:
    """Least and most force F = C rho D^4 n |n| at the largest n in revolutions per second [N]."""
    n = _fastest(element, values) / (2.0 * math.pi)
    diameter = values.number(element, "propeller@diameter")
    ahead, astern = _coefficients(element, values)
    per_coefficient = density * diameter**4 * n * n
    return -astern * per_coefficient, ahead * per_coefficient


def _torque_per_newton(element: Element, values: _Values) -> float:
    """The size of the reaction torque Q = C_Q rho D^5 n |n| over the force ahead [m]."""
    torque = values.number(element, "thrust_model/torque_coeff@value specs@torque_coeff", 0.0)
    ahead, _ = _coefficients(element, values)
    diameter = values.number(element, "propeller@diameter")
    ratio = diameter * torque / ahead if ahead else 0.0
    return ratio if math.isfinite(ratio) else 0.0


def _forces_of_square(element: Element, values: _Values) -> tuple[float, float]:
    """Least and most force by the square of the angular velocity, less a dead band [N]."""
    square = _fastest(element, values) ** 2
    ahead, astern = _coefficients(element, values)
    below = abs(values.number(element, "thrust_model/deadband@lower", 0.0))
    above = abs(values.number(element, "thrust_model/deadband@upper", 0.0))
    return -astern * (square - below), ahead * (square - above)


def _forces_of_table(element: Element, values: _Values) -> tuple[float, float]:
    """Least and most force of a table at the largest angular velocity either way [N]; NaN where
    there is none."""
    columns = []
    for column in ("input", "output"):
        text = text_at(element, f"thrust_model/{column}@value")
        columns.append(numbers(text, max(1, len(text.split())), f"{column} of a table of thrust"))
    speeds, forces = columns
    if len(speeds) != len(forces) or (np.diff(speeds) <= 0.0).any():
        raise LayoutError("the table of thrust has other inputs than outputs, or none that rise")
    fastest = _fastest(element, values)
    if not math.isfinite(fastest):
        return float(forces.min()), float(forces.max())
    least, most = np.interp([-fastest, fastest], speeds, forces)
    return float(least), float(most)


def _mass(robot: Element, links: _Robot, values: _Values) -> LinkMass | None:
    """The mass of a robot whose solids all have a size and a mass; None of another."""
    masses = []
    for link in (*robot.findall("base_link"), *robot.findall("link")):
        pose = links.poses.get(link.get("name", ""))
        if pose is None:
            return None
        parts = [*link.findall("external_part"), *link.findall("internal_part")]
        for solid in parts or [link]:
            mass = values.number(solid, "mass@value")
            if not math.isfinite(mass) or solid.find("dimensions") is None:
                return None
            place = pose @ values.pose(solid.find("compound_transform"))
            place = place @ values.pose(solid.find("origin"))
            masses.append(LinkMass(mass, place[:3, 3], np.zeros((3, 3))))
    total = combined(masses)
    return total if total.mass > 0.0 else None
