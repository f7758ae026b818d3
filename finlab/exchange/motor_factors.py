"""Motor factors of ArduSub, roll, pitch, yaw, throttle, forward and lateral: frames, calls and
tables.

Factors hold directions of forces and signs of torques, no lengths and no newtons. Forward, right
and up are positive, and so are roll to the right, pitch up and yaw clockwise seen from above
(ArduSub, `AP_Motors6DOF::setup_motors`, commit of 2026). Calls are in C++ and Lua, with simple
arithmetic.
"""

import ast
import math
import re
from collections.abc import Mapping
from contextlib import suppress
from itertools import islice

import numpy as np

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange import labels
from finlab.exchange.exchange import Exchange
from finlab.exchange.labels import lookup, plain
from finlab.exchange.matrix_table import FACTORS, Table, records_of
from finlab.exchange.parameters import read_parameters
from finlab.layout import MAX_ACTUATORS, Layout, own_effectiveness

AXES = ("Tx", "Ty", "Tz", "Fz", "Fx", "Fy")
"""Axis of the body frame (x forward, y left, z up) for each column."""
SIGNS = np.array([1.0, -1.0, -1.0, 1.0, 1.0, -1.0])
"""Sign of that axis for a positive factor."""
_PLANAR = "0 0 1 0 -1 1, 0 0 -1 0 -1 -1, 0 0 -1 0 1 1, 0 0 1 0 1 -1, "
_SIMPLE = "0 0 -1 0 1 0, 0 0 1 0 1 0, "
_TWO = "1 0 0 -1 0 0, -1 0 0 -1 0 0"
_FRAMES = {
    "BLUEROV1": f"{_SIMPLE} -0.5 0.5 0 0.45 0 0, 0.5 0.5 0 0.45 0 0, 0 -1 0 1 0 0, -0.25 0 0 0 0 1",
    "VECTORED": _PLANAR + _TWO,
    "VECTORED_6DOF": f"{_PLANAR} 1 -1 0 -1 0 0, -1 -1 0 -1 0 0, 1 1 0 -1 0 0, -1 1 0 -1 0 0",
    "VECTORED_6DOF_90DEG": "1 1 0 1 0 0, 0 0 1 0 1 0, 1 -1 0 1 0 0, 0 0 0 0 0 1, "
    "0 0 0 0 0 1, -1 1 0 1 0 0, 0 0 -1 0 1 0, -1 -1 0 1 0 0",
    "SIMPLEROV_3": f"{_SIMPLE} 0 0 0 -1 0 0",
    "SIMPLEROV_4": _SIMPLE + _TWO,
    "SIMPLEROV_5": f"{_SIMPLE} {_TWO}, 0 0 0 0 0 1",
}
FRAMES: dict[str, Array] = {
    name: np.array([row.split() for row in rows.split(",")], np.float64)
    for name, rows in _FRAMES.items()
}
"""Name of a frame -> factors (n, 6), in the order of FRAME_CONFIG."""
ARM = 0.2
"""Arm of a factor of 1 [m]; the file has none."""
ORDER = [AXES.index(axis) for axis in ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")]
"""Columns of factors in the order of a wrench."""
OF_ARDUPILOT = re.compile(
    r"^[ \t\d]{0,20}(?:FRAME_C(?:ONFIG|LASS)|MOT_\w+|SYSID_THISMAV)\b", re.MULTILINE
)
"""A line by which parameters of ArduPilot are known."""
WEAK = 0.1
"""Torques about an axis are none where they stay below this share of those about another one."""
LONGEST = 500
"""Most characters of a call that are looked at."""
_CALL = re.compile(r"\badd_motor\w*[ \t]*\(")
_WHOLE = re.compile(r"(?<![\w.])\d+[ \t]*/[ \t]*\d+(?![\w.])")
_DECLARED = re.compile(r"^\s*(?:const\s+)?(?:float|double|int|u?int8_t|auto)\b")
MOST, MOST_CONSTANTS = 200, 2000
"""Most characters of an expression, and most constants of a program."""
_NAMES = {name: getattr(math, name) for name in ("sin", "cos", "tan", "sqrt", "radians", "pi")}
_NAMES |= {f"{name}f": value for name, value in _NAMES.items()}
_NAMES |= {"rad": math.radians, "abs": abs, "fabsf": abs, "M_PI": math.pi, "PI": math.pi}
_NAMES |= {"M_PI_2": math.pi / 2, "M_PI_4": math.pi / 4}
_NAMES |= {"M_SQRT2": math.sqrt(2), "M_SQRT1_2": math.sqrt(0.5)}
_ALLOWED = (
    *(
        ast.Expression,
        ast.BinOp,
        ast.UnaryOp,
        ast.Add,
        ast.Sub,
        ast.Mult,
        ast.Div,
        ast.USub,
        ast.UAdd,
    ),
    *(ast.Constant, ast.Name, ast.Load, ast.Call),
)
"""What an expression may be made of."""
_WRITTEN = re.compile(
    r"(?<![\w.])(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)[fFlL]\b|std::|math\."
)
_DEFINED = re.compile(
    r"^[ \t]*(?:#[ \t]*define[ \t]+(\w+)[ \t]+(?!\()"
    r"|(?:(?:static|const|constexpr|local|float|double)[ \t]+)+(\w+)[ \t]*=[ \t]*)([^;\n]{1,200})",
    re.MULTILINE,
)
MotorRow = tuple[str, list[float]]
"""A motor and its six factors."""


def of_motors(name: str, rows: list[MotorRow], exchange: Exchange) -> Layout:
    """Returns the layout, called `name`, of motors and their factors. Raises LayoutError: there is
    none, one of them twice, or one that gives no force."""
    names = [motor for motor, _ in rows]
    if not rows:
        raise LayoutError("has no rows of factors, a motor and its six factors in each")
    for i, motor in enumerate(names):
        if motor in names[:i]:
            raise LayoutError(f"adds a motor twice, {motor}; keep the lines of one frame")
    exchange.note(
        f"Factors hold no lengths: one of 1 is taken for an arm of {ARM} m; correct `position_m`."
    )
    columns = (np.array([factors for _, factors in rows]) * SIGNS)[:, ORDER]
    columns[:, 3:] *= ARM * np.linalg.norm(columns[:, :3], axis=1, keepdims=True)
    return Layout(
        name, tuple(exchange.of_column(*each, None) for each in zip(names, columns, strict=True))
    )


def read_parameters_of_ardusub(text: str, name: str, exchange: Exchange) -> Layout:
    """Returns the layout, called `name`, of the frame in a list of parameters.

    MOT_n_DIRECTION -1 turns a motor the other way for the same output, so that it pushes as its
    frame says. Raises LayoutError: FRAME_CONFIG is not in it, or names a frame of one's own; a
    value is no number."""
    values = read_parameters(text, "FRAME_ MOT_1 MOT_2 MOT_3 MOT_4 MOT_5 MOT_6 MOT_7 MOT_8")
    config = values.get("FRAME_CONFIG")
    frames = [*FRAMES]
    if config is None:
        other = " of another vehicle (FRAME_CLASS)" if "FRAME_CLASS" in values else ""
        lacks = "no FRAME_CONFIG, by which ArduSub names the motors of a robot"
        raise LayoutError(f"holds {len(values)} parameters of ArduPilot{other}, but {lacks}")
    if config not in range(len(frames)):
        why = (
            "a frame of one's own, which parameters do not hold; give the script (.lua) or source "
            "with its"
        )
        known = f"finlab knows 0 to 6: {', '.join(frames)}"
        raise LayoutError(f"is {config:g}, {why} motors; {known}", "FRAME_CONFIG")
    frame = frames[int(config)]
    exchange.note(f"FRAME_CONFIG {config:g} was read: ArduSub's frame {frame}.")
    signs = {i: values.get(f"MOT_{i}_DIRECTION", 1.0) for i in range(1, len(FRAMES[frame]) + 1)}
    for i, sign in signs.items():
        if abs(sign) != 1.0:
            raise LayoutError(f"is {sign:g}, expected 1 or -1", f"MOT_{i}_DIRECTION")
    if turned := ", ".join(str(i) for i, sign in signs.items() if sign < 0):
        exchange.note(
            f"MOT_n_DIRECTION reverses the outputs of motors {turned}, so that they push as the "
            "frame says: "
            "forces of the layout are those of the frame."
        )
    return of_motors(name, [(f"motor{i}", [*FRAMES[frame][i - 1]]) for i in signs], exchange)


def factors_of(layout: Layout, exchange: Exchange) -> tuple[list[str], Array]:
    """Returns the names of a layout's thrusters and their factors (n, 6), the largest of each kind
    1. Raises LayoutError: there is no thruster."""
    kept = exchange.thrusters_of(layout, "A table of factors", "limits", "lengths")
    full = np.maximum(kept.upper, -kept.lower)[:, :1]
    factors = (own_effectiveness(kept)[:, 0] * full)[:, np.argsort(ORDER)] * SIGNS
    largest = np.abs(factors).max(0)
    for kinds in (slice(0, 3), slice(3, 6)):
        largest[kinds][largest[kinds] <= WEAK * largest[kinds].max()] = np.inf
    for kind in np.flatnonzero(np.isinf(largest[:3])):
        exchange.note(f"Torque in {('roll', 'pitch', 'yaw')[kind]} is too weak to count.")
    factors = factors / largest
    return list(kept.names), np.where(np.abs(factors) < 1e-4, 0.0, factors)


def write_ardusub(layout: Layout, exchange: Exchange, suffix: str) -> str:
    """Returns the factors of a layout's thrusters: for `.csv` a table, else lines of source. Raises
    LayoutError: there is no thruster."""
    names, factors = factors_of(layout, exchange)
    lines = ["motor,roll,pitch,yaw,throttle,forward,lateral"] if suffix == ".csv" else []
    for i, (name, row) in enumerate(zip(names, factors.tolist(), strict=True), 1):
        numbers = ", ".join(f"{factor}f" for factor in row)
        call = f"add_motor_raw_6dof(AP_MOTORS_MOT_{i}, {numbers}, {i});  // {name}"
        lines.append(",".join(map(str, [name, *row])) if suffix == ".csv" else call)
    return "\n".join(lines) + "\n"


def called(text: str) -> list[MotorRow]:
    """Returns the motors of calls of `add_motor_raw_6dof` in C++ or Lua, which may go over several
    lines. Raises LayoutError: a call does not parse; its line is named."""
    lua = "motors:" in text or re.search(r"^\s{0,20}local ", text, re.MULTILINE) is not None
    code = _without_comments(text, lua)
    rows = list[MotorRow]()
    constants = constants_in(code)
    line = 1
    seen = 0
    for call in _CALL.finditer(code):
        line = line + code.count("\n", seen, call.start())
        seen = call.start()
        cells = _arguments(code[call.end() : call.end() + LONGEST])
        before = code[max(0, call.start() - 40) : call.start()].rpartition("\n")[2]
        if re.search(r"\b(?:void|function)\b", before) or any(map(_DECLARED.match, cells)):
            continue
        if len(cells) not in (7, 8):
            raise LayoutError(f"line {line}: expected a motor and its six factors in brackets")
        if len(rows) == MAX_ACTUATORS:
            raise LayoutError(f"line {line}: adds more than {MAX_ACTUATORS} motors")
        if not lua and (cell := next(filter(_WHOLE.search, cells[1:7]), None)):
            raise LayoutError(
                f"line {line}: {cell.strip()!r:.60} divides whole numbers, which C++ rounds"
            )
        try:
            factors = [value_of(cell, constants) for cell in cells[1:7]]
        except ValueError as error:
            raise LayoutError(f"line {line}: {error}; write its number") from None
        name = cells[0].strip().removeprefix("AP_MOTORS_MOT_")
        number = int(name) + (name == cells[0].strip()) if name.isdecimal() and len(name) < 4 else 0
        rows.append((f"motor{number}" if number else name[:60], factors))
    return rows


def _without_comments(code: str, lua: bool) -> str:
    """A program without its comments, and with all ends of lines."""
    start, stop, mark = ("--[[", "]]", "--") if lua else ("/*", "*/", "//")
    kept, *parts = code.split(start)
    for part in parts:
        inside, _, after = part.partition(stop)
        kept += "\n" * inside.count("\n") + after
    return "\n".join(line.partition(mark)[0] for line in kept.split("\n"))


def _arguments(text: str) -> list[str]:
    """What stands between a bracket and the one that closes it, parted by commas; none where none
    does."""
    depth = 0
    cells = [""]
    for letter in text:
        depth += (letter in "([{") - (letter in ")]}")
        if depth < 0:
            return cells
        cells += [""] if letter == "," and depth == 0 else []
        cells[-1] += letter if letter != "," or depth else ""
    return []


def tabled(table: Table) -> list[MotorRow]:
    """Returns the motors in a table whose header names `FACTORS` in any order. Raises LayoutError:
    a row does not parse; it is named."""
    rows = []
    for i, record in enumerate(records_of(table), 1):
        name = str(lookup(record, labels.NAME)[1] or i)
        by_word = {plain(key): value for key, value in record.items()}
        factors = [by_word[word] for word in FACTORS]
        if not all(isinstance(factor, float) and abs(factor) < 1e9 for factor in factors):
            raise LayoutError(f"{name!r:.60} lacks a factor, or has one of no ordinary size")
        rows.append((f"motor{name}" if name.isdecimal() else name, factors))
    return rows


def value_of(text: str, constants: Mapping[str, float]) -> float:
    """Returns the value of numbers, constants, + - * /, brackets and functions such as
    `cosf(radians(45))`. ValueError: it is something else, or not finite; the message names what is
    not known."""
    what = f"{text.strip()!r:.60}"
    names = {**_NAMES, **constants}
    try:
        if len(text) > MOST:
            raise SyntaxError
        tree = ast.parse(_WRITTEN.sub(r"\1", text.strip()), mode="eval")
        for node in ast.walk(tree):
            number = not isinstance(node, ast.Constant) or type(node.value) in (int, float)
            if not isinstance(node, _ALLOWED) or not number:
                raise SyntaxError
            if isinstance(node, ast.Name) and node.id not in names:
                raise ValueError(f"{node.id!r:.60} is not defined in the file")
        value = float(eval(compile(tree, "", "eval"), {"__builtins__": {}}, names))
    except (SyntaxError, TypeError, ArithmeticError, RecursionError, MemoryError):
        raise ValueError(f"{what} is no number") from None
    if not abs(value) < 1e9:
        raise ValueError(f"{what} is no number of ordinary size")
    return value


def constants_in(text: str) -> dict[str, float]:
    """Returns the constants that a program of C++ or Lua defines once, by name; others are left
    out."""
    values: dict[str, float] = {}
    twice: set[str] = set()
    for define, declared, value in islice(
        map(re.Match.groups, _DEFINED.finditer(text)), MOST_CONSTANTS
    ):
        name = define or declared
        twice |= {name} & values.keys()
        with suppress(ValueError):
            values[name] = value_of(value, values)
    return {name: value for name, value in values.items() if name not in twice}
