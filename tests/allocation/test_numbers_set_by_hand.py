"""The page of the default method has every number set by hand, with its value and its reason."""

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROW = re.compile(r"^\| `(\w+)` \| ([^|]+) \| `([^`|]+)` \| ([^|]+) \|$", re.MULTILINE)
"""A row of the page's table: name, value, file, reason."""
PAGE = ROOT / "docs/theory/numbers.md"
"""The page of numbers."""
PYTHON_FILES = [
    ROOT / "finlab/arrays.py",
    ROOT / "finlab/allocation/levenberg_marquardt.py",
    *sorted((ROOT / "finlab/allocation/dual").glob("*.py")),
    ROOT / "finlab/actuators/fin/conjugate_margin.py",
    ROOT / "finlab/actuators/fin/fin_response.py",
    ROOT / "finlab/actuators/fin/law_box.py",
    ROOT / "finlab/actuators/kinds.py",
    ROOT / "finlab/actuators/response.py",
    ROOT / "finlab/actuators/propeller_rudder.py",
    ROOT / "finlab/actuators/rudder.py",
    ROOT / "finlab/actuators/thrust_power.py",
    ROOT / "finlab/actuators/thruster.py",
    ROOT / "finlab/analysis/force_pieces.py",
    ROOT / "finlab/analysis/layout_bound.py",
    ROOT / "finlab/analysis/pose_set.py",
    ROOT / "finlab/analysis/split_sets.py",
    ROOT / "finlab/analysis/zonotope_ball.py",
]
"""Files of the default method in Python, of the search behind capability plots and of the bound over
all layouts, whose constants the page has to have."""


C_FILES = sorted((ROOT / "finlab/core").rglob("*.[ch]"))
"""Files of the core whose constants the page has to have."""
HEADERS = [ROOT / "finlab/core/finlab.h", ROOT / "finlab/core/src/internal.h"]
"""Files whose constants those of other C files are made of."""
DEFINED = re.compile(r"^#define (\w+) ([^\n]+)$", re.MULTILINE)
"""A macro in C without arguments: name, text."""
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
"""A comment in C."""
SINGLE = re.compile(r"^#ifdef FL_SINGLE\n.*?^#else\n", re.MULTILINE | re.DOTALL)
"""Constants of single precision, which the page leaves out."""
BOTH_LANGUAGES = {"ROUNDING", "NOTHING", "NEARLY", "FINE", "CLOSE", "EXACT"}
"""Constants of Python that C has, too."""
NO_CHOICE = {
    "PI",
    "THIRD",
    "TINY",
    "LARGEST",
    "INFEASIBLE_COST",
    "FL_MOST",
    "FL_VERSION",
    "FL_MAGIC",
    "FL_POINTS",
    "FL_LINES",
    "FL_SCORES",
    "FL_DIVE",
    "FL_SEARCH",
    "FL_FORCES",
    "FL_STARTS",
    "FL_FOILS",
    "FL_FOILS_CHEAPER",
    "FL_BOUND",
    "FL_BUDGETS",
    "FL_BUDGET_TARGET",
    "FL_BUDGET_TARGETS",
    "FL_BUDGET_TRIES",
    "UNKNOWNS",
    "FL_DEPTH",
    "DEPENDENT",
    "LATTICE",
    "KINDS",
    "WALSH",
    "ROUNDER",
    "LANES",
    "PER_LOG_2",
    "LOG_2_HIGH",
    "LOG_2_LOW",
}
"""Constants that nobody has chosen: sizes, versions, mathematics, and what follows from others."""
OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
"""Operators in the value of a constant."""
FUNCTIONS: dict[str, Callable[..., Any]] = {
    "R": float,
    "SQRT": math.sqrt,
    "larger": max,
    "np.geomspace": lambda *arguments: arguments,  # as numbers that were chosen
}
"""Functions in the value of a constant."""


class Row(NamedTuple):
    """A row of the page's table."""

    name: str
    value: str
    file: str
    reason: str


def rows_of_page() -> list[Row]:
    """The rows of the page's table, from top to bottom."""
    return [Row(*cells) for cells in ROW.findall(PAGE.read_text())]


def evaluated(node: ast.expr, known: Mapping[str, object]) -> Any:
    """The value of an expression of numbers and known constants; ValueError for any other."""
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        left = evaluated(node.left, known)
        return OPERATORS[type(node.op)](left, evaluated(node.right, known))
    if isinstance(node, ast.Call) and ast.unparse(node.func) in FUNCTIONS:
        arguments = [evaluated(argument, known) for argument in node.args]
        return FUNCTIONS[ast.unparse(node.func)](*arguments)
    if isinstance(node, ast.Name | ast.Attribute):
        name = ast.unparse(node)
        if name in known:
            return known[name]
        raise ValueError(f"no known constant: {name}")
    return ast.literal_eval(node)


def constants_of_python(path: Path, known: Mapping[str, object]) -> dict[str, object]:
    """The public constants of a file that are numbers, or tuples of them."""
    constants: dict[str, object] = {}
    for line in ast.parse(path.read_text()).body:
        if not (isinstance(line, ast.Assign) and isinstance(line.targets[0], ast.Name)):
            continue
        name = line.targets[0].id
        if name.isupper() and not name.startswith("_") and name not in NO_CHOICE:
            value = evaluated(line.value, {**known, **constants})
            if not isinstance(value, str):
                constants[name] = value
    return constants


def constants_of_c(path: Path, known: Mapping[str, object]) -> dict[str, object]:
    """The constants of a file, in double precision."""
    constants: dict[str, object] = {}
    source = COMMENT.sub("", SINGLE.sub("", path.read_text()))
    for name, text in DEFINED.findall(source):
        expression = text.strip().replace("(wide)", "")
        is_other_name = expression.isidentifier() and expression not in {**known, **constants}
        if name in NO_CHOICE or is_other_name:  # such as `#define SQRT sqrt`
            continue
        node = ast.parse(expression, mode="eval").body
        constants[name] = evaluated(node, {**known, **constants})
    return constants


def numbers_in_code() -> dict[tuple[str, str], object]:
    """All constants that the page has to have, by their file and name."""
    numbers: dict[tuple[str, str], object] = {}
    shared = constants_of_python(ROOT / "finlab/arrays.py", {})
    for path in PYTHON_FILES:
        constants = constants_of_python(path, {**shared, "math.pi": math.pi})
        for name, value in constants.items():
            numbers[str(path.relative_to(ROOT)), name] = value
    in_python = {name: value for (_, name), value in numbers.items() if name in BOTH_LANGUAGES}
    of_headers: dict[str, object] = {}
    for path in HEADERS:
        of_headers.update(constants_of_c(path, of_headers))
    for path in C_FILES:
        for name, value in constants_of_c(path, of_headers).items():
            if name in BOTH_LANGUAGES:
                assert value == in_python[name], name
            else:
                numbers[str(path.relative_to(ROOT)), name] = value
    return numbers


def test_the_page_has_every_number_with_a_reason() -> None:
    rows = rows_of_page()
    in_code = numbers_in_code()
    known = {"math.pi": math.pi}
    known.update((name, value) for (_, name), value in in_code.items())  # type: ignore[misc]
    on_page = {}
    for row in rows:
        node = ast.parse(row.value.strip(), mode="eval").body
        on_page[row.file, row.name] = evaluated(node, known)
    assert on_page == in_code
    assert len(rows) == len(on_page)
    assert all(len(row.reason.split()) > 3 for row in rows)


def test_products_of_known_constants_are_numbers() -> None:
    known = {"CLOSE": 1e-4}
    for expression, value in (("R(0.1) * CLOSE", 0.1 * 1e-4), ("1 - 10 * CLOSE", 1 - 10 * 1e-4)):
        assert evaluated(ast.parse(expression, mode="eval").body, known) == value
    with pytest.raises(ValueError, match="FAR"):
        evaluated(ast.parse("2 * FAR", mode="eval").body, known)


def test_the_rows_of_the_page_are_sorted_by_file() -> None:
    files = [row.file for row in rows_of_page()]
    assert files == sorted(files)
