"""Parameters of autopilots by name, and PX4's geometry of rotors among them, CA_*.

Scripts of PX4, lists of Mission Planner, MAVProxy and QGroundControl are read. Rotor i of PX4, in x
forward, y right, z down, gives the force CT a u and the torque CT (p x a - KM a) u for an output u
of 0 to 1, or -1 to 1 where CA_R_REV says that it reverses (PX4, ActuatorEffectivenessRotors).
"""

import math
import re

import numpy as np

from finlab.errors import LayoutError
from finlab.exchange.exchange import TO_FRD, Exchange
from finlab.exchange.matrix_table import is_number
from finlab.layout import Layout, Thruster

LONGEST = 500
"""Most characters of a line that are looked at."""
_NAME = re.compile(r"[A-Z][A-Z0-9]*_\w+\Z")
_ASKING = {"compare", "greater", "show", "echo", "if", "reset", "touch"}
"""Words of a script before a name that sets nothing."""
MAX_ROTORS = 12
FRD = TO_FRD[:3, 0]
USUAL = {"PX": 0.0, "PY": 0.0, "PZ": 0.0, "AX": 0.0, "AY": 0.0, "AZ": -1.0, "CT": 6.5, "KM": 0.05}
"""Keys of a rotor, and their defaults."""


def read_parameters(text: str, wanted: str) -> dict[str, float]:
    """Returns parameters by name, of lines `param set-default NAME VALUE`, `NAME VALUE`,
    `NAME,VALUE` and `1 1 NAME VALUE TYPE`. What follows # is a comment; the last value counts.
    Raises LayoutError: a name that begins with one of the words in `wanted` has no number behind
    it."""
    values: dict[str, float] = {}
    for number, line in enumerate(text.splitlines(), 1):
        cells = re.split(r"[\s,=]+", line[:LONGEST].partition("#")[0].strip())
        place = next((i for i, cell in enumerate(cells) if _NAME.match(cell)), None)
        if place is None or _ASKING & {*cells[:place]}:
            continue
        name = cells[place]
        value = (cells[place + 1 : place + 2] or [""])[0]
        if is_number(value) and abs(float(value)) < 1e9:
            values[name] = float(value)
        elif name.startswith(tuple(wanted.split())):
            raise LayoutError(
                f"line {number}: {name} is {value!r:.40}, expected a number of ordinary size"
            )
    return values


def read_px4(text: str, name: str, exchange: Exchange) -> Layout:
    """Returns the layout, called `name`, of the rotors in a parameter file or airframe script.
    Raises LayoutError: it has no rotors, or one without direction or force; a value is no
    number."""
    values = read_parameters(text, "CA_")
    count = int(values.get("CA_ROTOR_COUNT", 0))
    if not 0 < count <= MAX_ROTORS:
        raise LayoutError(f"expected 1 to {MAX_ROTORS} rotors, got {count}", "CA_ROTOR_COUNT")
    if "CA_R_REV" not in values:
        exchange.note("CA_R_REV is not in it: all rotors are taken to reverse.")
    reversing = int(values.get("CA_R_REV", 2**count - 1))
    if values.get("CA_SV_CS_COUNT", 0.0) or values.get("CA_SV_TL_COUNT", 0.0):
        exchange.note(
            "Its surfaces and tilting servos (CA_SV_*) are left out: they hold no forces."
        )
    for key, usual in USUAL.items():
        if lacking := [str(i) for i in range(count) if f"CA_ROTOR{i}_{key}" not in values]:
            which = ", ".join(lacking) if len(lacking) < count else "all"
            exchange.note(
                f"No CA_ROTORi_{key} of rotors {which}: {usual:g} is taken, the default of PX4."
            )
    rotors = {key: own for key in values if (own := re.match(r"CA_ROTOR(\d{1,3})_(\w+)", key))}
    if beyond := sorted(
        key
        for key, own in rotors.items()
        if int(own[1]) >= count
        and not math.isclose(values[key], USUAL.get(own[2], 0.0), rel_tol=1e-6)
    ):
        exchange.note(f"CA_ROTOR_COUNT is {count}; not read: {', '.join(beyond[:12])}.")
    if exchange.force is None:
        exchange.note(
            "CA_ROTORi_CT is taken for the newtons at full output; correct `force_n` if not."
        )
    parts = []
    for i in range(count):
        *vectors, size, km = (
            values.get(f"CA_ROTOR{i}_{key}", usual) for key, usual in USUAL.items()
        )
        place, axis = np.reshape(vectors, (2, 3)) * FRD
        length = float(np.linalg.norm(axis))
        if size == 0.0 or length == 0.0:
            raise LayoutError("has no direction or no force", f"CA_ROTOR{i}")
        force = (-abs(size) if reversing >> i & 1 else 0.0, abs(size))
        axis *= math.copysign(1.0 / length, size)
        parts.append(exchange.thruster(f"rotor{i + 1}", place, axis, force, -km))
    return Layout(name, tuple(parts))


def write_px4(layout: Layout, exchange: Exchange, suffix: str) -> str:
    """Returns a layout's thrusters as lines of an airframe script, for `.params` as a list of
    QGroundControl. Raises LayoutError: there is no thruster, or there are too many."""
    parts = [
        part
        for part in exchange.thrusters_of(layout, "PX4").actuators
        if isinstance(part, Thruster)
    ]
    if len(parts) > MAX_ROTORS:
        raise LayoutError(
            f"PX4 takes up to {MAX_ROTORS} rotors, layout {layout.name} has {len(parts)}"
        )
    reversing = sum(1 << i for i, part in enumerate(parts) if part.force[0] < 0.0 < part.force[1])
    values: dict[str, float] = {
        "CA_AIRFRAME": 7,
        "CA_ROTOR_COUNT": len(parts),
        "CA_R_REV": reversing,
    }
    for i, part in enumerate(parts):
        least, most = part.force
        if least < 0.0 < most and -least != most:
            exchange.note(
                f"PX4 has one size for both ways: {most:g} N stands for {least:g} N, too."
            )
        if most == 0.0:
            exchange.note(
                f"{part.name} pushes against its axis alone; its rotor has the axis reversed."
            )
        axis = np.array(part.axis) * FRD * (1.0 if most > 0.0 else -1.0) + 0.0
        own = [
            *(np.array(part.position) * FRD + 0.0),
            *axis,
            most or -least,
            -part.torque_per_newton + 0.0,
        ]
        values |= {
            f"CA_ROTOR{i}_{key}": float(value) for key, value in zip(USUAL, own, strict=True)
        }
    lines = [f"# motor {i}: {part.name}" for i, part in enumerate(parts, 1)]
    for key, value in values.items():
        kind = 6 if isinstance(value, int) else 9  # of MAVLink: 32 bits, whole or not
        listed = f"1\t1\t{key}\t{value!r}\t{kind}"
        lines.append(listed if suffix == ".params" else f"param set-default {key} {value!r}")
    return "\n".join(lines) + "\n"
