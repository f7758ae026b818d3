"""Expressions in a stranger's robot description: numbers, names, arithmetic, and nothing that runs.

Python's parser makes a syntax tree of an expression, which is never compiled. All nodes are checked
before any is evaluated, and what is not listed here is refused: attributes of Python's objects,
functions of Python, names that lead to either. Values have a bounded size, so `9**9**9` ends at
once. `xacro_files` puts `evaluate` in place of the evaluation that the package xacro does.
"""

import ast
import math
import operator
import re
import warnings
from collections.abc import Callable
from typing import Any

from finlab.errors import LayoutError

MAX_LENGTH = 2000
"""Longest expression [characters]; ordinary ones have fewer than 200."""
MAX_DEPTH = 100
"""Deepest syntax tree; ordinary ones are less than 20 deep."""
MAX_BITS = 256
"""Largest integer [bits]."""
MAX_TEXT = 10_000
"""Longest text [characters], all texts of a list together."""
MAX_ITEMS = 1000
"""Most values in a list, those of lists inside it included."""
MAX_DIGITS = 30
"""Most digits that a number is rounded to, on either side of the point."""
EXPECTED = "expected numbers, names, arithmetic and functions of numbers: write the value instead"
"""The end of the sentences on what is refused."""

Lookup = Callable[[str], Any]
"""Returns the value that has a name; a KeyError where nothing has it."""


def _round(number: float, digits: int | None = None) -> float:
    """As `round`, which takes a whole number to as many digits as it is told."""
    if digits is not None and abs(digits) > MAX_DIGITS:
        raise ValueError(f"more than {MAX_DIGITS} digits")
    return round(number, digits)


def _range(*bounds: int) -> list[int]:
    """As `range`, written out."""
    numbers = range(*bounds)
    if len(numbers) > MAX_ITEMS:
        raise ValueError(f"more than {MAX_ITEMS} numbers")
    return list(numbers)


def _print_nothing(*_: object) -> str:
    """What xacro's functions that print a message give."""
    return ""


_MATH_NAMES = (
    *("acos", "asin", "atan", "atan2", "cos", "sin", "tan", "degrees", "radians", "hypot", "dist"),
    *("acosh", "asinh", "atanh", "cosh", "sinh", "tanh", "sqrt", "exp", "expm1", "pow"),
    *("log", "log10", "log1p", "log2", "ceil", "floor", "trunc", "fabs", "fmod", "remainder"),
    *("fsum", "copysign", "gcd", "isclose", "isfinite", "isinf", "isnan"),
)
_MATH: dict[str, Callable[..., Any]] = {name: getattr(math, name) for name in _MATH_NAMES}
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
    "range": _range,
    "round": _round,
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
    **dict.fromkeys(_PRINTING, _print_nothing),
    **dict.fromkeys(("dotify", "xacro.dotify"), dict),
}
_ARGUMENT_FUNCTIONS = ("arg", "xacro.arg")
"""Functions that return an argument of the description."""
_FATAL_FUNCTION = "xacro.fatal"
"""The function by which a description says that it cannot be used, with a message."""
_KEYWORD_FUNCTIONS = ("dict", "python.dict")
"""Functions that take arguments by name."""
_FILE_FUNCTIONS = (
    *("abs_filename", "xacro.abs_filename", "load_yaml", "xacro.load_yaml"),
    *("dirname", "find", "open"),
)
"""Functions of xacro that open files, or name folders; each is refused by its name."""
_ENVIRONMENT_FUNCTIONS = ("env", "optenv")
"""Functions of xacro that read the environment; refused."""
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
_COMPARISONS: dict[type, Callable[[Any, Any], Any]] = {
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
_ALLOWED_NODES = (
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
    *_COMPARISONS,
)
"""Nodes of Python's trees; what is not among them is refused."""
_NODE_NAMES: dict[type, str] = {
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
"""Nodes that are refused, as the error names them."""
_PLAIN_TYPES = (int, float, str, bool, type(None), list, tuple, dict)
"""Types of values, exactly: a subclass is a namespace of xacro, or none of its values."""


def shown(expression: str) -> str:
    """Returns an expression for a sentence: on one line, and cut."""
    text = " ".join(expression.split())
    return f"${{{text if len(text) <= 80 else text[:77] + '...'}}}"


def evaluate(expression: str, lookup: Lookup, argument: Lookup) -> Any:
    """Returns the value of an expression: a number, a text, a truth value, or a list or mapping.

    Args:
        expression: what stands between `${` and `}`.
        lookup: returns the value of a name; a mapping is a namespace.
        argument: returns the value of an argument of the description, for `xacro.arg`.

    Raises:
        LayoutError: the expression holds more than values, names, arithmetic and functions of
            numbers, names something unknown, is too long, grows too large, or cannot be evaluated.
    """
    try:
        tree = _parse(expression)
        _check_nodes(tree)
        return _Evaluator(lookup, argument).result(tree.body)
    except _Refused as problem:
        raise LayoutError(f"{shown(expression)} {problem}") from None
    except (ArithmeticError, LookupError, TypeError, ValueError) as problem:
        why = " ".join(str(problem).split())[:100] or type(problem).__name__
        raise LayoutError(f"{shown(expression)} cannot be worked out ({why}); correct it") from None


class _Refused(Exception):
    """A fault of an expression; its message goes on a sentence that begins with the expression."""


def _parse(expression: str) -> ast.Expression:
    """The syntax tree of an expression."""
    if len(expression) > MAX_LENGTH:
        length = f"{len(expression):,} characters"
        raise _Refused(f"has {length}, expected at most {MAX_LENGTH:,}; shorten it")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the parser warns of odd texts
            return ast.parse(expression.strip(), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise _Refused(f"is no expression; {EXPECTED}") from None


def _check_nodes(tree: ast.Expression) -> None:
    """Refuses a tree that holds what is not listed, also where it would not be reached."""
    nodes = _nodes(tree)
    for node in nodes:
        if not isinstance(node, _ALLOWED_NODES):
            called = _NODE_NAMES.get(type(node), type(node).__name__)
            raise _Refused(f"holds {called}; {EXPECTED}")
    for node in nodes:
        if isinstance(node, ast.Name | ast.Attribute):
            name = node.id if isinstance(node, ast.Name) else node.attr
            if name.startswith("__"):
                raise _Refused(f"holds the name {name[:60]}, which is Python's own; {EXPECTED}")
    for node in nodes:
        if isinstance(node, ast.Call):
            _check_call(node)
        elif isinstance(node, ast.Constant):
            kind = type(node.value)
            if kind not in _PLAIN_TYPES:
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


def _check_call(node: ast.Call) -> None:
    """Refuses a call of what is not listed, and keyword arguments where a function takes none."""
    name = _dotted_name(node.func)
    if name in _FILE_FUNCTIONS:
        raise _Refused(f"calls {name}, which opens files; write the values themselves")
    if name in _ENVIRONMENT_FUNCTIONS:
        raise _Refused(f"calls {name}, which reads the environment; write the value itself")
    if name not in _FUNCTIONS and name not in (*_ARGUMENT_FUNCTIONS, _FATAL_FUNCTION):
        called = f"calls {name[:60]}" if name else "calls what is not the name of a function"
        raise _Refused(f"{called}; {EXPECTED}")
    starred = any(argument.arg is None for argument in node.keywords)
    if starred or (node.keywords and name not in _KEYWORD_FUNCTIONS):
        raise _Refused(f"calls {name} with arguments by name; {EXPECTED}")


def _dotted_name(node: ast.AST) -> str:
    """The name that a node is, such as `pi` or `math.pi`; empty where it is none."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        return f"{node.value.id}.{node.attr}"
    return ""


class _Evaluator:
    """Evaluates a tree whose nodes have been checked, node by node."""

    def __init__(self, lookup: Lookup, argument: Lookup) -> None:
        """Takes the functions that return the values of names and of arguments."""
        self._lookup = lookup
        self._argument = argument
        self._handlers: dict[type, Callable[[Any], Any]] = {
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
        value = self._handlers[type(node)](node)
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
        problem = f"names {node.id[:60]!r}, which is not defined"
        raise _Refused(f"{problem}; define it by <xacro:property> or <xacro:arg>")

    def _attribute(self, node: ast.Attribute) -> Any:
        """An entry of a mapping or of a namespace, never an attribute of an object of Python's."""
        name = _dotted_name(node)
        if name in _CONSTANTS:
            return _CONSTANTS[name]
        is_name = isinstance(node.value, ast.Name | ast.Attribute)
        # A namespace is no plain value, so that `result` would refuse it.
        evaluate_holder = self._handlers[type(node.value)] if is_name else self.result
        holder = evaluate_holder(node.value)
        if not isinstance(holder, dict):
            problem = f"asks for {node.attr[:60]!r} of what is no mapping and no namespace"
            raise _Refused(f"{problem}; {EXPECTED}")
        if node.attr not in holder:
            problem = f"asks for {node.attr[:60]!r}, which is not in it"
            raise _Refused(f"{problem}; define it or correct the name")
        return holder[node.attr]

    def _subscript(self, node: ast.Subscript) -> Any:
        holder = self.result(node.value)
        if isinstance(node.slice, ast.Slice):
            bounds = []
            for bound in (node.slice.lower, node.slice.upper, node.slice.step):
                bounds.append(None if bound is None else self.result(bound))
            return holder[slice(*bounds)]
        return holder[self.result(node.slice)]

    def _call(self, node: ast.Call) -> Any:
        name = _dotted_name(node.func)
        arguments = [self.result(argument) for argument in node.args]
        if name in _ARGUMENT_FUNCTIONS:
            return self._argument(*arguments)
        if name == _FATAL_FUNCTION:
            words = " ".join(" ".join(map(str, arguments)).split())[:200]
            raise _Refused(f"says that the description cannot be used: {words}")
        keywords = {str(argument.arg): self.result(argument.value) for argument in node.keywords}
        return _FUNCTIONS[name](*arguments, **keywords)

    def _unary(self, node: ast.UnaryOp) -> Any:
        return _UNARY[type(node.op)](self.result(node.operand))

    def _binary(self, node: ast.BinOp) -> Any:
        left = self.result(node.left)
        right = self.result(node.right)
        kind = type(node.op)
        numbers = isinstance(left, int | float) and isinstance(right, int | float)
        if not numbers:
            _check_join(kind, left, right)
        elif kind is ast.Pow:
            _check_power(left, right)
        return _BINARY[kind](left, right)

    def _boolean(self, node: ast.BoolOp) -> Any:
        """As in Python: the value that decides, and none after it."""
        decides = isinstance(node.op, ast.Or)
        value = None
        for operand in node.values:
            value = self.result(operand)
            if bool(value) is decides:
                break
        return value

    def _comparison(self, node: ast.Compare) -> bool:
        left = self.result(node.left)
        for op, comparator in zip(node.ops, node.comparators, strict=True):
            right = self.result(comparator)
            if not _COMPARISONS[type(op)](left, right):
                return False
            left = right
        return True

    def _choice(self, node: ast.IfExp) -> Any:
        return self.result(node.body if self.result(node.test) else node.orelse)

    def _list(self, node: ast.List) -> list[Any]:
        return [self.result(item) for item in node.elts]

    def _tuple(self, node: ast.Tuple) -> tuple[Any, ...]:
        return tuple(self.result(item) for item in node.elts)

    def _dict(self, node: ast.Dict) -> dict[Any, Any]:
        keys = [self.result(key) for key in node.keys if key is not None]
        return dict(zip(keys, map(self.result, node.values), strict=True))


def _check_join(kind: type, left: Any, right: Any) -> None:
    """Texts and lists are joined by + and repeated by *; nothing else is done with them."""
    if kind is ast.Add and type(left) is type(right):
        return
    if kind is ast.Mult and isinstance(left, int) != isinstance(right, int):
        items, times = (right, left) if isinstance(left, int) else (left, right)
        if isinstance(items, str | list | tuple):
            limit = MAX_TEXT if isinstance(items, str) else MAX_ITEMS
            if len(items) * times > limit:
                raise _Refused("makes a text or list that is too long; write a smaller number")
            return
    kinds = f"{type(left).__name__} and {type(right).__name__}"
    raise _Refused(f"calculates with {kinds}; expected two numbers, or texts with + between them")


def _check_power(base: float, exponent: float) -> None:
    """Refuses what would have too many digits before it is worked out."""
    are_integers = isinstance(base, int) and isinstance(exponent, int)
    if are_integers and exponent > 0 and int(base).bit_length() * exponent > MAX_BITS:
        raise _Refused(f"makes a whole number of over {MAX_BITS} bits; write a smaller one")
    if base < 0 and exponent != int(exponent):
        raise _Refused("takes a fractional power of a negative number; expected a real number")


def _check_size(value: Any) -> None:
    """Refuses a value that is not plain, or large; what a list holds twice counts twice."""
    stack = [value]
    items = 0
    characters = 0
    while stack:
        item = stack.pop()
        if type(item) not in _PLAIN_TYPES:
            raise _Refused(f"gives what is no value (a namespace, or a block); {EXPECTED}")
        if isinstance(item, int) and item.bit_length() > MAX_BITS:
            raise _Refused(f"makes a whole number of over {MAX_BITS} bits; write a smaller one")
        items += 1
        characters += len(item) if isinstance(item, str) else 0
        if items > MAX_ITEMS + 1 or characters > MAX_TEXT:
            raise _Refused("makes a text or list that is too long; make it shorter")
        if isinstance(item, dict):
            stack += item.keys()
            stack += item.values()
        elif isinstance(item, list | tuple):
            stack += item


def parse_typed(text: str) -> Any:
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
