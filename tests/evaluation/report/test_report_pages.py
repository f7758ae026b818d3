"""The two writers, and numbers as people read them."""

from typing import Any

import pytest

from finlab.evaluation.report.document import Column, Document, Figure, Table
from finlab.evaluation.report.markdown import to_markdown
from finlab.evaluation.report.numbers import FORMATS
from finlab.evaluation.report.text import to_text

COLUMNS = (Column("name", "method"), Column("value", "error <", "error", "ends"))
ROWS: list[dict[str, Any]] = [
    {"name": "`ours`", "value": 0.00029, "ends": [0.0002, 0.0004], "_kind": "ours"},
    {"name": "theirs"},
]


class Drawn:
    """A picture that needs no matplotlib."""

    def svg(self, name: str) -> str:
        return f'<?xml version="1.0"?>\n<!DOCTYPE svg>\n<svg><path id="{name}"/></svg>'


def _drawn() -> Any:
    return Drawn()


PICTURE = Figure("dots", _drawn, "Some dots.")
DOCUMENT = Document(
    "A title & more",
    "One **line**.",
    (
        "## First section",
        "See [the docs](docs/x.md), `code` and 1 < 2.",
        Table(COLUMNS, ROWS),
        PICTURE,
        "- one\n- two",
    ),
)


def test_markdown() -> None:
    text = to_markdown(DOCUMENT, "pictures")
    assert text.startswith("# A title & more\n\nOne **line**.")
    assert "| method | error < |\n| --- | ---: |\n| **`ours`** | 0.00029 (0.00020 – 0.00040) |" in text
    assert "![Some dots.](pictures/dots.svg)" in text


def test_text_has_words_and_tables_but_draws_nothing() -> None:
    def refuse() -> Any:
        raise AssertionError("a picture was drawn")

    text = to_text(*DOCUMENT.blocks, Figure("dots", refuse, "Some dots."))
    assert "First section\n\nSee" in text and "\n- one\n- two" in text and "Some dots" not in text
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
