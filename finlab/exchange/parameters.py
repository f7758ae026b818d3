"""Reads parameters of autopilots by name, and reads and writes PX4's geometry of rotors (CA_*).

Scripts of PX4, lists of Mission Planner, MAVProxy and QGroundControl are read. Rotor i of PX4, in x
forward, y right, z down, gives the force CT a u and the torque CT (p x a - KM a) u for an output u
of 0 to 1, or -1 to 1 where CA_R_REV says that it reverses (PX4, ActuatorEffectivenessRotors).
"""

import math
import re
from collections.abc import Mapping

import numpy as np

from finlab.errors import LayoutError
from finlab.exchange.exchange import TO_FRD, Exchange, thrusters_in
from finlab.exchange.matrix_table import is_number
from finlab.layout import Layout

MAX_LINE_LENGTH = 500
"""Most characters of a line that are parsed."""
_NAME = re.compile(r"[A-Z][A-Z0-9]*_\w+\Z")
"""The name of a parameter."""
_COMMANDS_WITHOUT_VALUE = {"compare", "greater", "show", "echo", "if", "reset", "touch"}
"""Words of a script before a name that they do not set."""
MAX_ROTORS = 12
"""Most rotors of PX4."""
FRD = TO_FRD[:3, 0]
"""Signs (3,) that turn vectors from FLU to PX4's frame, and back."""
ROTOR_DEFAULTS = {
    "PX": 0.0,
    "PY": 0.0,
    "PZ": 0.0,
    "AX": 0.0,
    "AY": 0.0,
    "AZ": -1.0,
    "CT": 6.5,
    "KM": 0.05,
}
"""Keys of a rotor and PX4's defaults: position [m], axis, CT [N] and KM [m]."""
ROTOR_FIELDS = {"P": "position", "A": "axis", "C": "force", "K": "torque_per_newton"}
"""First letter of a rotor's key -> the thruster's field that it fills."""
MAV_PARAM_TYPE_INT32 = 6
"""MAVLink's type of a parameter that is an integer of 32 bits."""
MAV_PARAM_TYPE_REAL32 = 9
"""MAVLink's type of a parameter that is a float of 32 bits."""


def read_parameters(text: str, prefixes: str) -> dict[str, float]:
    """Returns the parameters in a list or script by name; of several values the last one counts.

    Lines are `param set-default NAME VALUE`, `NAME VALUE`, `NAME,VALUE` or `1 1 NAME VALUE TYPE`;
    what follows # is a comment.

    Args:
        text: the list or script.
        prefixes: beginnings of names, with blanks between, whose value must be a number; others are
            left out where it is none.

    Raises:
        LayoutError: a parameter with such a name has no number behind it.
    """
    values: dict[str, float] = {}
    for line_number, line in enumerate(text.splitlines(), 1):
        cells = re.split(r"[\s,=]+", line[:MAX_LINE_LENGTH].partition("#")[0].strip())
        index = next((i for i, cell in enumerate(cells) if _NAME.match(cell)), None)
        if index is None or _COMMANDS_WITHOUT_VALUE & {*cells[:index]}:
            continue
        name = cells[index]
        value = cells[index + 1] if index + 1 < len(cells) else ""
        if is_number(value) and abs(float(value)) < 1e9:
            values[name] = float(value)
        elif name.startswith(tuple(prefixes.split())):
            raise LayoutError(
                f"line {line_number}: {name} is {value!r:.40}, expected a number of ordinary size"
            )
    return values


def read_px4(text: str, name: str, exchange: Exchange) -> Layout:
    """Returns the layout of the rotors in a parameter file or airframe script of PX4.

    Args:
        text: the file or script.
        name: the layout's name.
        exchange: force of all thrusters where the user gives one; gets the notes.

    Raises:
        LayoutError: it has no rotors, or one without direction or force; a value is no number.
    """
    values = read_parameters(text, "CA_")
    count = int(values.get("CA_ROTOR_COUNT", 0))
    if not 0 < count <= MAX_ROTORS:
        raise LayoutError(f"expected 1 to {MAX_ROTORS} rotors, got {count}", "CA_ROTOR_COUNT")
    if "CA_R_REV" not in values:
        exchange.note("CA_R_REV is not in it: all rotors are taken to reverse.", field="force")
    reversing = int(values.get("CA_R_REV", 2**count - 1))
    if values.get("CA_SV_CS_COUNT", 0.0) or values.get("CA_SV_TL_COUNT", 0.0):
        exchange.note(
            "Its surfaces and tilting servos (CA_SV_*) are left out: they hold no forces."
        )
    for key, default in ROTOR_DEFAULTS.items():
        without = [str(i) for i in range(count) if f"CA_ROTOR{i}_{key}" not in values]
        if without:
            rotors = ", ".join(without) if len(without) < count else "all"
            exchange.note(
                f"No CA_ROTORi_{key} of rotors {rotors}: {default:g} is taken, the default of PX4.",
                field=ROTOR_FIELDS[key[0]],
                actuators=[f"rotor{int(i) + 1}" for i in without],
            )
    unread = _values_beyond(values, count)
    if unread:
        exchange.note(f"CA_ROTOR_COUNT is {count}; not read: {', '.join(unread[:12])}.")
    if exchange.force is None:
        exchange.note(
            "CA_ROTORi_CT is taken for the newtons at full output",
            "correct `force_n` if not",
            field="force",
        )
    thrusters = []
    for i in range(count):
        rotor = {
            key: values.get(f"CA_ROTOR{i}_{key}", default)
            for key, default in ROTOR_DEFAULTS.items()
        }
        position = np.array([rotor["PX"], rotor["PY"], rotor["PZ"]]) * FRD
        axis = np.array([rotor["AX"], rotor["AY"], rotor["AZ"]]) * FRD
        thrust = rotor["CT"]  # [N]; a negative one pushes against the axis
        length = float(np.linalg.norm(axis))
        if thrust == 0.0 or length == 0.0:
            raise LayoutError("has no direction or no force", f"CA_ROTOR{i}")
        is_reversible = reversing >> i & 1
        force = (-abs(thrust) if is_reversible else 0.0, abs(thrust))
        axis *= math.copysign(1.0 / length, thrust)
        thrusters.append(exchange.thruster(f"rotor{i + 1}", position, axis, force, -rotor["KM"]))
    return Layout(name, tuple(thrusters))


def _values_beyond(values: Mapping[str, float], count: int) -> list[str]:
    """Parameters of rotors beyond CA_ROTOR_COUNT that differ from PX4's defaults, in order."""
    keys = []
    for key, value in values.items():
        match = re.match(r"CA_ROTOR(\d{1,3})_(\w+)", key)
        if match and int(match[1]) >= count:
            default = ROTOR_DEFAULTS.get(match[2], 0.0)
            if not math.isclose(value, default, rel_tol=1e-6):
                keys.append(key)
    return sorted(keys)


def write_px4(layout: Layout, exchange: Exchange, suffix: str) -> str:
    """Returns a layout's thrusters as parameters of PX4.

    Args:
        layout: the layout to write.
        exchange: gets notes on what PX4 cannot hold.
        suffix: `.params` for a list of QGroundControl; lines of an airframe script for all others.

    Raises:
        LayoutError: there is no thruster, or there are too many.
    """
    thrusters = thrusters_in(exchange.thrusters_of(layout, "PX4"))
    if len(thrusters) > MAX_ROTORS:
        raise LayoutError(
            f"PX4 takes up to {MAX_ROTORS} rotors, layout {layout.name} has {len(thrusters)}"
        )
    reversing = 0  # a bit for each rotor
    for i, thruster in enumerate(thrusters):
        if thruster.force[0] < 0.0 < thruster.force[1]:
            reversing |= 1 << i
    values: dict[str, float] = {
        "CA_AIRFRAME": 7,
        "CA_ROTOR_COUNT": len(thrusters),
        "CA_R_REV": reversing,
    }
    for i, thruster in enumerate(thrusters):
        low, high = thruster.force
        if low < 0.0 < high and -low != high:
            exchange.note(f"PX4 has one size for both ways: {high:g} N stands for {low:g} N, too.")
        if high == 0.0:
            exchange.note(
                f"{thruster.name} pushes against its axis alone; its rotor has the axis reversed."
            )
        forward = 1.0 if high > 0.0 else -1.0
        position = np.array(thruster.position) * FRD + 0.0  # + 0.0 makes -0.0 to 0.0
        axis = np.array(thruster.axis) * FRD * forward + 0.0
        thrust = high or -low
        rotor = [*position, *axis, thrust, -thruster.torque_per_newton + 0.0]
        for key, value in zip(ROTOR_DEFAULTS, rotor, strict=True):
            values[f"CA_ROTOR{i}_{key}"] = float(value)
    lines = [f"# motor {i}: {thruster.name}" for i, thruster in enumerate(thrusters, 1)]
    for key, value in values.items():
        if suffix == ".params":
            kind = MAV_PARAM_TYPE_INT32 if isinstance(value, int) else MAV_PARAM_TYPE_REAL32
            lines.append(f"1\t1\t{key}\t{value!r}\t{kind}")
        else:
            lines.append(f"param set-default {key} {value!r}")
    return "\n".join(lines) + "\n"
