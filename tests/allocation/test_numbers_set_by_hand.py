"""The page of the default method has every number set by hand, with its value and its reason."""

import ast
import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
ROW = re.compile(r"^\| `(\w+)` \| ([^|]+) \| `([^`|]+)` \| ([^|]+) \|$", re.MULTILINE)
"""A row of the page's table: name, value, file, reason."""
PAGE = ROOT / "docs/theory/numbers.md"
"""The page of numbers."""
PYTHON_FILES = [
    ROOT / "finlab/arrays.py",
    ROOT / "finlab/allocation/levenberg_marquardt.py",
    *sorted((ROOT / "finlab/allocation/dual").glob("*.py")),
    ROOT / "finlab/actuators/fin/fin_response.py",
    ROOT / "finlab/actuators/kinds.py",
    ROOT / "finlab/actuators/response.py",
    ROOT / "finlab/actuators/rudder.py",
    ROOT / "finlab/actuators/thrust_power.py",
    ROOT / "finlab/actuators/thruster.py",
]
"""Files of the default method in Python whose constants the page has to have."""


C_FILES = sorted((ROOT / "finlab/core").rglob("*.[ch]"))
"""Files of the core whose constants the page has to have."""
DEFINED = re.compile(r"^#define (\w+) (?:R\()?([\d.]+(?:e-?\d+)?)\b", re.MULTILINE)
"""A constant in C: name, value."""
SINGLE = re.compile(r"^#ifdef FL_SINGLE\n.*?^#else\n", re.MULTILINE | re.DOTALL)
"""Constants of single precision, which the page leaves out."""
NO_CHOICE = {
    "PI",
    "TINY",
    "LARGEST",
    "INFEASIBLE_COST",
    "FL_MOST",
    "FL_VERSION",
    "FL_MAGIC",
    "FL_POINTS",
    "FL_SCORES",
}
"""Constants in C that nobody has chosen: sizes, versions, numbers of mathematics."""


class Row(NamedTuple):
    """A row of the page's table."""

    name: str
    value: str
    file: str
    reason: str


def rows_of_page() -> list[Row]:
    """The rows of the page's table, from top to bottom."""
    return [Row(*cells) for cells in ROW.findall(PAGE.read_text())]


def numbers(path: Path) -> dict[str, object]:
    """The public constants of a file that are numbers, or tuples of them."""
    constants = {}
    for line in ast.parse(path.read_text()).body:
        if not (isinstance(line, ast.Assign) and isinstance(line.targets[0], ast.Name)):
            continue
        name = line.targets[0].id
        if name.isupper() and not name.startswith("_"):
            try:
                value = ast.literal_eval(line.value)
            except ValueError:
                continue
            if not isinstance(value, str):
                constants[name] = value
    return constants


def test_the_page_has_every_number_with_a_reason() -> None:
    rows = rows_of_page()
    on_page = {(row.file, row.name): ast.literal_eval(row.value) for row in rows}
    in_code: dict[tuple[str, str], object] = {}
    for path in PYTHON_FILES:
        for name, value in numbers(path).items():
            in_code[str(path.relative_to(ROOT)), name] = value
    for path in C_FILES:
        for name, text in DEFINED.findall(SINGLE.sub("", path.read_text())):
            same = [value for (_, other), value in in_code.items() if other == name]
            if same:  # said in both languages
                assert float(text) in same, name
            elif name not in NO_CHOICE:
                in_code[str(path.relative_to(ROOT)), name] = ast.literal_eval(text)
    assert on_page == in_code
    assert len(rows) == len(on_page)
    assert all(len(row.reason.split()) > 3 for row in rows)


def test_the_rows_of_the_page_are_sorted_by_file() -> None:
    files = [row.file for row in rows_of_page()]
    assert files == sorted(files)
