"""The two writers, and numbers as people read them."""

from typing import Any

import pytest

from finlab.evaluation.document import FORMATS, Column, Table, to_markdown, to_text

COLUMNS = (Column("name", "method"), Column("value", "error <", "error", "ends"))
ROWS: list[dict[str, Any]] = [
    {"name": "`ours`", "value": 0.00029, "ends": [0.0002, 0.0004], "_kind": "ours"},
    {"name": "theirs"},
]


BLOCKS = ("# A title & more", "One **line**.", "## First section", Table(COLUMNS, ROWS), "- one\n- two")


def test_markdown() -> None:
    text = to_markdown(*BLOCKS)
    assert text.startswith("# A title & more\n\nOne **line**.")
    assert "| method | error < |\n| --- | ---: |\n| **`ours`** | 0.00029 (0.00020 – 0.00040) |" in text


def test_text_has_words_and_tables() -> None:
    text = to_text(*BLOCKS)
    assert "One **line**.\n\nFirst section\n\nmethod" in text and "\n- one\n- two" in text
    assert "method                      error <\nours    0.00029 (0.00020 – 0.00040)\ntheirs\n" in text


@pytest.mark.parametrize(
    ("name", "value", "shown"),
    [
        *(("error", v, s) for v, s in ((0.0, "0"), (2.9e-4, "0.00029"), (3.1e-13, "3.1e-13"), (1.84, "1.8"))),
        *(("three", v, s) for v, s in ((2.857, "2.86"), (178.4, "178"), (0.0, "0"))),
        *(
            ("share", v, s)
            for v, s in ((1.0, "100 %"), (0.9997, "99.97 %"), (0.488, "48.8 %"), (0.0, "0.0 %"))
        ),
        ("count", 100_000, "100,000"),
        ("ratio", 1.0021, "1.002"),
        ("metres", 0.1335, "0.1335"),
    ],
)
def test_numbers(name: str, value: float, shown: str) -> None:
    assert FORMATS[name](value) == shown
