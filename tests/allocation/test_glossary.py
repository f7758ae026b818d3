"""The glossary says what symbols are called in code: each of these names is defined in the core, or
in what allocates, and words with one meaning name nothing else there.

A name counts where it is defined: as a module, class, function, parameter, variable or field. A
comment that has the word proves nothing. C has no such tree here: its identifiers count, without
comments and strings.
"""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROOMS = (
    "finlab/core",
    "finlab/allocation",
    "finlab/actuators",
    "finlab/physics",
    "finlab/forces",
    "finlab/layout",
)
"""Where the glossary's names are looked for."""
QUOTED = re.compile(r"`([^`]+)`")
"""Code in a cell of a table."""
NAME_COLUMN = "name in code"
"""Head of the column that is checked."""
NO_CODE_IN_C = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\])*"', re.DOTALL)
"""Comments and strings of C."""
FORBIDDEN = {
    "free": (r"n_free|free_commands?|free_numbers?", ("finlab/allocation", "finlab/physics")),
    "place": (r"places?", ("finlab/allocation", "finlab/actuators", "finlab/core/src")),
    "rest": (r"rest", ("finlab/allocation", "finlab/actuators")),
    "part": (r"parts?", ("finlab/allocation/dual", "finlab/allocation/baselines")),
}
"""Of words with one meaning: names that would give them another, and where these may not be. A
command that has a range is not free, an index no place, a residual no rest, an actuator no part."""
TURN_OF_A_LOOP = re.compile(r"\bfor \(?(?:int )?turns?\b")
"""A loop that calls its iterations turns."""
FREE_AXES = {
    "finlab/allocation/allocator.py",
    "finlab/allocation/dual/method.py",
    "finlab/allocation/method.py",
    "finlab/allocation/question.py",
    "finlab/allocation/robot_state.py",
}
"""Files in which `free` names axes."""


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


def defined_in_python(source: str) -> set[str]:
    """The names of classes, functions, parameters, variables and fields."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.arg):
            names.add(node.arg)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            names.add(node.attr)
    return names


@cache
def definitions(room: str) -> dict[str, frozenset[str]]:
    """The names that each file of a room defines, by its path; that of the file itself, too."""
    names_of_files: dict[str, frozenset[str]] = {}
    for path in sorted((ROOT / room).rglob("*")):
        if path.suffix == ".py":
            names = defined_in_python(path.read_text(encoding="utf-8"))
        elif path.suffix in {".c", ".h"} and "tests" not in path.parts[len(ROOT.parts) :]:
            code = NO_CODE_IN_C.sub(" ", path.read_text(encoding="utf-8"))
            names = set(re.findall(r"[A-Za-z_]\w*", code))
        else:
            continue
        names_of_files[path.relative_to(ROOT).as_posix()] = frozenset({path.stem, *names})
    return names_of_files


@cache
def all_defined() -> frozenset[str]:
    """What the files of all rooms define."""
    names = set[str]()
    for room in ROOMS:
        names.update(*definitions(room).values())
    return frozenset(names)


def test_the_tables_are_read() -> None:
    names = names_of_glossary()
    assert len(names) > 40
    assert {"residual", "conjugate", "block"} <= set(names)


@pytest.mark.parametrize("name", names_of_glossary())
def test_a_name_of_the_glossary_is_defined_in_the_code(name: str) -> None:
    assert set(re.findall(r"[A-Za-z_]\w*", name)) - {"result"} <= all_defined(), name


def test_a_word_in_a_comment_is_no_definition() -> None:
    source = '"""A turn."""\n\n# a rest\ndef place(part):\n    share.free = print(lost)\n'
    assert defined_in_python(source) == {"place", "part", "free"}


@pytest.mark.parametrize("word", FORBIDDEN)
def test_a_word_with_one_meaning_names_nothing_else(word: str) -> None:
    pattern, rooms = FORBIDDEN[word]
    wrong = []
    for room in rooms:
        for path, names in definitions(room).items():
            wrong += [f"{path}: {name}" for name in sorted(names) if re.fullmatch(pattern, name)]
    assert not wrong, f"{word} means something else, see docs/theory/glossary.md: {wrong}"


@pytest.mark.parametrize("room", ["finlab/allocation", "finlab/core/src"])
def test_an_iteration_is_no_turn(room: str) -> None:
    for path in definitions(room):
        assert not TURN_OF_A_LOOP.search((ROOT / path).read_text(encoding="utf-8")), path


def test_free_names_axes_alone() -> None:
    named = {path for path, names in definitions("finlab/allocation").items() if "free" in names}
    assert named == FREE_AXES
