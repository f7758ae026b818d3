"""The published JSON Schemas are those of the types that files are read with."""

import json
from pathlib import Path

import jsonschema
import pytest
import yaml

from finlab.assets import shipped_layouts
from tests.layout.test_file import BAD_VALUES, GOOD_LAYOUT
from tools.schemas import PACKAGE, schemas

VALIDATOR = jsonschema.Draft202012Validator(
    json.loads((PACKAGE / "layout/layout.schema.json").read_text())
)
"""Of the published schema of layouts."""
BEYOND_A_SCHEMA = (
    ".nan",
    ".inf",
    "already the name",
    "above maximum",
    "the maximum must",
    "one turn",
    "beside",
    "either",
    ".stl",
)
"""What refusals say of errors that no JSON Schema can express."""


@pytest.mark.parametrize("path", schemas(), ids=lambda path: path.name)
def test_the_schemas_are_current(path: Path) -> None:
    assert path.read_text() == schemas()[path], "run `make schemas`"
    jsonschema.Draft202012Validator.check_schema(json.loads(path.read_text()))


def test_good_layouts_fit_and_bad_ones_do_not() -> None:
    for path in shipped_layouts().values():
        VALIDATOR.validate(yaml.safe_load(path.read_text()))
    VALIDATOR.validate(GOOD_LAYOUT)
    wrong = [
        data for _, data, why in BAD_VALUES if not any(words in why for words in BEYOND_A_SCHEMA)
    ]
    assert not [data for data in wrong if VALIDATOR.is_valid(data)]
