"""Reads and writes the motor factors of ArduSub: frames by name, calls in source, and tables.

Each motor has six factors, in the order roll, pitch, yaw, throttle, forward, lateral. They hold
directions of forces and signs of torques, no lengths and no newtons. Forward, right and up are
positive, and so are roll to the right, pitch up and yaw clockwise seen from above (ArduSub,
`AP_Motors6DOF::setup_motors`, commit of 2026), as in scripts of ArduCopter (`Motors_6DoF`), which
also say whether a motor pushes both ways. Calls are in C++ and Lua, with simple arithmetic.
"""

import ast
import math
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import islice
from typing import NamedTuple

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
_HORIZONTAL_VECTORED = (
    (0, 0, 1, 0, -1, 1),
    (0, 0, -1, 0, -1, -1),
    (0, 0, -1, 0, 1, 1),
    (0, 0, 1, 0, 1, -1),
)
"""Four motors at 45 degrees in the horizontal plane, which push forward, sideways and turn."""
_HORIZONTAL_FORWARD = ((0, 0, -1, 0, 1, 0), (0, 0, 1, 0, 1, 0))
"""Two motors side by side that push forward and turn."""
_VERTICAL_PAIR = ((1, 0, 0, -1, 0, 0), (-1, 0, 0, -1, 0, 0))
"""Two motors side by side that push down and roll."""
_FACTORS_OF_FRAMES: dict[str, tuple[tuple[float, ...], ...]] = {
    "BLUEROV1": (
        *_HORIZONTAL_FORWARD,
        (-0.5, 0.5, 0, 0.45, 0, 0),
        (0.5, 0.5, 0, 0.45, 0, 0),
        (0, -1, 0, 1, 0, 0),
        (-0.25, 0, 0, 0, 0, 1),
    ),
    "VECTORED": (*_HORIZONTAL_VECTORED, *_VERTICAL_PAIR),
    "VECTORED_6DOF": (
        *_HORIZONTAL_VECTORED,
        (1, -1, 0, -1, 0, 0),
        (-1, -1, 0, -1, 0, 0),
        (1, 1, 0, -1, 0, 0),
        (-1, 1, 0, -1, 0, 0),
    ),
    "VECTORED_6DOF_90DEG": (
        (1, 1, 0, 1, 0, 0),
        (0, 0, 1, 0, 1, 0),
        (1, -1, 0, 1, 0, 0),
        (0, 0, 0, 0, 0, 1),
        (0, 0, 0, 0, 0, 1),
        (-1, 1, 0, 1, 0, 0),
        (0, 0, -1, 0, 1, 0),
        (-1, -1, 0, 1, 0, 0),
    ),
    "SIMPLEROV_3": (*_HORIZONTAL_FORWARD, (0, 0, 0, -1, 0, 0)),
    "SIMPLEROV_4": (*_HORIZONTAL_FORWARD, *_VERTICAL_PAIR),
    "SIMPLEROV_5": (*_HORIZONTAL_FORWARD, *_VERTICAL_PAIR, (0, 0, 0, 0, 0, 1)),
}
FRAMES: dict[str, Array] = {
    name: np.array(factors, np.float64) for name, factors in _FACTORS_OF_FRAMES.items()
}
"""Name of a frame -> factors (n, 6), in the order of FRAME_CONFIG."""
ARM = 0.2
"""Lever arm that a torque factor of 1 stands for [m]; the file has no lengths."""
ORDER = [AXES.index(axis) for axis in ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")]
"""Columns of factors in the order of a wrench."""
ARDUPILOT_PARAMETER = re.compile(
    r"^[ \t\d]{0,20}(?:FRAME_C(?:ONFIG|LASS)|MOT_\w+|SYSID_THISMAV)\b", re.MULTILINE
)
"""A line by which a list of ArduPilot's parameters is recognized."""
WEAK_SHARE = 0.1
"""A column is written as zeros where it stays below this share of the largest of its kind: what a
small lever arm gives by the way would be scaled up to 1."""
MAX_CALL_LENGTH = 500
"""Longest call that is parsed [characters]."""
MAX_LENGTH = 200
"""Longest expression [characters]."""
MAX_CONSTANTS = 2000
"""Most constants of a program that are read."""
_CALL = re.compile(r"\badd_motor\w*[ \t]*\(")
"""The start of a call that adds a motor."""
_INTEGER_DIVISION = re.compile(r"(?<![\w.])\d+[ \t]*/[ \t]*\d+(?![\w.])")
"""A division of two integers: C++ rounds its result, Lua and Python do not."""
_DECLARATION = re.compile(r"^\s*(?:const\s+)?(?:float|double|int|u?int8_t|auto)\b")
"""An argument with a type: it belongs to a declaration of the function, not to a call."""
_NAMES = {name: getattr(math, name) for name in ("sin", "cos", "tan", "sqrt", "radians", "pi")}
"""Functions and constants of C++ and Lua that an expression may use."""
_NAMES |= {f"{name}f": value for name, value in _NAMES.items()}
_NAMES |= {"rad": math.radians, "abs": abs, "fabsf": abs, "M_PI": math.pi, "PI": math.pi}
_NAMES |= {"M_PI_2": math.pi / 2, "M_PI_4": math.pi / 4}
_NAMES |= {"M_SQRT2": math.sqrt(2), "M_SQRT1_2": math.sqrt(0.5)}
_ALLOWED_NODES = (
    ast.Expression,
    ast.BinOp,
    ast.UnaryOp,
    ast.Add,
    ast.Sub,
    ast.Mult,
    ast.Div,
    ast.USub,
    ast.UAdd,
    ast.Constant,
    ast.Name,
    ast.Load,
    ast.Call,
)
"""Nodes of Python's syntax tree that an expression may consist of."""
_SUFFIX_OR_NAMESPACE = re.compile(
    r"(?<![\w.])(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)[fFlL]\b|std::|math\."
)
"""The suffix of a literal (`0.5f`), or a namespace; without them an expression is also Python's."""
_DEFINITION = re.compile(
    r"^[ \t]*(?:#[ \t]*define[ \t]+(\w+)[ \t]+(?!\()"
    r"|(?:(?:static|const|constexpr|local|float|double)[ \t]+)+(\w+)[ \t]*=[ \t]*)([^;\n]{1,200})",
    re.MULTILINE,
)
"""A constant by `#define NAME VALUE`, or by a declaration `const float NAME = VALUE`."""


class Motor(NamedTuple):
    """A motor of ArduSub."""

    name: str
    factors: Sequence[float]
    """Roll, pitch, yaw, throttle, forward, lateral."""
    is_reversible: bool = True
    """Whether it pushes both ways."""


def layout_of_motors(name: str, motors: Sequence[Motor], exchange: Exchange) -> Layout:
    """Returns the layout of motors and their factors.

    Args:
        name: the layout's name.
        motors: the motors in order.
        exchange: defaults for what factors do not say; gets the notes.

    Raises:
        LayoutError: there is no motor, one of them stands twice, or one gives no force.
    """
    if not motors:
        raise LayoutError("has no rows of factors, a motor and its six factors in each")
    names = [motor.name for motor in motors]
    for i, motor_name in enumerate(names):
        if motor_name in names[:i]:
            raise LayoutError(f"adds a motor twice, {motor_name}; keep the lines of one frame")
    exchange.note(
        f"Factors hold no lengths: one of 1 is taken for an arm of {ARM} m",
        "correct `position_m`",
        field="position",
    )
    factors = np.array([motor.factors for motor in motors])
    columns = (factors * SIGNS)[:, ORDER]  # (n, 6) in the order of a wrench, FLU
    forces = np.linalg.norm(columns[:, :3], axis=1, keepdims=True)
    columns[:, 3:] *= ARM * forces
    thrusters = [
        exchange.thruster_of_column(motor_name, column, None)
        for motor_name, column in zip(names, columns, strict=True)
    ]
    one_way = [motor.name for motor in motors if not motor.is_reversible]
    if one_way:
        exchange.note(f"Not reversible, and so pushing one way, are {', '.join(one_way)}.")
    thrusters = [
        thruster if motor.is_reversible else replace(thruster, force=(0.0, thruster.force[1]))
        for thruster, motor in zip(thrusters, motors, strict=True)
    ]
    return Layout(name, tuple(thrusters))


def read_parameters_of_ardusub(text: str, name: str, exchange: Exchange) -> Layout:
    """Returns the layout of the frame that a list of ArduSub's parameters names.

    MOT_n_DIRECTION -1 turns a motor the other way for the same output, so that it pushes as its
    frame says.

    Args:
        text: the list of parameters.
        name: the layout's name.
        exchange: defaults for what factors do not say; gets the notes.

    Raises:
        LayoutError: FRAME_CONFIG is not in it, or is none of the seven frames; a value is no
            number.
    """
    values = read_parameters(text, "FRAME_ MOT_1 MOT_2 MOT_3 MOT_4 MOT_5 MOT_6 MOT_7 MOT_8")
    config = values.get("FRAME_CONFIG")
    frames = [*FRAMES]
    if config is None:
        vehicle = " of another vehicle (FRAME_CLASS)" if "FRAME_CLASS" in values else ""
        lacks = "no FRAME_CONFIG, by which ArduSub names the motors of a robot"
        raise LayoutError(f"holds {len(values)} parameters of ArduPilot{vehicle}, but {lacks}")
    if config not in range(len(frames)):
        why = (
            "a frame of one's own, which parameters do not hold; give the script (.lua) or source "
            "with its motors"
        )
        choices = f"finlab knows 0 to 6: {', '.join(frames)}"
        raise LayoutError(f"is {config:g}, {why}; {choices}", "FRAME_CONFIG")
    frame = frames[int(config)]
    exchange.note(f"FRAME_CONFIG {config:g} was read: ArduSub's frame {frame}.")
    motors = []
    reversed_motors = []
    for i, factors in enumerate(FRAMES[frame], 1):
        direction = values.get(f"MOT_{i}_DIRECTION", 1.0)
        if abs(direction) != 1.0:
            raise LayoutError(f"is {direction:g}, expected 1 or -1", f"MOT_{i}_DIRECTION")
        if direction < 0:
            reversed_motors.append(str(i))
        motors.append(Motor(f"motor{i}", [*factors]))
    if reversed_motors:
        exchange.note(
            f"MOT_n_DIRECTION reverses the outputs of motors {', '.join(reversed_motors)}, so that "
            "they push as the frame says: forces of the layout are those of the frame."
        )
    return layout_of_motors(name, motors, exchange)


def factors_of(layout: Layout, exchange: Exchange) -> tuple[list[str], Array]:
    """Returns the names of a layout's thrusters and their factors (n, 6).

    The largest factor of each column is 1, or -1; columns of weak torques and forces are zeros.

    Raises:
        LayoutError: there is no thruster.
    """
    thrusters = exchange.thrusters_of(layout, "A table of factors", "limits", "lengths")
    full_force = np.maximum(thrusters.upper, -thrusters.lower)[:, :1]  # (n, 1) [N]
    wrenches = own_effectiveness(thrusters)[:, 0] * full_force  # (n, 6) in the order of a wrench
    factors = wrenches[:, np.argsort(ORDER)] * SIGNS
    largest = np.abs(factors).max(0)  # (6,)
    for columns in (slice(0, 3), slice(3, 6)):  # torques, forces
        weak = largest[columns] <= WEAK_SHARE * largest[columns].max()
        largest[columns][weak] = np.inf
    for column in np.flatnonzero(np.isinf(largest[:3])):
        exchange.note(f"Torque in {('roll', 'pitch', 'yaw')[column]} is too weak to count.")
    factors = factors / largest
    return list(thrusters.names), np.where(np.abs(factors) < 1e-4, 0.0, factors)


def write_ardusub(layout: Layout, exchange: Exchange, suffix: str) -> str:
    """Returns the factors of a layout's thrusters as text.

    Args:
        layout: the layout to write.
        exchange: gets the notes.
        suffix: `.csv` for a table; lines of source that add the motors for all others.

    Raises:
        LayoutError: there is no thruster.
    """
    names, factors = factors_of(layout, exchange)
    lines = []
    if suffix == ".csv":
        lines.append("motor,roll,pitch,yaw,throttle,forward,lateral")
    for i, (name, row) in enumerate(zip(names, factors.tolist(), strict=True), 1):
        if suffix == ".csv":
            lines.append(",".join(map(str, [name, *row])))
        else:
            numbers = ", ".join(f"{factor}f" for factor in row)
            lines.append(f"add_motor_raw_6dof(AP_MOTORS_MOT_{i}, {numbers}, {i});  // {name}")
    return "\n".join(lines) + "\n"


def motors_in_source(text: str) -> list[Motor]:
    """Returns the motors that calls of `add_motor_raw_6dof` in C++ or Lua add, or of
    `Motors_6DoF:add_motor` in Lua.

    Raises:
        LayoutError: a call cannot be parsed; its line is named.
    """
    is_lua = (
        "motors:" in text
        or "Motors_6DoF" in text
        or re.search(r"^\s{0,20}local ", text, re.MULTILINE) is not None
    )
    code = _without_comments(text, is_lua)
    constants = constants_in(code)
    motors: list[Motor] = []
    line = 1
    counted_to = 0  # ends of lines before this index are in `line`
    for call in _CALL.finditer(code):
        line += code.count("\n", counted_to, call.start())
        counted_to = call.start()
        cells = _arguments(code[call.end() : call.end() + MAX_CALL_LENGTH])
        same_line = code[max(0, call.start() - 40) : call.start()].rpartition("\n")[2]
        if re.search(r"\b(?:void|function)\b", same_line) or any(map(_DECLARATION.match, cells)):
            continue  # the function itself, not a call
        if len(cells) not in (7, 8, 9):
            raise LayoutError(
                f"line {line}: a motor with {max(0, len(cells) - 1)} arguments behind it, expected "
                "its six factors in brackets, as add_motor_raw_6dof of ArduSub and "
                "Motors_6DoF:add_motor of ArduCopter have them"
            )
        reversible = cells[7].strip() if len(cells) == 9 else "true"
        if reversible not in ("true", "false"):
            raise LayoutError(
                f"line {line}: {reversible!r:.40} says whether it is reversible; "
                "expected true or false"
            )
        if len(motors) == MAX_ACTUATORS:
            raise LayoutError(f"line {line}: adds more than {MAX_ACTUATORS} motors")
        if not is_lua:
            for cell in cells[1:7]:
                if _INTEGER_DIVISION.search(cell):
                    raise LayoutError(
                        f"line {line}: {cell.strip()!r:.60} divides whole numbers, which C++ rounds"
                    )
        try:
            factors = [value_of(cell, constants) for cell in cells[1:7]]
        except ValueError as error:
            raise LayoutError(f"line {line}: {error}; write its number") from None
        motor_name = _motor_name(cells[0].strip())
        motors.append(Motor(motor_name, factors, reversible == "true"))
    return motors


def _motor_name(argument: str) -> str:
    """The name of a motor by the first argument of its call.

    `AP_MOTORS_MOT_3` of C++ counts from 1, a bare number of Lua from 0; others are names.
    """
    name = argument.removeprefix("AP_MOTORS_MOT_")
    if name.isdecimal() and len(name) < 4:
        number = int(name) + 1 if name == argument else int(name)
        if number > 0:
            return f"motor{number}"
    return name[:60]


def _without_comments(code: str, is_lua: bool) -> str:
    """A program without its comments; ends of lines inside them stay, so that lines keep their
    numbers."""
    start, stop, line_comment = ("--[[", "]]", "--") if is_lua else ("/*", "*/", "//")
    text, *pieces = code.split(start)
    for piece in pieces:
        comment, _, after = piece.partition(stop)
        text += "\n" * comment.count("\n") + after
    return "\n".join(line.partition(line_comment)[0] for line in text.split("\n"))


def _arguments(text: str) -> list[str]:
    """The arguments of a call, split at commas outside of brackets, from the text behind its
    opening bracket; an empty list where the bracket is never closed."""
    depth = 0
    cells = [""]
    for letter in text:
        if letter in "([{":
            depth += 1
        elif letter in ")]}":
            depth -= 1
        if depth < 0:
            return cells
        if letter == "," and depth == 0:
            cells.append("")
        else:
            cells[-1] += letter
    return []


def motors_in_table(table: Table) -> list[Motor]:
    """Returns the motors in a table whose header names `FACTORS` in any order.

    Raises:
        LayoutError: a row cannot be parsed; it is named.
    """
    motors = []
    for i, record in enumerate(records_of(table), 1):
        name = str(lookup(record, labels.NAME).value or i)
        by_word = {plain(key): value for key, value in record.items()}
        factors = [by_word[word] for word in FACTORS]
        if not all(isinstance(factor, float) and abs(factor) < 1e9 for factor in factors):
            raise LayoutError(f"{name!r:.60} lacks a factor, or has one of no ordinary size")
        motors.append(Motor(f"motor{name}" if name.isdecimal() else name, factors))
    return motors


def value_of(text: str, constants: Mapping[str, float]) -> float:
    """Returns the value of an expression of C++ or Lua, such as `0.5f * cosf(radians(45))`.

    The text is a stranger's: its syntax tree may hold numbers, `_NAMES`, constants, + - * /,
    brackets and calls of `_NAMES` alone, and it is evaluated without Python's own functions.

    Args:
        text: the expression.
        constants: values of the names that the program defines.

    Raises:
        ValueError: it is something else, or not finite; the message names what is not defined.
    """
    shown = f"{text.strip()!r:.60}"
    names = {**_NAMES, **constants}
    try:
        if len(text) > MAX_LENGTH:
            raise SyntaxError
        tree = ast.parse(_SUFFIX_OR_NAMESPACE.sub(r"\1", text.strip()), mode="eval")
        for node in ast.walk(tree):
            if not isinstance(node, _ALLOWED_NODES):
                raise SyntaxError
            if isinstance(node, ast.Constant) and type(node.value) not in (int, float):
                raise SyntaxError
            if isinstance(node, ast.Name) and node.id not in names:
                raise ValueError(f"{node.id!r:.60} is not defined in the file")
        value = float(eval(compile(tree, "", "eval"), {"__builtins__": {}}, names))
    except (SyntaxError, TypeError, ArithmeticError, RecursionError, MemoryError):
        raise ValueError(f"{shown} is no number") from None
    if not abs(value) < 1e9:
        raise ValueError(f"{shown} is no number of ordinary size")
    return value


def constants_in(text: str) -> dict[str, float]:
    """Returns the constants of a program of C++ or Lua by name, without those whose value is no
    number and those that are defined more than once."""
    values: dict[str, float] = {}
    redefined: set[str] = set()
    for match in islice(_DEFINITION.finditer(text), MAX_CONSTANTS):
        define, declared, value = match.groups()
        name = define or declared
        if name in values:
            redefined.add(name)
        with suppress(ValueError):
            values[name] = value_of(value, values)
    return {name: value for name, value in values.items() if name not in redefined}
