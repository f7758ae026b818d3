"""Numbers that programs write as simple arithmetic with constants of their own."""

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping
from itertools import islice

MOST, MOST_CONSTANTS = 200, 2000
"""Most characters of an expression, and most constants of a program."""
CONSTANTS = {"pi": math.pi, "M_PI": math.pi, "M_PI_2": math.pi / 2, "M_PI_4": math.pi / 4, "PI": math.pi}
CONSTANTS |= {"M_SQRT2": math.sqrt(2), "M_SQRT1_2": math.sqrt(0.5), "math.pi": math.pi}
_OPERATORS: dict[type[ast.AST], Callable[[float, float], float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv
}  # fmt: skip
_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "sin": math.sin, "cos": math.cos, "tan": math.tan, "sqrt": math.sqrt, "radians": math.radians,
    "rad": math.radians, "abs": abs, "float": float, "deg": math.degrees,
}  # fmt: skip
_SUFFIX = re.compile(r"(?<![\w.])(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)[fFlL]\b")
_DEFINED = re.compile(
    r"^[ \t]*(?:#[ \t]*define[ \t]+(\w+)[ \t]+(?!\()"
    r"|(?:(?:static|const|constexpr|local|float|double)[ \t]+)+(\w+)[ \t]*=[ \t]*)([^;\n]{1,200})",
    re.MULTILINE,
)


def value_of(text: str, constants: Mapping[str, float]) -> float:
    """Returns the value of numbers, constants, + - * /, brackets and functions such as `cosf(radians(45))`.

    Raises:
        ValueError: it is something else, or not finite; the message names what is not known.
    """
    if len(text) > MOST:
        raise ValueError(f"is longer than {MOST} characters")
    cleaned = _SUFFIX.sub(r"\1", text.strip()).replace("std::", "")
    try:
        value = _value(ast.parse(cleaned, mode="eval").body, {**CONSTANTS, **constants})
    except (SyntaxError, RecursionError, MemoryError):
        raise ValueError(f"{text.strip()!r:.60} is no number") from None
    except (ArithmeticError, TypeError) as error:
        raise ValueError(f"{text.strip()!r:.60}: {error}") from None
    if not abs(value) < 1e9:
        raise ValueError(f"{text.strip()!r:.60} is no number of ordinary size")
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


def _value(node: ast.expr, constants: Mapping[str, float]) -> float:
    match node:
        case ast.Constant(value=float() | int() as number) if not isinstance(number, bool):
            return float(number)
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return -_value(inner, constants)
        case ast.UnaryOp(op=ast.UAdd(), operand=inner):
            return _value(inner, constants)
        case ast.BinOp(left=left, op=kind, right=right) if type(kind) in _OPERATORS:
            return _OPERATORS[type(kind)](_value(left, constants), _value(right, constants))
        case ast.Name() | ast.Attribute() if (name := ast.unparse(node)) in constants:
            return constants[name]
        case ast.Call(func=called, args=[inner], keywords=[]):
            function = _FUNCTIONS.get(ast.unparse(called).removeprefix("math.").removesuffix("f"))
            if function is not None:
                return function(_value(inner, constants))
    raise ValueError(f"{ast.unparse(node)!r:.60} is not defined in the file")
