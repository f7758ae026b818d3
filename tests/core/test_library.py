"""The core as a C library that others link: warnings, names of the linker, several robots in one
program."""

import itertools
import re
import subprocess
from pathlib import Path

import pytest

from finlab import core
from finlab.core import PATH, SIGNATURES
from finlab.deploy.c_sources import c_sources, write_c
from finlab.layout import load_layout

CORE_FOLDER = Path(core.__path__[0])
"""The core's headers and sources."""
STRICT_FLAGS = [
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wshadow",
    "-pedantic",
    "-Wmissing-prototypes",
    "-Werror",
]
"""Options of the C compiler: warnings that users of a library may have on."""
MOST_COLUMNS = 100
"""Columns of a line of C; clang-format wraps code there, but leaves comments as they are."""
TWO_ROBOTS_PROGRAM = """
#include "A/fl_a.h"
#include "catamaran/fl_catamaran.h"
#include <cmath>

int main() {
  const double wrench[6] = {1, 0, 0, 0, 0, 0};
  const double broken[6] = {NAN, 0, 0, 0, 0, 0};
  double fins[FL_A_COUNT][3];
  double later[FL_A_COUNT][3];
  double pods[FL_CATAMARAN_COUNT][3];
  if (fl_a_allocate(wrench, nullptr, fins) || fl_catamaran_allocate(wrench, nullptr, pods)) return 1;
  if (fl_a_allocate(wrench, fins, later)) return 2;
  if (!fl_a_allocate(broken, nullptr, later)) return 3;
  if (!(pods[FL_CATAMARAN_LEFT][1] > 0)) return 4;
  return fl_a_selftest() + fl_catamaran_selftest();
}
"""
"""A program in C++ that links the exports of two robots and asks each."""


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("single", [[], ["-DFL_SINGLE"]], ids=["double", "single"])
def test_no_compiler_warns(compiler: str, single: list[str]) -> None:
    for source in sorted((CORE_FOLDER / "src").glob("*.c")):
        words = [compiler, *STRICT_FLAGS, *single, "-fsyntax-only", f"-I{CORE_FOLDER}", str(source)]
        subprocess.run(words, check=True)


def test_lines_of_c_end_at_100_columns() -> None:
    sources = [*CORE_FOLDER.glob("*.h"), *CORE_FOLDER.glob("src/*.[ch]")]
    too_long = []
    for source in sources:
        for number, line in enumerate(source.read_text(encoding="utf-8").splitlines(), start=1):
            if len(line) > MOST_COLUMNS:
                too_long.append(f"{source.name}:{number}")
    assert len(sources) > 20
    assert not too_long


def _global_names(binary: Path) -> set[str]:
    """Names that an object file or a library defines for the linker."""
    words = ["nm", "-g", "--defined-only", str(binary)]
    text = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    return {line.split()[-1] for line in text.splitlines() if len(line.split()) == 3}


def test_the_linker_sees_no_name_without_prefix() -> None:
    names = {name for name in _global_names(PATH) if not name.startswith("_")}
    assert "fl_answer_one" in names
    assert not {name for name in names if not name.startswith("fl_")}


def test_two_robots_link_into_a_program_in_cpp(tmp_path: Path) -> None:
    objects = []
    for name in ("A", "catamaran"):
        folder = tmp_path / name
        write_c(c_sources(load_layout(name)), folder)
        for source in sorted(folder.glob("*.c")):
            object_file = folder / f"{source.stem}.o"
            words = [
                "gcc",
                *STRICT_FLAGS,
                "-DFL_NO_MAIN",
                "-c",
                str(source),
                "-o",
                str(object_file),
            ]
            subprocess.run(words, check=True, cwd=folder)
            objects.append(object_file)
    names = set(itertools.chain.from_iterable(map(_global_names, objects)))
    assert {"fl_a_answer_one", "fl_catamaran_answer_one"} < names
    assert not {name for name in names if not name.startswith("fl_")}
    (tmp_path / "main.cpp").write_text(TWO_ROBOTS_PROGRAM)
    program = tmp_path / "main"
    words = ["g++", "-std=c++17", "-Wall", "-Wextra", "-pedantic", "-Werror", "main.cpp"]
    subprocess.run(
        [*words, *map(str, objects), "-lm", "-o", str(program)], check=True, cwd=tmp_path
    )
    subprocess.run([str(program)], check=True)


_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
"""A comment of C."""
_PROTOTYPE = re.compile(
    r"^(int|void|fl_real|const char \*|const void \*)\s*(fl_\w+)\(([^()]*)\);", re.MULTILINE
)
"""A function of `finlab.h`: what it returns, its name, its arguments."""


def _letter(declaration: str) -> str:
    """The letter of `SIGNATURES` for the type of an argument or of a returned value."""
    if "char *" in declaration and "unsigned" not in declaration:
        return "s"
    if "*" in declaration:
        return "p"
    letters = {"int": "i", "fl_real": "r", "fl_wide": "r", "void": "v"}
    return letters[declaration.split()[0]]


def _declared_signatures() -> dict[str, str]:
    """The signatures of all functions of `finlab.h`, in the letters of `SIGNATURES`."""
    header = _COMMENT.sub("", (CORE_FOLDER / "finlab.h").read_text(encoding="utf-8"))
    signatures = {}
    for returned, name, arguments in _PROTOTYPE.findall(header):
        letters = [_letter(returned)]
        if arguments != "void":
            letters += [_letter(argument) for argument in arguments.split(",")]
        signatures[name] = "".join(letters)
    return signatures


def test_python_calls_each_function_by_the_signature_of_the_header() -> None:
    declared = _declared_signatures()
    assert SIGNATURES.keys() <= declared.keys()
    assert {name: declared[name] for name in SIGNATURES} == SIGNATURES


def test_every_header_compiles_alone_in_c_and_cpp() -> None:
    for header in ("finlab.h", "fl_work.h"):
        for words in (
            ["gcc", *STRICT_FLAGS],
            ["g++", "-std=c++17", "-Wall", "-pedantic", "-Werror"],
        ):
            language = "c" if words[0] == "gcc" else "c++"
            command = [*words, "-x", language, "-fsyntax-only", str(CORE_FOLDER / header)]
            subprocess.run(command, check=True)
