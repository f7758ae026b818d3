"""Robots in scenarios of Stonefish: thrusters on links, in x forward, y right, z down.

A thruster pushes along x of its own frame; forces come from its model of thrust at its largest setpoint.
"""

import math
import re
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange.arithmetic import value_of
from finlab.exchange.exchange import TO_FRD, Exchange
from finlab.layout import MAX_ACTUATORS, Layout, Thruster

MAX_JOINTS = 1000
"""Most joints of a link that are read."""
DENSITY = 1000.0
"""Of the water where the scenario does not say [kg/m^3]."""


def read_stonefish(root: Element, name: str, exchange: Exchange) -> Layout:
    """Returns the layout of the thrusters of a robot in a scenario, seen from its base link.

    Raises:
        LayoutError: there is no robot, or none with thrusters; a value is no number.
    """
    robots = [
        robot
        for robot in root.iter("robot")
        if any("thruster" in part.get("type", "") for part in robot.iter())
    ]
    files = ", ".join(each.get("file", "") for each in root.iter("include"))[:300]
    named = [robot for robot in robots if exchange.model in (None, robot.get("name"))]
    if not named:
        where = f"; it includes {files}, which is not opened" if files else ""
        what = (
            f"no robot {exchange.model!r:.60}"
            if exchange.model
            else "no robot with actuators of type thruster"
        )
        raise LayoutError(f"is a scenario of Stonefish with {what}{where}")
    robot, constants = named[0], {each.get("name", ""): each.get("default", "") for each in root.iter("arg")}
    others = [each.get("name", "") for each in robots if each is not robot]
    if others:
        exchange.note(
            f"{robot.get('name')} was read; it holds other robots: {', '.join(others)[:300]} (--model NAME)."
        )
    if files:
        exchange.note(f"What it includes is not read: {files}.")
    poses, parts = _poses(robot, constants), list[Thruster]()
    for part in robot.iter("actuator"):
        kind, link = part.get("type", ""), _of(part, "link").get("name", "")
        if kind not in ("thruster", "simple_thruster", "push"):
            exchange.note(f"Actuators of type {kind!r:.40} are not read.")
        elif link not in poses:
            raise LayoutError(
                f"thruster {part.get('name')!r:.60} sits on link {link!r:.60}, which hangs on no other"
            )
        elif len(parts) == MAX_ACTUATORS:
            raise LayoutError(f"holds more than {MAX_ACTUATORS} thrusters")
        else:
            pose, sign = poses[link] @ _pose(part, constants), TO_FRD[:3, 0]
            force = _force(part, constants, root, exchange)
            parts.append(
                exchange.thruster(part.get("name", "thruster"), pose[:3, 3] * sign, pose[:3, 0] * sign, force)
            )
    exchange.note("A scenario of Stonefish, x forward, y right, z down; the origin is that of the base link.")
    exchange.note("Its masses and shapes are not read, so its centre of gravity and water are unknown.")
    return Layout(robot.get("name") or name, tuple(parts))


def _poses(robot: Element, constants: dict[str, str]) -> dict[str, Array]:
    """Poses (4, 4) of links by name: the base link's, and those that joints hang on it."""
    base = robot.find("base_link")
    poses = {"" if base is None else base.get("name", ""): np.eye(4)}
    below: dict[str, list[Element]] = {}
    for joint in robot.iter("joint"):
        below.setdefault(_of(joint, "parent").get("name", ""), []).append(joint)
    waiting = [*poses]
    while waiting:
        parent = waiting.pop()
        for joint in below.pop(parent, [])[:MAX_JOINTS]:
            child = _of(joint, "child").get("name", "")
            poses[child] = poses[parent] @ _pose(joint, constants)
            waiting.append(child)
    return poses


def _of(part: Element, tag: str) -> Element:
    found = part.find(tag)
    return Element(tag) if found is None else found


def _pose(part: Element, constants: dict[str, str]) -> Array:
    pose, origin = np.eye(4), _of(part, "origin")
    place, turn = (
        [_number(each, constants) for each in _cells(origin.get(key, "0 0 0"))] for key in ("xyz", "rpy")
    )
    if len(place) != 3 or len(turn) != 3:
        raise LayoutError(f"the origin of {part.get('name')!r:.60} is not 3 numbers and 3 angles")
    pose[:3, 3], pose[:3, :3] = place, Rotation.from_euler("xyz", turn).as_matrix()
    return pose


def _cells(text: str) -> list[str]:
    """Values with blanks between them, which may be `${...}` or `$(arg ...)` with blanks inside."""
    return re.findall(r"(?:\$\{[^}]*\}|\$\([^)]*\)|\S)+", text[:500])


def _number(text: str, constants: dict[str, str]) -> float:
    argument = re.compile(r"\$\(arg\s+(\w+)\)")
    plain = argument.sub(lambda found: f"({constants.get(found[1], found[1])})", text[:200])
    try:
        return value_of(plain.replace("${", "(").replace("}", ")"), {})
    except ValueError as error:
        raise LayoutError(f"{text!r:.60}: {error}") from None


def _force(
    part: Element, constants: dict[str, str], root: Element, exchange: Exchange
) -> tuple[float, float] | None:
    """Least and most force [N]; None where the model of thrust is not known."""

    def told(path: str, *keys: str) -> float | None:
        found = part.find(path)
        text = next((found.get(key) for key in keys if found is not None and found.get(key)), None)
        return None if text is None else _number(text, constants)

    if part.get("type") != "thruster":
        ends = [told("limits", key) or told("specs", f"{key}_limit") for key in ("lower", "upper")]
        return None if ends[0] is None or ends[1] is None else (ends[0], ends[1])
    model, size = _of(part, "thrust_model").get("type", ""), told("propeller", "diameter")
    rpm, speed = told("specs", "max_rpm"), told("specs", "max_setpoint")
    speed = speed if rpm is None else rpm * math.pi / 30
    ahead, back = (
        told("thrust_model/thrust_coeff", key, "value") or told("specs", f"thrust_coeff{old}", "thrust_coeff")
        for key, old in (("forward", ""), ("reverse", "_backward"))
    )
    spins = model == "fluid_dynamics" or (rpm is not None and not model)
    if speed is None or ahead is None or back is None or not (model == "quadratic" or (spins and size)):
        exchange.note(f"Force of {part.get('name')} is not read: thrust model {model or 'none'!r:.40}.")
        return None
    gain = speed**2
    if spins and size:
        water = next((each.get("density", "") for each in root.iter("water") if each.get("density")), "")
        density = _number(water, constants) if water else DENSITY
        gain = density * (speed / (2 * math.pi)) ** 2 * size**4
        exchange.note(f"Forces are those of fluid_dynamics at the largest setpoint, in {density:g} kg/m^3.")
    return -abs(back) * gain, abs(ahead) * gain
