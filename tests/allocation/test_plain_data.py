"""Values are plain data that never change; the page of the default method has every number set by
hand."""

import ast
import dataclasses
import re
import runpy
from pathlib import Path
from typing import Any, is_typeddict

import pytest

import finlab
from finlab.allocation import Allocator

ROOMS = ("allocation", "forces", "deploy")


def classes(room: str) -> dict[str, Any]:
    """All classes that the modules of a room define, made anew."""
    found = {}
    for path in sorted((Path(finlab.__file__).parent / room).rglob("*.py")):
        module = runpy.run_path(str(path), run_name="anew")
        found |= {
            f"{path.stem}.{name}": made
            for name, made in module.items()
            if isinstance(made, type) and made.__module__ == "anew"
        }
    return found


@pytest.mark.parametrize("room", ROOMS)
def test_values_do_not_change_and_no_option_is_required(room: str) -> None:
    """The generated `==` of two arrays is no yes or no: classes with arrays have their own, or
    none."""
    made = classes(room)
    classes_of_data = {name: each for name, each in made.items() if dataclasses.is_dataclass(each)}
    methods = {name: each for name, each in classes_of_data.items() if issubclass(each, Allocator)}
    values = {name: each for name, each in classes_of_data.items() if name not in methods}
    assert values
    for name, each in values.items():
        assert each.__dataclass_params__.frozen, name
        arrays = any("array" in str(field.type).lower() for field in dataclasses.fields(each))
        assert each.__dataclass_params__.eq != arrays, name
    for name, each in made.items():
        assert not is_typeddict(each) or not each.__required_keys__, name
    # Methods are no values: each is itself alone, and its caches are nothing to print.
    for name, each in methods.items():
        assert not each.__dataclass_params__.eq and not each.__dataclass_params__.repr, name


ROOT = Path(__file__).resolve().parents[2]
ROW = re.compile(r"^\| `(\w+)` \| ([^|]+) \| `([^`|]+)` \| ([^|]+) \|$", re.MULTILINE)
FILES = [
    ROOT / "finlab/arrays.py",
    ROOT / "finlab/allocation/levenberg_marquardt.py",
    *sorted((ROOT / "finlab/allocation/dual").glob("*.py")),
    *(
        ROOT / "finlab/actuators" / f"{name}.py"
        for name in ("response", "fin/fin_response", "thruster")
    ),
    *(ROOT / "finlab/actuators" / f"{name}.py" for name in ("rudder", "thrust_power", "kinds")),
]


CORE = sorted((ROOT / "finlab/core").rglob("*.[ch]"))
DEFINED = re.compile(r"^#define (\w+) (?:R\()?([\d.]+(?:e-?\d+)?)\b", re.MULTILINE)
DOUBLE = re.compile(r"^#ifdef FL_SINGLE\n.*?^#else\n", re.MULTILINE | re.DOTALL)
NO_CHOICE = {
    "PI",
    "TINY",
    "LARGEST",
    "NONE",
    "FL_MOST",
    "FL_VERSION",
    "FL_MAGIC",
    "FL_POINTS",
    "FL_SCORES",
}


def numbers(path: Path) -> dict[str, object]:
    """The public constants of a file that are numbers, or tuples of them."""
    found = {}
    for line in ast.parse(path.read_text()).body:
        if not (isinstance(line, ast.Assign) and isinstance(line.targets[0], ast.Name)):
            continue
        name = line.targets[0].id
        if name.isupper() and not name.startswith("_"):
            try:
                found[name] = ast.literal_eval(line.value)
            except ValueError:
                continue
    return found


def test_the_page_has_every_number_with_a_reason() -> None:
    rows = ROW.findall((ROOT / "docs" / "theory" / "method.md").read_text())
    told = {(where, name): ast.literal_eval(value) for name, value, where, _ in rows}
    known = {
        (str(path.relative_to(ROOT)), name): value
        for path in FILES
        for name, value in numbers(path).items()
    }
    for path in CORE:
        for name, text in DEFINED.findall(DOUBLE.sub("", path.read_text())):
            same = [value for (_, other), value in known.items() if other == name]
            if same:  # said in both languages
                assert float(text) in same, name
            elif name not in NO_CHOICE:
                known[str(path.relative_to(ROOT)), name] = ast.literal_eval(text)
    assert told == known
    assert len(rows) == len(told)
    assert all(len(reason.split()) > 3 for *_, reason in rows)
