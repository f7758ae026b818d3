"""Hashes of what a figure depends on: source files without their comments, and weights."""

import ast
import hashlib
import io
import re
import tokenize
from collections.abc import Iterable
from pathlib import Path

import finlab

TREE = Path(finlab.__file__).parents[1]
"""The folder of the source tree."""
SOURCES = (".py", ".c", ".h", ".yaml", ".safetensors")
"""Endings of the files of a folder that count."""
WITHOUT = ("training", "__pycache__")
"""Folders within a package that answer no question."""
C_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
"""A comment in C; none of our strings contains its marks."""


def package_hashes(packages: Iterable[str]) -> dict[str, str]:
    """Returns a hash of each package: of its sources as a compiler sees them.

    Words in comments and docstrings, blank lines and the breaking of lines do not count.

    Args:
        packages: paths of folders or files in the source tree, such as `finlab/research/paper`.
    """
    return {package: _hash_of(TREE / package) for package in sorted(set(packages))}


def _hash_of(path: Path) -> str:
    """The first digits of the SHA-256 of a file, or of all files of a folder."""
    sha256 = hashlib.sha256()
    for file in [path] if path.is_file() else _files_of(path):
        content = meaning(file)
        sha256.update(len(content).to_bytes(8, "big"))
        sha256.update(content)
    return sha256.hexdigest()[:16]


def _files_of(folder: Path) -> list[Path]:
    """Files of a folder that count, in the order of their paths."""
    files = []
    for file in sorted(folder.rglob("*")):
        inner = file.relative_to(folder).parts[:-1]
        if file.suffix in SOURCES and not set(inner) & set(WITHOUT):
            files.append(file)
    return files


def meaning(file: Path) -> bytes:
    """Returns what of a file has an effect: of Python and C without comments, docstrings and spaces
    more than one."""
    if file.suffix == ".py":
        text = _python_without_words(file.read_text("utf-8"))
    elif file.suffix in (".c", ".h"):
        text = C_COMMENT.sub(" ", file.read_text("utf-8"))
    else:
        return file.read_bytes()
    return " ".join(text.split()).encode()


def _python_without_words(source: str) -> str:
    """Python source without comments and strings that stand alone, such as docstrings."""
    lines = source.splitlines(keepends=True)
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            row, column = token.start
            lines[row - 1] = lines[row - 1][:column] + "\n"
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Expr) or not isinstance(node.value, ast.Constant):
            continue
        if isinstance(node.value.value, str):
            first = node.lineno - 1
            last = node.end_lineno or node.lineno
            lines[first:last] = ["\n"] * (last - first)
    return "".join(lines)
