"""Values of these rooms are plain data that never change, and compare without arrays of truth
values."""

import dataclasses
import runpy
from pathlib import Path
from typing import Any, is_typeddict

import pytest

import finlab
from finlab.allocation import Allocator

ROOMS = ("allocation", "forces", "deploy")
"""Folders of `finlab` whose classes are tested."""


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
