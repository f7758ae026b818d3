"""Each file that a comment, a docstring or a page names by its path is there."""

import ast
import io
import re
import subprocess
import tokenize
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PATH = re.compile(r"(?<![\w/.-])(?:finlab|tests|webapp|tools|ros2)/[\w./*\[\]-]*\.(?:py|c|h)\b")
"""A path from the top of the tree, or a pattern of paths: `*` stands for a part of a name."""
SHORT_PATH = re.compile(r"`((?:[\w.-]+/)*[\w-]+\.(?:py|c|h))`")
"""A file on a page, by its name alone or with some of its folders."""
FOLDER = re.compile(r"`((?:finlab|tests|webapp|tools|docs|ros2)(?:/\w+)*)(?:/|/\*\.py)?`")
"""A folder on a page, or all Python files in it, from the top of the tree."""
NOT_OF_THE_TREE = {"math.h", "robot.c", "robot.h", "water_jet.py"}
"""Files that pages name and that are no files of ours: C's own, exported ones, a reader's."""
FOLDERS = ("finlab", "tests", "webapp", "tools", "examples", "docs", "ros2")
"""Folders whose comments and pages are read."""
HISTORY = {"CHANGELOG.md"}
"""Pages that name what was there once."""


def prose_of(source: str) -> Iterator[str]:
    """The comments of a Python file, and its strings that are statements: docstrings."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.string
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            yield str(node.value.value)


def missing_paths(text: str) -> list[str]:
    """The paths and patterns in a text that no file has."""
    return [named for named in PATH.findall(text) if not any(ROOT.glob(named))]


def unclear_files(page: str, tree: Sequence[str]) -> list[str]:
    """The files on a page that a reader cannot find: neither in a folder that their line names, nor
    the only ones in the `tree` whose paths end so."""
    unclear = []
    for line in page.splitlines():
        folders = [ROOT / folder for folder in FOLDER.findall(line)]
        for name in SHORT_PATH.findall(line):
            if name in NOT_OF_THE_TREE or (ROOT / name).exists():
                continue
            in_folder = any((folder / name).exists() for folder in folders)
            ends_so = [path for path in tree if path.endswith(f"/{name}")]
            if not in_folder and len(ends_so) != 1:
                unclear.append(name)
    return unclear


def files() -> list[Path]:
    """Sources and pages, from the top of the tree."""
    found = [page for page in ROOT.glob("*.md") if page.name not in HISTORY]
    for folder in FOLDERS:
        for suffix in ("py", "c", "h", "md"):
            found += (ROOT / folder).rglob(f"*.{suffix}")
    return sorted(found)


def test_a_missing_file_is_found() -> None:
    text = "see finlab/axes.py, finlab/core/src/*.c and finlab/core/*.c, in tests/nowhere.py"
    assert missing_paths(text) == ["finlab/core/*.c", "tests/nowhere.py"]
    assert list(prose_of('"""A."""\n\nX = "B"  # C\n')) == ["# C", "A."]


@pytest.mark.parametrize("folder", [".", *FOLDERS])
def test_the_files_that_are_named_are_there(folder: str) -> None:
    wrong = []
    for path in files():
        name = path.relative_to(ROOT)
        if (name.parts[0] if len(name.parts) > 1 else ".") != folder:
            continue
        text = path.read_text(encoding="utf-8")
        prose = "\n".join(prose_of(text)) if path.suffix == ".py" else text
        wrong += [f"{name}: {missing}" for missing in missing_paths(prose)]
    assert not wrong, wrong


def test_a_file_that_no_reader_finds_is_unclear() -> None:
    tree = ["finlab/a.py", "finlab/core/a.py", "finlab/axes.py"]
    assert unclear_files("`axes.py`, `core/a.py` and `finlab/axes.py`", tree) == []
    assert unclear_files("| `finlab/core` | `calls.py` |", tree) == []
    assert unclear_files("| `finlab/core` | `axes.c` |\n`a.py`, `calls.py`", tree) == [
        "axes.c",
        "a.py",
        "calls.py",
    ]


def test_files_that_pages_name_by_their_ends_are_found() -> None:
    paths = [path.relative_to(ROOT) for path in files()]
    tree = [path.as_posix() for path in paths]
    unclear = []
    for path in paths:
        if path.suffix == ".md" and path.parts[0] in ("docs", "DEVELOPMENT.md", "CONTRIBUTING.md"):
            text = (ROOT / path).read_text(encoding="utf-8")
            unclear += [f"{path}: {name}" for name in unclear_files(text, tree)]
    assert not unclear, unclear


PATCH = re.compile(r'^```diff title="([^"]+)"\n(.*?)^```$', re.MULTILINE | re.DOTALL)
"""A patch of the tree on a page: its title, and the patch."""


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="no clone: git reads no patch here")
def test_patches_on_pages_apply_to_this_tree() -> None:
    """The site applies them when it is built; this says it after each change of the sources."""
    stale = []
    for page in sorted((ROOT / "docs").rglob("*.md")):
        for title, patch in PATCH.findall(page.read_text(encoding="utf-8")):
            check = ["git", "apply", "--check", "-"]
            done = subprocess.run(check, cwd=ROOT, input=patch, capture_output=True, text=True)
            if done.returncode:
                stale.append(f"{page.relative_to(ROOT)}, {title}: {done.stderr.strip()}")
    assert not stale, "\n".join(stale)
