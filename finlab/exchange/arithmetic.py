"""Numbers that programs write as simple arithmetic with constants of their own."""

import ast
import math
import re
from collections.abc import Mapping
from itertools import islice
from typing import Any

MOST, MOST_CONSTANTS = 200, 2000
"""Most characters of an expression, and most constants of a program."""
_NAMES: dict[str, Any] = {
    name: getattr(math, name) for name in ("sin", "cos", "tan", "sqrt", "radians", "pi")
}
_NAMES |= {f"{name}f": value for name, value in _NAMES.items()}
_NAMES |= {
    "rad": math.radians,
    "abs": abs,
    "fabsf": abs,
    "M_PI": math.pi,
    "PI": math.pi,
    "M_PI_2": math.pi / 2,
}
_NAMES |= {"M_PI_4": math.pi / 4, "M_SQRT2": math.sqrt(2), "M_SQRT1_2": math.sqrt(0.5)}
_ALLOWED = (
    *(ast.Expression, ast.BinOp, ast.UnaryOp, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.USub, ast.UAdd),
    *(ast.Constant, ast.Name, ast.Load, ast.Call),
)
"""What an expression may be made of."""
_WRITTEN = re.compile(r"(?<![\w.])(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)[fFlL]\b|std::|math\.")
_DEFINED = re.compile(
    r"^[ \t]*(?:#[ \t]*define[ \t]+(\w+)[ \t]+(?!\()"
    r"|(?:(?:static|const|constexpr|local|float|double)[ \t]+)+(\w+)[ \t]*=[ \t]*)([^;\n]{1,200})",
    re.MULTILINE,
)


def value_of(text: str, constants: Mapping[str, float]) -> float:
    """Returns the value of numbers, constants, + - * /, brackets and functions such as `cosf(radians(45))`.
    ValueError: it is something else, or not finite; the message names what is not known."""
    what, names = f"{text.strip()!r:.60}", {**_NAMES, **constants}
    try:
        if len(text) > MOST:
            raise SyntaxError
        tree = ast.parse(_WRITTEN.sub(r"\1", text.strip()), mode="eval")
        for node in ast.walk(tree):
            number = not isinstance(node, ast.Constant) or type(node.value) in (int, float)
            if not isinstance(node, _ALLOWED) or not number:
                raise SyntaxError
            if isinstance(node, ast.Name) and node.id not in names:
                raise ValueError(f"{node.id!r:.60} is not defined in the file")
        value = float(eval(compile(tree, "", "eval"), {"__builtins__": {}}, names))
    except (SyntaxError, TypeError, ArithmeticError, RecursionError, MemoryError):
        raise ValueError(f"{what} is no number") from None
    if not abs(value) < 1e9:
        raise ValueError(f"{what} is no number of ordinary size")
    return value


def constants_in(text: str) -> dict[str, float]:
    """Returns the constants that a program of C++ or Lua defines once, by name; others are left out."""
    values: dict[str, float] = {}
    twice: set[str] = set()
    for found in islice(_DEFINED.finditer(text), MOST_CONSTANTS):
        name = found[1] or found[2]
        twice |= {name} & values.keys()
        try:
            values[name] = value_of(found[3], values)
        except ValueError:
            continue
    return {name: value for name, value in values.items() if name not in twice}
