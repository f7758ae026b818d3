"""Small faults that can be made in sources: signs, comparisons, bounds and indices.

Python is read by its syntax tree. C is read by its tokens, outside of comments, strings, lines of
the preprocessor and sizes of arrays.
"""

import ast
import random
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

OPPOSITE = {"<": ">=", ">=": "<", ">": "<=", "<=": ">", "==": "!=", "!=": "=="}
SIGNS = {"+": "-", "-": "+", "+=": "-=", "-=": "+="}
TOLERANCE = re.compile(
    r"\s*(?:\d+\.?\d* \* )?"
    r"(?:NOTHING|NEARLY|CLOSE|FINE|ROUNDING|BARELY|TINY|CHEAPER|TABLE_ERROR|0\.0)\b"
)
"""What a sign may stand before that gives a tolerance: the fault then changes a limit by itself
alone, and mostly no answer."""
EXTREMES = {
    "MIN": "MAX",
    "MAX": "MIN",
    "min": "max",
    "max": "min",
    "minimum": "maximum",
    "maximum": "minimum",
}


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

    def is_of_tolerance(self, source: str) -> bool:
        """Whether the fault turns round the sign of a tolerance and nothing else, by the look of
        the text behind it."""
        return self.kind == "sign" and bool(TOLERANCE.match(source, self.end))

    def shown(self, source: str) -> str:
        """File, line, kind and both versions of the line."""
        line = source.count("\n", 0, self.start) + 1
        before = source.splitlines()[line - 1].strip()
        after = self.applied(source).splitlines()[line - 1].strip()
        return f"{self.file}:{line}: {self.kind}\n    - {before}\n    + {after}"


class PythonFile:
    """A Python file whose places for faults are looked for."""

    def __init__(self, file: str, source: str) -> None:
        """Reads a file.

        Args:
            file: its path.
            source: its text.
        """
        self.file = file
        self.source = source
        self.begins = [0]
        for line in source.splitlines(keepends=True):
            self.begins.append(self.begins[-1] + len(line))

    def start(self, node: ast.expr) -> int:
        """Where an expression begins in the text."""
        return self.begins[node.lineno - 1] + node.col_offset

    def end(self, node: ast.expr) -> int:
        """Where an expression ends in the text."""
        assert node.end_lineno is not None and node.end_col_offset is not None
        return self.begins[node.end_lineno - 1] + node.end_col_offset

    def faults(self) -> Iterator[Fault]:
        """Every fault that can be made in the file."""
        for node in _computing(ast.parse(self.source)):
            if isinstance(node, ast.BinOp | ast.AugAssign | ast.UnaryOp):
                yield from self._signs(node)
            elif isinstance(node, ast.Compare):
                operands = [node.left, *node.comparators]
                for left, right in zip(operands, operands[1:], strict=False):
                    yield from self._between(left, right, OPPOSITE, "comparison")
            elif isinstance(node, ast.Call):
                yield from self._bounds(node)
            elif isinstance(node, ast.Subscript):
                yield from self._indices(node)

    def _signs(self, node: ast.BinOp | ast.AugAssign | ast.UnaryOp) -> Iterator[Fault]:
        if isinstance(node, ast.UnaryOp):
            if isinstance(node.op, ast.USub):
                yield Fault(self.file, self.start(node), self.start(node) + 1, "sign", "")
        elif isinstance(node, ast.AugAssign):
            yield from self._between(node.target, node.value, SIGNS, "sign")
        elif not _is_text(node.left) and not _is_text(node.right):
            yield from self._between(node.left, node.right, SIGNS, "sign")

    def _between(
        self, left: ast.expr, right: ast.expr, others: dict[str, str], kind: str
    ) -> Iterator[Fault]:
        """The fault of an operator that stands between two operands."""
        found = re.search(r"[-+<>=!]+", self.source[self.end(left) : self.start(right)])
        if found and found[0] in others:
            first = self.end(left) + found.start()
            yield Fault(self.file, first, first + len(found[0]), kind, others[found[0]])

    def _bounds(self, node: ast.Call) -> Iterator[Fault]:
        function = node.func
        name = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
        if name in EXTREMES:
            end = self.end(function)
            yield Fault(self.file, end - len(name), end, "bound", EXTREMES[name])

    def _indices(self, node: ast.Subscript) -> Iterator[Fault]:
        for part in ast.walk(node.slice):
            if isinstance(part, ast.Constant) and type(part.value) is int:
                text = str(_other_index(part.value))
                yield Fault(self.file, self.start(part), self.end(part), "index", text)


def _computing(tree: ast.Module) -> Iterator[ast.AST]:
    """The nodes of a module but those of annotations and of `axis=`, where -1 is often another word
    for 1."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        for field, value in ast.iter_fields(node):
            if field in ("annotation", "returns") or (
                isinstance(node, ast.keyword) and node.arg == "axis"
            ):
                continue
            parts = value if isinstance(value, list) else [value]
            waiting += [part for part in parts if isinstance(part, ast.AST)]


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


def _other_index(index: int) -> int:
    """Another index, within an array that has the first."""
    return index - 1 if index > 0 else 1


C_TOKEN = re.compile(
    r"[A-Za-z_]\w*|\d[\w.]*(?:[eE][-+]?\d+)?|<<|>>|->|\+\+|--|&&|\|\||[-+*/<>=!&|^%]=|.", re.S
)
C_HIDDEN = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\])*"|^[ \t]*#(?:\\\n|[^\n])*', re.S | re.M)
"""Comments, strings and lines of the preprocessor."""
C_TYPE = re.compile(
    r"(?:const|static|unsigned|int|char|void|double|float|size_t|real|wide|fl_\w+|struct)\b"
)
"""How a declaration begins."""
OPERAND = re.compile(r"[\w\])]")
"""What the last character before a binary operator is."""


def c_faults(file: str, source: str) -> Iterator[Fault]:
    """Every fault that can be made in a C file, outside of comments, strings, macros and declared
    sizes."""
    code = C_HIDDEN.sub(lambda hidden: re.sub(r"[^\n]", " ", hidden[0]), source)
    tokens = [
        (found[0], found.start()) for found in C_TOKEN.finditer(code) if not found[0].isspace()
    ]
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
    """Whether brackets in C hold a size or stand in `sizeof`: those of a name that is being
    declared."""
    statement = re.split(r"[;(]|[{}]\s*\n", _without_calls(code[:place]))[-1].strip()
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


def _without_calls(code: str) -> str:
    """The last lines of some C without what stands in parentheses that are closed."""
    text = code[-400:]
    shorter = re.sub(r"\([^()]*\)", "", text)
    while shorter != text:
        text = shorter
        shorter = re.sub(r"\([^()]*\)", "", shorter)
    return text


def faults_of(root: Path, file: str) -> list[Fault]:
    """Every fault that can be made in a file, in the order of its text."""
    source = (root / file).read_text(encoding="utf-8")
    return sorted(
        c_faults(file, source) if file.endswith(".c") else PythonFile(file, source).faults()
    )


def drawn_fault(root: Path, file: str, seed: int) -> Fault:
    """A fault of one file, drawn by a seed."""
    return random.Random(f"{seed} {file}").choice(faults_of(root, file))


def drawn_faults(root: Path, count: int, seed: int) -> list[Fault]:
    """Faults of the core and of `finlab/allocation` drawn by a seed, half of them in C."""
    source = random.Random(seed)
    chosen = list[Fault]()
    for folder, pattern, share in (
        ("finlab/core/src", "*.c", count // 2),
        ("finlab/allocation", "*.py", count - count // 2),
    ):
        files = [
            path.relative_to(root).as_posix() for path in sorted((root / folder).rglob(pattern))
        ]
        faults = [fault for file in files for fault in faults_of(root, file)]
        print(f"{len(faults)} places in {folder}", flush=True)
        chosen += source.sample(faults, share)
    source.shuffle(chosen)
    return chosen
