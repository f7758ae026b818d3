"""Rows of motor factors: calls in C++ and Lua, and tables."""

import re
from typing import NamedTuple

from finlab.errors import LayoutError
from finlab.exchange.arithmetic import constants_in, value_of
from finlab.exchange.csv_table import FACTORS, is_number, table_of
from finlab.exchange.labels import plain
from finlab.layout import MAX_ACTUATORS

LONGEST = 500
"""Most characters of a call that are looked at."""
_CALL = re.compile(r"\badd_motor\w*[ \t]*\(")
_WHOLE = re.compile(r"(?<![\w.])\d+[ \t]*/[ \t]*\d+(?![\w.])")
_DECLARED = re.compile(r"^\s*(?:const\s+)?(?:float|double|int|u?int8_t|auto)\b")


class MotorRow(NamedTuple):
    """A motor and its six factors."""

    name: str
    factors: list[float]


def rows_in(text: str) -> list[MotorRow]:
    """Returns the motors of a program's calls, or of a table whose header names `FACTORS` in any order.

    Raises:
        LayoutError: a call or row does not parse; it is named by its number.
    """
    return _called(text) if "add_motor" in text else _tabled(text)


def _called(text: str) -> list[MotorRow]:
    """Motors of calls of `add_motor_raw_6dof`, which may go over several lines."""
    lua = "motors:" in text or re.search(r"^\s{0,20}local ", text, re.MULTILINE) is not None
    code, rows = _without_comments(text, lua), list[MotorRow]()
    constants, line, seen = constants_in(code), 1, 0
    for found in _CALL.finditer(code):
        line, seen = line + code.count("\n", seen, found.start()), found.start()
        cells = _arguments(code[found.end() : found.end() + LONGEST])
        before = code[max(0, found.start() - 40) : found.start()].rpartition("\n")[2]
        if re.search(r"\b(?:void|function)\b", before) or (cells and any(map(_DECLARED.match, cells))):
            continue
        if cells is None or len(cells) not in (7, 8):
            raise LayoutError(f"line {line}: expected a motor and its six factors in brackets")
        if len(rows) == MAX_ACTUATORS:
            raise LayoutError(f"line {line}: adds more than {MAX_ACTUATORS} motors")
        whole = next((cell for cell in cells[1:7] if _WHOLE.search(cell)), None) if not lua else None
        if whole is not None:
            raise LayoutError(f"line {line}: {whole.strip()!r:.60} divides whole numbers, which C++ rounds")
        try:
            factors = [value_of(cell, constants) for cell in cells[1:7]]
        except ValueError as error:
            raise LayoutError(f"line {line}: {error}; write its number") from None
        name = cells[0].strip().removeprefix("AP_MOTORS_MOT_")
        number = int(name) + (name == cells[0].strip()) if name.isdecimal() and len(name) < 4 else 0
        rows.append(MotorRow(f"motor{number}" if number else name[:60], factors))
    return rows


def _without_comments(code: str, lua: bool) -> str:
    """A program without its comments, and with all ends of lines."""
    start, stop, mark = ("--[[", "]]", "--") if lua else ("/*", "*/", "//")
    parts = code.split(start)
    kept = [parts[0]]
    for part in parts[1:]:
        inside, _, after = part.partition(stop)
        kept += ["\n" * inside.count("\n"), after]
    return "\n".join(line.partition(mark)[0] for line in "".join(kept).split("\n"))


def _arguments(text: str) -> list[str] | None:
    """What stands between a bracket and the one that closes it, parted by commas; None where none does."""
    depth, cells = 0, [""]
    for letter in text:
        depth += (letter in "([{") - (letter in ")]}")
        if depth < 0:
            return cells
        if letter == "," and depth == 0:
            cells.append("")
        else:
            cells[-1] += letter
    return None


def _tabled(text: str) -> list[MotorRow]:
    table = table_of(text)
    places = {plain(name): i for i, name in enumerate(table.header)}
    lacking = [name for name in FACTORS if name not in places]
    if lacking:
        raise LayoutError(f"has no column {', '.join(lacking)} in a table of factors")
    named = next((i for i, name in enumerate(table.header) if plain(name) not in FACTORS), None)
    rows = []
    for i, (line, cells) in enumerate(table.rows, 1):
        if len(cells) < max(places[name] for name in FACTORS) + 1:
            raise LayoutError(f"row {line} has {len(cells)} cells, expected {len(table.header)}")
        factors = [cells[places[name]] for name in FACTORS]
        wrong = next((cell for cell in factors if not is_number(cell)), None)
        if wrong is not None:
            raise LayoutError(f"row {line}: {wrong!r:.40} is no number")
        name = str(i) if named is None else cells[named]
        if max(abs(float(cell)) for cell in factors) > 1e9:
            raise LayoutError(f"row {line} holds a factor of no ordinary size")
        rows.append(MotorRow(f"motor{name}" if name.isdecimal() else name, [float(cell) for cell in factors]))
    return rows
