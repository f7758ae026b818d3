"""Parameters of autopilots by name: scripts of PX4, lists of Mission Planner, MAVProxy and QGroundControl."""

import re

from finlab.errors import LayoutError
from finlab.exchange.csv_table import is_number

LONGEST = 500
"""Most characters of a line that are looked at."""
_NAME = re.compile(r"[A-Z][A-Z0-9]*_\w+\Z")
_ASKING = {"compare", "greater", "show", "echo", "if", "reset", "touch"}
"""Words of a script before a name that sets nothing."""


def read_parameters(text: str, wanted: str) -> dict[str, float]:
    """Returns parameters by name, of lines `param set-default NAME VALUE`, `NAME VALUE`, `NAME,VALUE` and `1
    1 NAME VALUE TYPE`. What follows # is a comment; the last value counts. Raises LayoutError: a name that
    begins with one of the words in `wanted` has no number behind it."""
    values: dict[str, float] = {}
    begins = tuple(wanted.split())
    for number, line in enumerate(text.splitlines(), 1):
        cells = re.split(r"[\s,=]+", line[:LONGEST].partition("#")[0].strip())
        place = next((i for i, cell in enumerate(cells) if _NAME.match(cell)), None)
        if place is None or _ASKING & {*cells[:place]}:
            continue
        name, value = cells[place], (cells[place + 1 : place + 2] or [""])[0]
        if is_number(value) and abs(float(value)) < 1e9:
            values[name] = float(value)
        elif name.startswith(begins):
            raise LayoutError(f"line {number}: {name} is {value!r:.40}, expected a number of ordinary size")
    return values
