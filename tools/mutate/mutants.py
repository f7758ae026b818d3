"""Mutants: the small changes of a file that cosmic-ray's operators can make, and where."""

import ast
import re
from dataclasses import dataclass, field
from pathlib import Path

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

ROOT = Path(__file__).resolve().parents[2]

FAMILIES = ("Add Sub Mul Div FloorDiv Mod Pow", "BitOr BitAnd BitXor", "Eq NotEq Lt LtE Gt GtE", "Is IsNot")
"""A binary operator or a comparison becomes another of its family: a shift in place of a sum only raises."""
OTHERS = re.compile(
    r"Number|AddNot|TrueWith|FalseWith|AndWith|OrWith|Break|Continue|Exception|ZeroIteration|USub|Delete_"
)
"""What else is used of cosmic-ray's operators. Decorators stay: without one, modules mostly do not load."""


@dataclass(frozen=True)
class Mutant:
    """One small change of one file."""

    file: str
    """Path from the root of the repository."""
    line: int
    operator: str
    """cosmic-ray's name of the kind of change."""
    occurrence: int
    """Which of the places in the file where the operator can work."""
    original: str = field(repr=False, compare=False)
    """The file's text without the change."""

    def source(self) -> str:
        """The file's text with the change."""
        text = mutate_code(self.original, get_operator(self.operator)(), self.occurrence)
        assert text is not None, "every mutant was found by its operator in this very text"
        return str(text)

    def change(self) -> tuple[str, str]:
        """The text of the changed lines before and after, each on one line."""
        before, after = self.original.splitlines(), self.source().splitlines()
        first = next(i for i, pair in enumerate(zip(before, after, strict=False)) if len(set(pair)) > 1)
        last = next(
            i for i, pair in enumerate(zip(before[::-1], after[::-1], strict=False)) if len(set(pair)) > 1
        )
        old, new = (" ".join(" ".join(text[first : len(text) - last]).split()) for text in (before, after))
        return old, new


def _is_used(operator: str) -> bool:
    replaced = re.fullmatch(r"core/Replace(?:Binary|Comparison)Operator_(\w+)_(\w+)", operator)
    if replaced is None:
        return OTHERS.search(operator) is not None
    return any(set(replaced.groups()) <= set(family.split()) for family in FAMILIES)


def _no_code(text: str) -> set[tuple[int, int]]:
    """(line, column) of what can be changed in annotations, and of a bare `*` among parameters: no program
    does anything else for it."""
    stars = (n for n in ast_nodes(get_ast(text)) if n.type == "operator" and n.parent.type == "parameters")
    found: set[tuple[int, int]] = {star.start_pos for star in stars}
    for node in ast.walk(ast.parse(text)):
        for name in ("annotation", "returns"):
            for part in ast.walk(getattr(node, name, None) or ast.Pass()):
                if isinstance(part, ast.BinOp):  # the `|` lies between its two sides
                    columns = range(part.left.end_col_offset or 0, part.right.col_offset)
                    found |= {(part.lineno, column) for column in columns}
                elif isinstance(part, ast.Constant):
                    found.add((part.lineno, part.col_offset))
    return found


def find_places(file: str) -> list[list[Mutant]]:
    """All mutants of a file, those of one place together, so that a `+` weighs no more than a number."""
    text = (ROOT / file).read_text()
    nodes, skipped = list(ast_nodes(get_ast(text))), _no_code(text)
    places: dict[tuple[int, int], list[Mutant]] = {}
    for name in filter(_is_used, operator_names()):
        operator, occurrence = get_operator(name)(), 0
        for node in nodes:
            for start, _ in operator.mutation_positions(node):
                if start not in skipped:
                    places.setdefault(start, []).append(Mutant(file, start[0], name, occurrence, text))
                occurrence += 1
    return list(places.values())
