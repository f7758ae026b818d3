"""Rows of motor factors: calls in C++ and Lua, with simple arithmetic, and tables."""

import ast
import math
import re
from collections.abc import Mapping
from contextlib import suppress
from itertools import islice

from finlab.errors import LayoutError
from finlab.exchange import labels
from finlab.exchange.labels import lookup, plain
from finlab.exchange.matrix_table import FACTORS, Table, records_of
from finlab.layout import MAX_ACTUATORS

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
    *(ast.Expression, ast.BinOp, ast.UnaryOp, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.USub, ast.UAdd),
    *(ast.Constant, ast.Name, ast.Load, ast.Call),
)
"""What an expression may be made of."""
_WRITTEN = re.compile(r"(?<![\w.])(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)[fFlL]\b|std::|math\.")
_DEFINED = re.compile(
    r"^[ \t]*(?:#[ \t]*define[ \t]+(\w+)[ \t]+(?!\()"
    r"|(?:(?:static|const|constexpr|local|float|double)[ \t]+)+(\w+)[ \t]*=[ \t]*)([^;\n]{1,200})",
    re.MULTILINE,
)
MotorRow = tuple[str, list[float]]
"""A motor and its six factors."""


def called(text: str) -> list[MotorRow]:
    """Returns the motors of calls of `add_motor_raw_6dof` in C++ or Lua, which may go over several lines.
    Raises LayoutError: a call does not parse; its line is named."""
    lua = "motors:" in text or re.search(r"^\s{0,20}local ", text, re.MULTILINE) is not None
    code, rows = _without_comments(text, lua), list[MotorRow]()
    constants, line, seen = constants_in(code), 1, 0
    for call in _CALL.finditer(code):
        line, seen = line + code.count("\n", seen, call.start()), call.start()
        cells = _arguments(code[call.end() : call.end() + LONGEST])
        before = code[max(0, call.start() - 40) : call.start()].rpartition("\n")[2]
        if re.search(r"\b(?:void|function)\b", before) or any(map(_DECLARED.match, cells)):
            continue
        if len(cells) not in (7, 8):
            raise LayoutError(f"line {line}: expected a motor and its six factors in brackets")
        if len(rows) == MAX_ACTUATORS:
            raise LayoutError(f"line {line}: adds more than {MAX_ACTUATORS} motors")
        if not lua and (cell := next(filter(_WHOLE.search, cells[1:7]), None)):
            raise LayoutError(f"line {line}: {cell.strip()!r:.60} divides whole numbers, which C++ rounds")
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
    """What stands between a bracket and the one that closes it, parted by commas; none where none does."""
    depth, cells = 0, [""]
    for letter in text:
        depth += (letter in "([{") - (letter in ")]}")
        if depth < 0:
            return cells
        cells += [""] if letter == "," and depth == 0 else []
        cells[-1] += letter if letter != "," or depth else ""
    return []


def tabled(table: Table) -> list[MotorRow]:
    """Returns the motors in a table whose header names `FACTORS` in any order. Raises LayoutError: a row does
    not parse; it is named."""
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
    """Returns the value of numbers, constants, + - * /, brackets and functions such as `cosf(radians(45))`.
    ValueError: it is something else, or not finite; the message names what is not known."""
    what, names = f"{text.strip()!r:.60}", {**_NAMES, **constants}
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
    """Returns the constants that a program of C++ or Lua defines once, by name; others are left out."""
    values: dict[str, float] = {}
    twice: set[str] = set()
    for define, declared, value in islice(map(re.Match.groups, _DEFINED.finditer(text)), MOST_CONSTANTS):
        name = define or declared
        twice |= {name} & values.keys()
        with suppress(ValueError):
            values[name] = value_of(value, values)
    return {name: value for name, value in values.items() if name not in twice}
