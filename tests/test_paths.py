"""Each file that a comment, a docstring or a page names by its path is there."""

import ast
import io
import re
import subprocess
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PATH = re.compile(r"(?<![\w/.-])(?:finlab|tests|webapp|tools)/[\w./*\[\]-]*\.(?:py|c|h)\b")
"""A path from the top of the tree, or a pattern of paths: `*` stands for a part of a name."""
FOLDERS = ("finlab", "tests", "webapp", "tools", "examples", "docs")
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
