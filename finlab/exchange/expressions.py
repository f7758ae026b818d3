"""Expressions in a stranger's robot description: numbers, names, arithmetic, and nothing that runs.

Python's parser takes an expression apart; it is never compiled. All of it is judged before any of
it is worked out, and what is not listed here is refused: attributes of Python's objects, functions
of Python, names that lead to either. Values have a bounded size, so `9**9**9` ends at once.
"""

import ast
import math
import operator
import re
import warnings
from collections.abc import Callable
from typing import Any

from finlab.errors import LayoutError

MAX_LENGTH, MAX_DEPTH = 2000, 100
"""Longest expression [characters], and deepest; ordinary ones have fewer than 200, and than 20."""
MAX_BITS, MAX_TEXT, MAX_ITEMS = 256, 10_000, 1000
"""Largest whole number [bits], longest text [characters], most values in a list of lists."""
MAX_DIGITS = 30
"""Most digits that a number is rounded to, on either side of the point."""
EXPECTED = "expected numbers, names, arithmetic and functions of numbers: write the value instead"

Lookup = Callable[[str], Any]
"""Returns the value that has a name; a KeyError where nothing has it."""


def _rounded(number: float, digits: int | None = None) -> float:
    """As `round`, which takes a whole number to as many digits as it is told."""
    if digits is not None and abs(digits) > MAX_DIGITS:
        raise ValueError(f"more than {MAX_DIGITS} digits")
    return round(number, digits)


def _counted(*ends: int) -> list[int]:
    """As `range`, written out."""
    numbers = range(*ends)
    if len(numbers) > MAX_ITEMS:
        raise ValueError(f"more than {MAX_ITEMS} numbers")
    return list(numbers)


def _no_words(*_: object) -> str:
    """What xacro's functions that print a message give."""
    return ""


_OF_MATH = (
    *("acos", "asin", "atan", "atan2", "cos", "sin", "tan", "degrees", "radians", "hypot", "dist"),
    *("acosh", "asinh", "atanh", "cosh", "sinh", "tanh", "sqrt", "exp", "expm1", "pow"),
    *("log", "log10", "log1p", "log2", "ceil", "floor", "trunc", "fabs", "fmod", "remainder"),
    *("fsum", "copysign", "gcd", "isclose", "isfinite", "isinf", "isnan"),
)
_MATH: dict[str, Callable[..., Any]] = {name: getattr(math, name) for name in _OF_MATH}
_PYTHON: dict[str, Callable[..., Any]] = {
    "abs": abs,
    "bool": bool,
    "dict": dict,
    "float": float,
    "int": int,
    "len": len,
    "list": list,
    "max": max,
    "min": min,
    "range": _counted,
    "round": _rounded,
    "sorted": sorted,
    "str": str,
    "sum": sum,
    "tuple": tuple,
}
_PRINTING = ("xacro.message", "xacro.warning", "xacro.error", "xacro.print_location")
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    **_MATH,
    **{f"math.{name}": function for name, function in _MATH.items()},
    **_PYTHON,
    **{f"python.{name}": function for name, function in _PYTHON.items()},
    **dict.fromkeys(_PRINTING, _no_words),
    **dict.fromkeys(("dotify", "xacro.dotify"), dict),
}
_ARGUMENT, _FATAL = ("arg", "xacro.arg"), "xacro.fatal"
"""Functions that return an argument of the description, and the one that ends it with a message."""
_BY_NAME = ("dict", "python.dict")
"""Functions that take arguments by name."""
_OPENING = (
    *("abs_filename", "xacro.abs_filename", "load_yaml", "xacro.load_yaml"),
    *("dirname", "find", "open"),
)
_OF_SYSTEM = ("env", "optenv")
_NUMBERS = {"pi": math.pi, "e": math.e, "tau": math.tau, "inf": math.inf, "nan": math.nan}
_CONSTANTS: dict[str, Any] = {
    **_NUMBERS,
    **{f"math.{name}": number for name, number in _NUMBERS.items()},
    **{"true": True, "false": False},
}

_UNARY: dict[type, Callable[[Any], Any]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
}
_BINARY: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
}
_COMPARED: dict[type, Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
    ast.In: lambda item, items: item in items,
    ast.NotIn: lambda item, items: item not in items,
}
_ALLOWED = (
    ast.Expression,
    ast.Constant,
    ast.Name,
    ast.Load,
    ast.Attribute,
    ast.Subscript,
    ast.Slice,
    ast.Call,
    ast.keyword,
    ast.UnaryOp,
    ast.BinOp,
    ast.BoolOp,
    ast.And,
    ast.Or,
    ast.Compare,
    ast.IfExp,
    ast.List,
    ast.Tuple,
    ast.Dict,
    *_UNARY,
    *_BINARY,
    *_COMPARED,
)
"""Nodes of Python's trees; what is not among them is refused."""
_CALLED: dict[type, str] = {
    ast.Lambda: "a function (lambda)",
    ast.ListComp: "a loop over values",
    ast.SetComp: "a loop over values",
    ast.DictComp: "a loop over values",
    ast.GeneratorExp: "a loop over values",
    ast.JoinedStr: "an f-string",
    ast.NamedExpr: "an assignment (:=)",
    ast.Starred: "a star (*)",
    ast.Set: "a set",
    ast.Await: "await",
    ast.Yield: "yield",
    ast.YieldFrom: "yield",
}
"""What is refused, in words."""
_PLAIN = (int, float, str, bool, type(None), list, tuple, dict)
"""Types of values, exactly: a subclass is a namespace of xacro, or none of its values."""


def shown(expression: str) -> str:
    """Returns an expression for a sentence: on one line, and cut."""
    text = " ".join(expression.split())
    return f"${{{text if len(text) <= 80 else text[:77] + '...'}}}"


def evaluated(expression: str, lookup: Lookup, argument: Lookup) -> Any:
    """Returns the value of an expression: a number, a text, a truth value, or a list or mapping.

    Args:
        expression: what stands between `${` and `}`.
        lookup: returns the value of a name; a mapping is a namespace.
        argument: returns the value of an argument of the description, for `xacro.arg`.
    Raises LayoutError: the expression holds more than values, names, arithmetic and functions of
    numbers, names something unknown, is too long, grows too large, or cannot be worked out."""
    try:
        tree = _parsed(expression)
        _judge(tree)
        return _Worked(lookup, argument).result(tree.body)
    except _Refused as problem:
        raise LayoutError(f"{shown(expression)} {problem}") from None
    except (ArithmeticError, LookupError, TypeError, ValueError) as problem:
        why = " ".join(str(problem).split())[:100] or type(problem).__name__
        raise LayoutError(f"{shown(expression)} cannot be worked out ({why}); correct it") from None


class _Refused(Exception):
    """What is wrong with an expression; the words follow it."""


def _parsed(expression: str) -> ast.Expression:
    if len(expression) > MAX_LENGTH:
        length = f"{len(expression):,} characters"
        raise _Refused(f"has {length}, expected at most {MAX_LENGTH:,}; shorten it")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the parser warns of odd texts
            return ast.parse(expression.strip(), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise _Refused(f"is no expression; {EXPECTED}") from None


def _judge(tree: ast.Expression) -> None:
    """Refuses a tree that holds what is not listed, also where it would not be reached."""
    nodes = _nodes(tree)
    for node in nodes:
        if not isinstance(node, _ALLOWED):
            called = _CALLED.get(type(node), type(node).__name__)
            raise _Refused(f"holds {called}; {EXPECTED}")
    for node in nodes:
        if isinstance(node, ast.Name | ast.Attribute):
            name = node.id if isinstance(node, ast.Name) else node.attr
            if name.startswith("__"):
                raise _Refused(f"holds the name {name[:60]}, which is Python's own; {EXPECTED}")
    for node in nodes:
        if isinstance(node, ast.Call):
            _judge_call(node)
        elif isinstance(node, ast.Constant):
            kind = type(node.value)
            if kind not in _PLAIN:
                raise _Refused(f"holds a value of type {kind.__name__}; {EXPECTED}")
        elif isinstance(node, ast.Dict) and None in node.keys:
            raise _Refused(f"holds two stars (**); {EXPECTED}")


def _nodes(tree: ast.Expression) -> list[ast.AST]:
    """All nodes of a tree; refused where it is too deep to be worked out."""
    nodes: list[ast.AST] = []
    level: list[ast.AST] = [tree]
    depth = 0
    while level:
        nodes += level
        depth += 1
        if depth > MAX_DEPTH:
            raise _Refused(f"is nested more than {MAX_DEPTH} deep; split it into properties")
        below: list[ast.AST] = []
        for node in level:
            below += ast.iter_child_nodes(node)
        level = below
    return nodes


def _judge_call(node: ast.Call) -> None:
    name = _dotted(node.func)
    if name in _OPENING:
        raise _Refused(f"calls {name}, which opens files; write the values themselves")
    if name in _OF_SYSTEM:
        raise _Refused(f"calls {name}, which reads the environment; write the value itself")
    if name not in _FUNCTIONS and name not in (*_ARGUMENT, _FATAL):
        called = f"calls {name[:60]}" if name else "calls what is not the name of a function"
        raise _Refused(f"{called}; {EXPECTED}")
    starred = any(each.arg is None for each in node.keywords)
    if starred or (node.keywords and name not in _BY_NAME):
        raise _Refused(f"calls {name} with arguments by name; {EXPECTED}")


def _dotted(node: ast.AST) -> str:
    """The name that a node is, such as `pi` or `math.pi`; empty where it is none."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        return f"{node.value.id}.{node.attr}"
    return ""


class _Worked:
    """Works out a tree that has been judged, node by node."""

    def __init__(self, lookup: Lookup, argument: Lookup) -> None:
        """Takes what returns the values of names and of arguments."""
        self._lookup = lookup
        self._argument = argument
        self._ways: dict[type, Callable[[Any], Any]] = {
            ast.Constant: lambda node: node.value,
            ast.Name: self._name,
            ast.Attribute: self._attribute,
            ast.Subscript: self._subscript,
            ast.Call: self._call,
            ast.UnaryOp: self._unary,
            ast.BinOp: self._binary,
            ast.BoolOp: self._boolean,
            ast.Compare: self._comparison,
            ast.IfExp: self._choice,
            ast.List: self._list,
            ast.Tuple: self._tuple,
            ast.Dict: self._dict,
        }

    def result(self, node: ast.expr) -> Any:
        """Returns the value of a node, of a plain type and bounded size."""
        value = self._ways[type(node)](node)
        _check_size(value)
        return value

    def _name(self, node: ast.Name) -> Any:
        try:
            return self._lookup(node.id)
        except KeyError:
            pass
        if node.id in _CONSTANTS:
            return _CONSTANTS[node.id]
        if node.id in _FUNCTIONS:
            raise _Refused(f"names the function {node.id} and does not call it; {EXPECTED}")
        what = f"names {node.id[:60]!r}, which is not defined"
        raise _Refused(f"{what}; define it by <xacro:property> or <xacro:arg>")

    def _attribute(self, node: ast.Attribute) -> Any:
        """An entry of a mapping or of a namespace, never an attribute of an object of Python's."""
        dotted = _dotted(node)
        if dotted in _CONSTANTS:
            return _CONSTANTS[dotted]
        bare = isinstance(node.value, ast.Name | ast.Attribute)
        holder = self._ways[type(node.value)](node.value) if bare else self.result(node.value)
        if not isinstance(holder, dict):
            what = f"asks for {node.attr[:60]!r} of what is no mapping and no namespace"
            raise _Refused(f"{what}; {EXPECTED}")
        if node.attr not in holder:
            what = f"asks for {node.attr[:60]!r}, which is not in it"
            raise _Refused(f"{what}; define it or correct the name")
        return holder[node.attr]

    def _subscript(self, node: ast.Subscript) -> Any:
        holder = self.result(node.value)
        if isinstance(node.slice, ast.Slice):
            ends = (node.slice.lower, node.slice.upper, node.slice.step)
            return holder[slice(*(None if end is None else self.result(end) for end in ends))]
        return holder[self.result(node.slice)]

    def _call(self, node: ast.Call) -> Any:
        name = _dotted(node.func)
        values = [self.result(each) for each in node.args]
        if name in _ARGUMENT:
            return self._argument(*values)
        if name == _FATAL:
            words = " ".join(" ".join(map(str, values)).split())[:200]
            raise _Refused(f"says that the description cannot be used: {words}")
        named = {str(each.arg): self.result(each.value) for each in node.keywords}
        return _FUNCTIONS[name](*values, **named)

    def _unary(self, node: ast.UnaryOp) -> Any:
        return _UNARY[type(node.op)](self.result(node.operand))

    def _binary(self, node: ast.BinOp) -> Any:
        left = self.result(node.left)
        right = self.result(node.right)
        kind = type(node.op)
        numbers = isinstance(left, int | float) and isinstance(right, int | float)
        if not numbers:
            _check_joined(kind, left, right)
        elif kind is ast.Pow:
            _check_power(left, right)
        return _BINARY[kind](left, right)

    def _boolean(self, node: ast.BoolOp) -> Any:
        """As in Python: the value that decides, and none after it."""
        ends = isinstance(node.op, ast.Or)
        value = None
        for each in node.values:
            value = self.result(each)
            if bool(value) is ends:
                break
        return value

    def _comparison(self, node: ast.Compare) -> bool:
        left = self.result(node.left)
        for kind, each in zip(node.ops, node.comparators, strict=True):
            right = self.result(each)
            if not _COMPARED[type(kind)](left, right):
                return False
            left = right
        return True

    def _choice(self, node: ast.IfExp) -> Any:
        return self.result(node.body if self.result(node.test) else node.orelse)

    def _list(self, node: ast.List) -> list[Any]:
        return [self.result(each) for each in node.elts]

    def _tuple(self, node: ast.Tuple) -> tuple[Any, ...]:
        return tuple(self.result(each) for each in node.elts)

    def _dict(self, node: ast.Dict) -> dict[Any, Any]:
        keys = [self.result(key) for key in node.keys if key is not None]
        return dict(zip(keys, map(self.result, node.values), strict=True))


def _check_joined(kind: type, left: Any, right: Any) -> None:
    """Texts and lists are joined by + and repeated by *; nothing else is done with them."""
    if kind is ast.Add and type(left) is type(right):
        return
    if kind is ast.Mult and isinstance(left, int) != isinstance(right, int):
        items, times = (right, left) if isinstance(left, int) else (left, right)
        if isinstance(items, str | list | tuple):
            most = MAX_TEXT if isinstance(items, str) else MAX_ITEMS
            if len(items) * times > most:
                raise _Refused("makes a text or list that is too long; write a smaller number")
            return
    kinds = f"{type(left).__name__} and {type(right).__name__}"
    raise _Refused(f"calculates with {kinds}; expected two numbers, or texts with + between them")


def _check_power(base: float, exponent: float) -> None:
    """Refuses what would have too many digits before it is worked out."""
    whole = isinstance(base, int) and isinstance(exponent, int)
    if whole and exponent > 0 and int(base).bit_length() * exponent > MAX_BITS:
        raise _Refused(f"makes a whole number of over {MAX_BITS} bits; write a smaller one")
    if base < 0 and exponent != int(exponent):
        raise _Refused("takes a fractional power of a negative number; expected a real number")


def _check_size(value: Any) -> None:
    """Refuses a value that is not plain, or large; what a list holds twice counts twice."""
    waiting = [value]
    items = 0
    text = 0
    while waiting:
        each = waiting.pop()
        if type(each) not in _PLAIN:
            raise _Refused(f"gives what is no value (a namespace, or a block); {EXPECTED}")
        if isinstance(each, int) and each.bit_length() > MAX_BITS:
            raise _Refused(f"makes a whole number of over {MAX_BITS} bits; write a smaller one")
        items += 1
        text += len(each) if isinstance(each, str) else 0
        if items > MAX_ITEMS + 1 or text > MAX_TEXT:
            raise _Refused("makes a text or list that is too long; make it shorter")
        if isinstance(each, dict):
            waiting += each.keys()
            waiting += each.values()
        elif isinstance(each, list | tuple):
            waiting += each


def typed(text: str) -> Any:
    """Returns the number or truth value that a text stands for in `$(eval ...)`, or the text."""
    plain = text.strip().lower()
    if plain in ("true", "false"):
        return plain == "true"
    if re.fullmatch(r"[+-]?\d{1,70}", plain):
        return int(plain)
    try:
        return float(plain)
    except ValueError:
        return text
