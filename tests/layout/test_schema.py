"""The published JSON Schema and the hand-written checks accept and refuse the same files."""

import importlib.util
import json
from pathlib import Path

import jsonschema
import pytest
import yaml

from finlab import layout as layout_package
from finlab.assets import shipped_layouts
from finlab.layout.body import BODY_KEYS, HULL_KEYS, HULL_SHAPES
from finlab.layout.fin import FIN_MODELS
from finlab.layout.servo import SERVO_KEYS

SCHEMA = json.loads((Path(layout_package.__file__).parent / "layout.schema.json").read_text())
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)

_spec = importlib.util.spec_from_file_location("file_cases", Path(__file__).with_name("test_file.py"))
assert _spec is not None and _spec.loader is not None
file_cases = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(file_cases)

# What a JSON Schema cannot say, or says about values that JSON does not have.
BEYOND_A_SCHEMA = ("already the name", "is above maximum", "the maximum must", "one turn", "finite")
EXPRESSIBLE = [(data, why) for _, data, why in file_cases.BAD if not any(b in why for b in BEYOND_A_SCHEMA)]


def test_the_schema_is_a_schema():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("name", shipped_layouts())
def test_shipped_layouts_fit_the_schema(name):
    VALIDATOR.validate(yaml.safe_load(shipped_layouts()[name].read_text()))


def test_the_good_layout_fits():
    VALIDATOR.validate(file_cases.GOOD)


@pytest.mark.parametrize(("data", "why"), EXPRESSIBLE)
def test_what_the_reader_refuses_does_not_fit(data, why):
    assert not VALIDATOR.is_valid(data)


def test_the_schema_lists_the_keys_the_reader_knows():
    definitions = SCHEMA["$defs"]
    assert set(definitions["body"]["properties"]) == set(BODY_KEYS)
    assert set(definitions["servo"]["properties"]) == set(SERVO_KEYS)
    shape, mesh = definitions["hull"]["oneOf"]
    assert set(shape["properties"]) | set(mesh["properties"]) == set(HULL_KEYS)
    assert tuple(shape["properties"]["shape"]["enum"]) == HULL_SHAPES
    models = {
        m["properties"]["type"]["const"]: set(m["properties"]) - {"type"}
        for m in definitions["model"]["oneOf"]
    }
    assert models == {name: set(keys) or {"path"} for name, keys in FIN_MODELS.items()}
