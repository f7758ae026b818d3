#!/usr/bin/env python3
"""Put small random faults into the code, one at a time, and see whether the tests near them fail.

    python tools/mutate.py --seed 1 --count 60

Faults are drawn by the seed from all places of `finlab/core/*.c` and `finlab/allocation` where one of these can
be made, half of them in C and half in Python:

- sign: plus for minus, minus for plus, or a minus left out;
- comparison: its opposite, such as `>=` for `<`;
- bound: the least for the greatest of two, or a loop that ends one step early;
- index: another element, such as `[1]` for `[0]`.

Each fault is made in a copy of the tree, whose core is compiled again where the fault is in C, and the tests
that `tools/near_tests.py` chooses for the file run until one fails. A test that hangs or a process that dies
has found the fault, too. What is printed as missed is to be read: some faults change no behaviour, such as a
bound that is never reached.
"""

import argparse
import ast
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tools.import_graph import ImportGraph
from tools.near_tests import ROOT, SECONDS, near_tests, one_thread, pytest_command

HANG = 60
"""Seconds after which one test counts as hung."""
OPPOSITE = {"<": ">=", ">=": "<", ">": "<=", "<=": ">", "==": "!=", "!=": "=="}
SIGNS = {"+": "-", "-": "+", "+=": "-=", "-=": "+="}
EXTREMES = {"MIN": "MAX", "MAX": "MIN", "min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum"}


@dataclass(frozen=True, order=True)
class Fault:
    """A change of a file's text."""

    file: str
    start: int
    """Where the text that is replaced begins [characters]."""
    end: int
    kind: str
    text: str
    """What stands there instead."""

    def applied(self, source: str) -> str:
        """The file's text with the fault."""
        return source[: self.start] + self.text + source[self.end :]

    def shown(self, source: str) -> str:
        """File, line, kind and both versions of the line."""
        line = source.count("\n", 0, self.start) + 1
        before = source.splitlines()[line - 1].strip()
        after = self.applied(source).splitlines()[line - 1].strip()
        return f"{self.file}:{line}: {self.kind}\n    - {before}\n    + {after}"


def python_faults(file: str, source: str) -> Iterator[Fault]:
    """Every fault that can be made in a Python file."""
    begins = [0]
    for line in source.splitlines(keepends=True):
        begins.append(begins[-1] + len(line))

    def start(node: ast.expr) -> int:
        return begins[node.lineno - 1] + node.col_offset

    def end(node: ast.expr) -> int:
        assert node.end_lineno is not None and node.end_col_offset is not None
        return begins[node.end_lineno - 1] + node.end_col_offset

    def between(left: ast.expr, right: ast.expr, signs: dict[str, str], kind: str) -> Iterator[Fault]:
        """The fault of an operator that stands between two operands."""
        found = re.search(r"[-+<>=!]+", source[end(left) : start(right)])
        if found and found[0] in signs:
            first = end(left) + found.start()
            yield Fault(file, first, first + len(found[0]), kind, signs[found[0]])

    for node in _computing(ast.parse(source)):
        if isinstance(node, ast.BinOp) and not _is_text(node.left) and not _is_text(node.right):
            yield from between(node.left, node.right, SIGNS, "sign")
        elif isinstance(node, ast.AugAssign):
            yield from between(node.target, node.value, SIGNS, "sign")
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            yield Fault(file, start(node), start(node) + 1, "sign", "")
        elif isinstance(node, ast.Compare):
            operands = [node.left, *node.comparators]
            for left, right in zip(operands, operands[1:], strict=False):
                yield from between(left, right, OPPOSITE, "comparison")
        elif isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if name in EXTREMES:
                yield Fault(file, end(node.func) - len(name), end(node.func), "bound", EXTREMES[name])
        elif isinstance(node, ast.Subscript):
            for part in ast.walk(node.slice):
                if isinstance(part, ast.Constant) and type(part.value) is int:
                    yield Fault(file, start(part), end(part), "index", str(_other_index(part.value)))


def _computing(tree: ast.Module) -> Iterator[ast.AST]:
    """The nodes of a module but those of annotations and of `axis=`, where -1 is often another word for 1."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        for field, value in ast.iter_fields(node):
            if field in ("annotation", "returns") or (isinstance(node, ast.keyword) and node.arg == "axis"):
                continue
            parts = value if isinstance(value, list) else [value]
            waiting += [part for part in parts if isinstance(part, ast.AST)]


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))


def _other_index(index: int) -> int:
    """Another index, within an array that has the first."""
    return index - 1 if index > 0 else 1


C_TOKEN = re.compile(r"[A-Za-z_]\w*|\d[\w.]*(?:[eE][-+]?\d+)?|<<|>>|->|\+\+|--|&&|\|\||[-+*/<>=!&|^%]=|.", re.S)
C_HIDDEN = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\])*"|^[ \t]*#(?:\\\n|[^\n])*', re.S | re.M)
"""Comments, strings and lines of the preprocessor."""
C_TYPE = re.compile(r"(?:const|static|unsigned|int|char|void|double|float|size_t|real|wide|fl_\w+|struct)\b")
"""How a declaration begins."""
OPERAND = re.compile(r"[\w\])]")
"""What the last character before a binary operator is."""


def c_faults(file: str, source: str) -> Iterator[Fault]:
    """Every fault that can be made in a C file, outside of comments, strings, macros and declared sizes."""
    code = C_HIDDEN.sub(lambda hidden: re.sub(r"[^\n]", " ", hidden[0]), source)
    tokens = [(found[0], found.start()) for found in C_TOKEN.finditer(code) if not found[0].isspace()]
    loops = [(found.start(), found.end()) for found in re.finditer(r"\bfor \(.*?;.*?;", code, re.S)]
    for place, (token, start) in enumerate(tokens):
        end = start + len(token)
        before = tokens[place - 1][0] if place else ";"
        after = tokens[place + 1][0] if place + 1 < len(tokens) else ";"
        in_loop = next((last for first, last in loops if first <= start < last), None)
        if token in SIGNS:
            if OPERAND.match(before[-1]) and before != "return":
                yield Fault(file, start, end, "sign", SIGNS[token])
            elif token == "-":
                yield Fault(file, start, end, "sign", "")
        elif token == "<" and in_loop is not None:
            limit = re.match(r" ([\w>.\-]+)(?=;)", code[end:in_loop])
            if limit:
                last = end + limit.end()
                yield Fault(file, end, last, "bound", f" {limit[1]} - 1")
        elif token in OPPOSITE:
            yield Fault(file, start, end, "comparison", OPPOSITE[token])
        elif token in EXTREMES and after == "(":
            yield Fault(file, start, end, "bound", EXTREMES[token])
        elif token.isdigit() and before == "[" and after == "]" and not _is_size(code, start):
            yield Fault(file, start, end, "index", str(_other_index(int(token))))


def _is_size(code: str, place: int) -> bool:
    """Whether brackets in C hold a size or stand in `sizeof`: those of a name that is being declared."""
    statement = re.split(r"[;(]|[{}]\s*\n", code[:place])[-1].strip()
    if re.search(r"sizeof [^,]*$|\(\*\w*\)\[$", code[:place].rsplit("\n", 1)[-1]):
        return True
    if not C_TYPE.match(statement):
        return False
    depth = 0
    begin = 0
    for position, letter in enumerate(statement[:-1]):
        depth += (letter in "[{") - (letter in "]}")
        if letter == "," and depth == 0:
            begin = position
    return "=" not in statement[begin:]


def drawn_faults(root: Path, count: int, seed: int) -> list[Fault]:
    """Faults drawn by a seed, half of them in C."""
    faults: dict[bool, list[Fault]] = {True: [], False: []}
    for path in sorted((root / "finlab/core").rglob("*.c")):
        file = path.relative_to(root).as_posix()
        faults[True] += c_faults(file, path.read_text(encoding="utf-8"))
    for path in sorted((root / "finlab/allocation").rglob("*.py")):
        file = path.relative_to(root).as_posix()
        faults[False] += python_faults(file, path.read_text(encoding="utf-8"))
    print(f"places: {len(faults[True])} in C, {len(faults[False])} in Python", flush=True)
    source = random.Random(seed)
    chosen = source.sample(sorted(faults[True]), count // 2)
    chosen += source.sample(sorted(faults[False]), count - count // 2)
    source.shuffle(chosen)
    return chosen


class Copy:
    """A copy of the tree in which faults are made."""

    def __init__(self, folder: str) -> None:
        """Copies what tests need.

        Args:
            folder: where to, a folder that is not there yet.
        """
        self.root = Path(folder)
        skipped = shutil.ignore_patterns(".*", "__pycache__", "build", "dist", "runs", "test-results")
        shutil.copytree(ROOT, self.root, ignore=skipped)
        self.graph = ImportGraph(self.root)
        self.environment = one_thread() | {"PYTHONPATH": str(self.root), "PYTHONDONTWRITEBYTECODE": "1"}

    def compile(self) -> str:
        """Compiles the core; returns what was wrong, or nothing."""
        command = [sys.executable, "hatch_build.py"]
        done = subprocess.run(command, cwd=self.root, env=self.environment, capture_output=True, text=True)
        return done.stderr if done.returncode else ""

    def found_by(self, fault: Fault, seconds: float) -> str:
        """What finds a fault: the compiler or the first test that fails; nothing where all pass."""
        path = self.root / fault.file
        source = path.read_text(encoding="utf-8")
        in_c = path.suffix == ".c"
        path.write_text(fault.applied(source), encoding="utf-8")
        try:
            if in_c and self.compile():
                return "the compiler"
            tests = near_tests(self.graph, [fault.file], seconds)
            options = ["-x", "-o", f"faulthandler_timeout={HANG}", "-p", "no:cacheprovider", "--tb=no"]
            code, said = self._run(pytest_command(tests, options))
        finally:
            path.write_text(source, encoding="utf-8")
        if code == 0:
            return ""
        failed = re.findall(r"^(?:FAILED|ERROR) (\S+)", said, re.M)
        return failed[0] if failed else said[-300:]

    def _run(self, command: list[str]) -> tuple[int, str]:
        """Exit status and output of a command, after which all that it started is ended."""
        process = subprocess.Popen(
            command,
            cwd=self.root,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        said, _ = process.communicate()
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        return process.returncode, said


def main() -> int:
    """Make faults and print which tests find them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--first", type=int, default=0, help="number of the fault to begin with")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="of near tests")
    parser.add_argument("--list", action="store_true", help="print the faults and make none")
    parser.add_argument("--json", type=Path, help="file for what was found")
    options = parser.parse_args()
    faults = drawn_faults(ROOT, options.count, options.seed)
    if options.list:
        for number, fault in enumerate(faults):
            print(number, fault.shown((ROOT / fault.file).read_text(encoding="utf-8")))
        return 0
    rows = list[dict[str, object]]()
    missed = list[str]()
    with tempfile.TemporaryDirectory() as folder:
        copy = Copy(os.path.join(folder, "tree"))
        copy.compile()
        for number, fault in enumerate(faults[options.first :], options.first):
            began = time.monotonic()
            found = copy.found_by(fault, options.seconds)
            shown = fault.shown((ROOT / fault.file).read_text(encoding="utf-8"))
            if not found:
                missed.append(shown)
            rows.append(asdict(fault) | {"found_by": found, "shown": shown})
            print(f"{number} {time.monotonic() - began:.0f} s {shown}", flush=True)
            print(f"    {'found by ' + found if found else 'MISSED'}", flush=True)
            if fault.file.endswith(".c"):
                copy.compile()
    print(f"{len(rows) - len(missed)} of {len(rows)} faults were found; missed:", *missed, sep="\n")
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
