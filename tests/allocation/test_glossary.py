"""The glossary says what symbols are called in code: each of these names is in the core, or in what
allocates."""

import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("finlab/core", "finlab/allocation", "finlab/actuators", "finlab/physics")
"""Where the glossary's names are looked for."""
SUFFIXES = {".py", ".c", ".h"}
QUOTED = re.compile(r"`([^`]+)`")
NAME_COLUMN = "name in code"


def names_of_glossary() -> list[str]:
    """The names in the column of names of all tables, each once."""
    names: dict[str, None] = {}
    column: int | None = None
    for line in (ROOT / "docs" / "theory" / "glossary.md").read_text().splitlines():
        if not line.startswith("|"):
            column = None
            continue
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if NAME_COLUMN in cells:
            column = cells.index(NAME_COLUMN)
        elif column is not None:
            names |= dict.fromkeys(QUOTED.findall(cells[column]))
    return list(names)


@cache
def words_of_rooms() -> frozenset[str]:
    """All identifiers in the files of the rooms, comments included, and the files' names."""
    words: set[str] = set()
    for room in ROOMS:
        for path in (ROOT / room).rglob("*"):
            if path.suffix in SUFFIXES:
                words.add(path.stem)
                words |= set(re.findall(r"\w+", path.read_text(encoding="utf-8")))
    return frozenset(words)


def test_the_tables_are_read() -> None:
    names = names_of_glossary()
    assert len(names) > 40
    assert {"residual", "conjugate", "block"} <= set(names)


@pytest.mark.parametrize("name", names_of_glossary())
def test_a_name_of_the_glossary_is_in_the_code(name: str) -> None:
    words = words_of_rooms()
    if name.startswith("..."):
        ending = name.removeprefix("...")
        assert any(word.endswith(ending) for word in words), name
    else:
        assert set(re.findall(r"\w+", name)) <= words, name
