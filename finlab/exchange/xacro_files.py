"""Expands robot descriptions by the package xacro, without running code or opening files elsewhere.

xacro hands `${...}` to Python, and opens what a file names. Each expansion has a copy of xacro's
module for it alone, in which what evaluates, opens or grows is replaced: `expressions` checks
expressions and evaluates them, files are those in the description's folder or below, and elements,
characters and time are counted. It needs no limits of the process, and is the same on every system.
"""

import keyword
import re
import time
from collections.abc import Iterator
from importlib.metadata import version
from importlib.util import find_spec, module_from_spec
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.dom import Node, minidom

from finlab.errors import LayoutError
from finlab.exchange.expressions import evaluate, parse_typed
from finlab.exchange.xml_models import root_of
from finlab.files.guarded import is_regular, read_text

MAX_BYTES = 5_000_000
"""Largest file of xacro [bytes]."""
MAX_NODES = 60_000
"""Most elements, attributes and texts in files and copies of macros; a large robot has a tenth."""
MAX_TEXT = 5_000_000
"""Most characters that expressions give, all together."""
MAX_LENGTH = 10_000
"""Longest text with `$` in it, and longest list of a macro's parameters [characters]."""
SECONDS = 1.2
"""Most processor time of one expansion [s]."""
_REPLACED_NAMES = (
    *("safe_eval", "eval_text", "eval_extension", "parse", "get_include_files", "resolve_macro"),
    *("parse_macro_arg", "re_macro_arg", "is_valid_name", "warning", "print_location", "Table"),
    *("remove_previous_comments", "_global_symbols", "process_doc", "init_stacks", "filestack"),
    "substitution_args_context",
)
"""Names in xacro's module that are replaced or used; one without them evaluates in another way."""
_FORBIDDEN_FUNCTIONS = ("eval", "exec", "compile", "open")
"""Functions of Python that the copy of the module has no more once it is loaded."""
_PARAMETER = re.compile(
    r"^\s*([^\s:=]+?)\s*:?=\s*(\^\|?)?"
    r"(\$\{.*?\}|\$\(.*?\)|(?:'[^']*'|\"[^\"]*\"|[^\s'\"])+|)(?:\s+|$)(.*)",
    re.DOTALL,
)
"""A macro's parameter with a value: xacro's pattern, in linear time where a quote has no end."""
_OTHER_PACKAGE = "package://"
"""What `$(find NAME)` becomes, before the name; meshes, which have most of them, are not opened."""


def expand(path: Path | None) -> str:
    """Returns the text that xacro makes of a file.

    Args:
        path: the file; None for one from a browser, which may open no other.

    Raises:
        LayoutError: xacro is not installed, or refuses the file; the file came without a path; an
            expression is more than arithmetic; it includes files elsewhere; it grows too large.
    """
    if path is None:
        raise LayoutError("is a xacro file, not a description; `finlab layout convert` expands it")
    return _Expansion(path.resolve()).text()


class _Budget:
    """The nodes, characters and processor time that one expansion has left."""

    def __init__(self) -> None:
        self._nodes = MAX_NODES
        self._text = MAX_TEXT
        self._end = time.thread_time() + SECONDS

    def take_nodes(self, count: int) -> None:
        """Takes elements, attributes and texts; a LayoutError where too many were taken."""
        self._nodes -= count
        if self._nodes < 0:
            what = f"more than {MAX_NODES:,} elements and attributes"
            raise LayoutError(f"makes {what} by xacro; make it smaller, or end what calls itself")
        self.check_time()

    def take_text(self, count: int) -> None:
        """Takes characters; a LayoutError where too many were taken."""
        self._text -= count
        if self._text < 0:
            raise LayoutError(f"makes over {MAX_TEXT:,} characters by expressions; make it smaller")

    def check_time(self) -> None:
        """Raises a LayoutError after the time."""
        if time.thread_time() > self._end:
            raise LayoutError(f"takes over {SECONDS} s to expand by xacro; make it smaller")


class _Expansion:
    """One expansion of one file."""

    def __init__(self, path: Path) -> None:
        """Takes a path without links. Raises LayoutError: no xacro, or one that is not known."""
        self._path = path
        self._folder = path.parent
        self._budget = _Budget()
        self._xacro = _copy_of_xacro()
        self._eval_text = self._xacro.eval_text
        self._resolve_macro = self._xacro.resolve_macro
        self._parse_parameter = self._xacro.parse_macro_arg
        self._replace()

    def text(self) -> str:
        """Returns the expanded text. Raises LayoutError as `expanded`."""
        try:
            self._xacro.init_stacks(str(self._path))
            document = self._xacro.parse(None, str(self._path))
            self._xacro.process_doc(document)
            expansion: str = document.documentElement.toxml()
            return expansion
        except MemoryError:
            raise
        except Exception as problem:  # xacro lets AttributeError, KeyError and others through
            raise self._sentence(problem) from None

    def _replace(self) -> None:
        """Puts what is safe in place of what evaluates, opens files, copies elements and prints."""
        xacro: Any = self._xacro
        xacro.safe_eval = self._value
        xacro.eval_text = self._text_value
        xacro.eval_extension = self._substitution
        xacro.parse = self._document
        xacro.get_include_files = self._included
        xacro.resolve_macro = self._macro
        xacro.parse_macro_arg = self._parameter
        xacro.re_macro_arg = _PARAMETER
        xacro.is_valid_name = _is_name
        xacro.remove_previous_comments = _print_nothing  # its time grows with their square
        xacro.warning = _print_nothing
        xacro.print_location = _print_nothing
        xacro._global_symbols = {}  # its functions and load_yaml; `expressions` has its own
        for name in _FORBIDDEN_FUNCTIONS:
            setattr(xacro, name, _forbidden)
        resolve = xacro.Table._resolve_

        def resolved(table: Any, key: str) -> Any:
            value = resolve(table, key)
            if isinstance(value, Node):
                self._budget.take_nodes(_size(value))  # a block, which is copied next
            return value

        xacro.Table._resolve_ = resolved

    def _value(self, expression: str, symbols: Any, _: Any = None) -> Any:
        """The value of an expression, in place of `safe_eval`."""
        value = evaluate(expression, symbols.__getitem__, self._argument)
        self._budget.take_text(len(str(value)))
        return value

    def _text_value(self, text: str | None, symbols: Any) -> Any:
        """The value of a text with expressions in it, in place of `eval_text`."""
        self._budget.check_time()
        if text is None or "$" not in text:
            return text or ""
        _check_length(text)
        value = self._eval_text(text, symbols)
        self._budget.take_text(len(value) if isinstance(value, str) else 0)
        return value

    def _substitution(self, text: str) -> str:
        """What `$(...)` stands for, in place of `eval_extension`."""
        command, _, argument = text[2:-1].strip().partition(" ")
        argument = argument.strip()
        shown = f"$({' '.join(f'{command} {argument}'.split())[:80]})"
        if command == "arg":
            value = self._argument(argument)
        elif command == "eval":
            value = evaluate(argument, self._typed_argument, self._typed_argument)
        elif command == "find" and re.fullmatch(r"[\w.-]+", argument):
            value = f"{_OTHER_PACKAGE}{argument}"
        elif command in ("env", "optenv"):
            raise LayoutError(f"{shown} reads the environment; write the value itself")
        elif command in ("dirname", "cwd"):
            raise LayoutError(f"{shown} asks for a folder of this computer; leave it away")
        else:
            expected = "$(arg ...), $(eval ...) or $(find ...)"
            raise LayoutError(f"{shown} is no substitution of xacro; expected {expected}")
        self._budget.take_text(len(str(value)))
        return str(value)

    def _argument(self, name: Any) -> Any:
        """The value of an argument."""
        values = self._xacro.substitution_args_context["arg"]
        if name not in values:
            shown = f"{name!s:.60}"
            remedy = "give its <xacro:arg> a default"
            raise LayoutError(f"has no value for argument {shown!r}; {remedy}")
        return values[name]

    def _typed_argument(self, name: Any) -> Any:
        """The value of an argument in `$(eval ...)`; a KeyError where there is none."""
        return parse_typed(self._xacro.substitution_args_context["arg"][name])

    def _document(self, _: Any, file: str) -> Any:
        """The tree of a file, in place of `parse`."""
        if not is_regular(file) and file != str(self._path):
            self._xacro.filestack.pop()
            # xacro passes over it where the include is optional.
            missing = FileNotFoundError(f"includes {Path(file).name!r}, and there is no such file")
            raise self._xacro.XacroException(exc=missing)
        text = read_text(file, MAX_BYTES, "a file of xacro", LayoutError)
        # It has no entities and is not too deep; the same text goes to the parser that xacro needs.
        root = root_of(text)
        n_nodes = sum(3 + len(element.attrib) for element in root.iter())
        n_declarations = text.count("<!") + text.count("<?")
        self._budget.take_nodes(n_nodes + n_declarations)
        return minidom.parseString(text.lstrip())

    def _included(self, file: str, symbols: Any) -> Iterator[str]:
        """The path of an included file, in place of `get_include_files`."""
        name = str(self._text_value(file, symbols))
        folder = Path(self._xacro.filestack[-1]).parent
        shown = " ".join(name.split())[:80]
        shown = re.sub(f"^{_OTHER_PACKAGE}([^/]*)", r"$(find \1)", shown)
        problem = f"includes {shown!r}"
        expected = "expected one in the description's folder or below, by its path from there"
        if re.search(r"[*?[\]]", name):
            raise LayoutError(f"{problem}, a pattern; {expected}")
        if name.startswith(_OTHER_PACKAGE):
            path = self._of_package(name)
        else:
            path = None if Path(name).is_absolute() else folder / name
        try:
            inside = path is not None and path.resolve().is_relative_to(self._folder)
        except RecursionError:  # a file that includes itself, which `expand` says
            raise
        except (OSError, RuntimeError, ValueError):  # a circle of links, a NUL byte
            inside = False
        if path is None or not inside:
            remedy = "copy what it includes there"
            raise LayoutError(f"{problem}, a file elsewhere; {expected}: {remedy}")
        yield str(path.resolve())

    def _of_package(self, name: str) -> Path | None:
        """The path that `$(find NAME)/...` names where the description lies below such a folder."""
        package, _, subpath = name.removeprefix(_OTHER_PACKAGE).partition("/")
        for folder in (self._folder, *self._folder.parents):
            if folder.name == package:
                return folder / subpath
        return None

    def _macro(self, name: str, macros: Any, symbols: Any) -> Any:
        """The macro of a name, whose elements are copied next, in place of `resolve_macro`."""
        macro = self._resolve_macro(name, macros, symbols)
        self._budget.take_nodes(_size(macro[2].body))
        return macro

    def _parameter(self, text: str) -> Any:
        """The first parameter of a macro's list, in place of `parse_macro_arg`."""
        _check_length(text)
        self._budget.check_time()
        return self._parse_parameter(text)

    def _sentence(self, problem: Exception) -> LayoutError:
        """The error for what an expansion has ended with."""
        cause: BaseException | None = problem
        while cause is not None and not isinstance(cause, LayoutError | RecursionError):
            cause = getattr(cause, "exc", None)
        file = Path(str((self._xacro.filestack or [self._path])[-1]))
        where = "" if file == self._path else f"in {file.name}: "
        if isinstance(cause, RecursionError):
            depth = "has an expression, macro or include that is nested too deep"
            return LayoutError(f"{where}{depth}; does it hold itself?")
        if cause is not None:
            return LayoutError(f"{where}{cause}")
        words = " ".join(str(problem).split())[:300] or type(problem).__name__
        return LayoutError(f"{where}is a xacro file that xacro refuses: {words}")


def _copy_of_xacro() -> ModuleType:
    """A copy of the package's module that nobody else has."""
    spec = find_spec("xacro")
    if spec is None or spec.loader is None:
        raise LayoutError("is a xacro file; to expand it, pip install finlab-marine[xacro]")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    if missing := [name for name in _REPLACED_NAMES if not hasattr(module, name)]:
        problem = f"is a xacro file, and xacro {version('xacro')} has no {missing[0]}"
        raise LayoutError(f"{problem}: pip install xacro==2.1.1")
    return module


def _size(node: Any) -> int:
    """How many elements, attributes and texts there are in a node."""
    count = 0
    stack = [node]
    while stack:
        child = stack.pop()
        count += 1 + (child.attributes.length if child.attributes is not None else 0)
        stack += child.childNodes
    return count


def _check_length(text: str) -> None:
    if len(text) > MAX_LENGTH:
        start = " ".join(text[:40].split())
        problem = f"has a text of {len(text):,} characters to expand"
        raise LayoutError(f"{problem}, expected at most {MAX_LENGTH:,}; shorten it: {start}...")


def _is_name(name: str) -> bool:
    """Whether a property may have a name, in place of `is_valid_name`."""
    return name.isidentifier() and not keyword.iskeyword(name)


def _print_nothing(*_: object, **__: object) -> None:
    """What xacro would print to a terminal."""


def _forbidden(*_: object, **__: object) -> None:
    """What a function ends with that xacro has no use for any more."""
    raise LayoutError("is a xacro file that this xacro would run; pip install xacro==2.1.1")
