"""Descriptions that the package xacro expands, without a way to code, nor to files elsewhere.

xacro hands `${...}` to Python, and opens what a file names. Each expansion has a copy of xacro's
module for it alone, in which what evaluates, opens or grows is replaced: `expressions` judges
expressions and works them out, files are those in the description's folder or below, and elements,
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
from finlab.exchange.expressions import evaluated, typed
from finlab.exchange.xml_models import root_of
from finlab.files.guarded import is_regular, read_text

MAX_BYTES = 5_000_000
"""Largest file of xacro [bytes]."""
MAX_NODES = 60_000
"""Most elements, attributes and texts in files and copies of macros; a large robot has a tenth."""
MAX_TEXT = 5_000_000
"""Most characters that expressions give, all together."""
LONGEST = 10_000
"""Longest text with `$` in it, and longest list of a macro's parameters [characters]."""
SECONDS = 1.2
"""Most processor time of one expansion [s]."""
_NEEDED = (
    *("safe_eval", "eval_text", "eval_extension", "parse", "get_include_files", "resolve_macro"),
    *("parse_macro_arg", "re_macro_arg", "is_valid_name", "warning", "print_location", "Table"),
    *("remove_previous_comments", "_global_symbols", "process_doc", "init_stacks", "filestack"),
    "substitution_args_context",
)
"""Names in xacro's module that are replaced or used; one without them evaluates in another way."""
_FORBIDDEN = ("eval", "exec", "compile", "open")
"""Functions of Python that the copy of the module has no more once it is loaded."""
_PARAMETER = re.compile(
    r"^\s*([^\s:=]+?)\s*:?=\s*(\^\|?)?"
    r"(\$\{.*?\}|\$\(.*?\)|(?:'[^']*'|\"[^\"]*\"|[^\s'\"])+|)(?:\s+|$)(.*)",
    re.DOTALL,
)
"""A macro's parameter with a value: xacro's pattern, in linear time where a quote has no end."""
_OTHER_PACKAGE = "package://"
"""What `$(find NAME)` becomes, before the name; meshes, which have most of them, are not opened."""


def expanded(path: Path | None) -> str:
    """Returns the text that xacro makes of a file.

    Args:
        path: the file; None for one from a browser, which may open no other.
    Raises LayoutError: xacro is not installed, or refuses the file; the file came without a path;
    an expression is more than arithmetic; it includes files elsewhere; it grows too large."""
    if path is None:
        raise LayoutError("is a xacro file, not a description; `finlab layout convert` expands it")
    return _Expansion(path.resolve()).text()


class _Budget:
    """What one expansion may still use."""

    def __init__(self) -> None:
        self._nodes = MAX_NODES
        self._text = MAX_TEXT
        self._end = time.thread_time() + SECONDS

    def take_nodes(self, count: int) -> None:
        """Takes elements, attributes and texts; a LayoutError where too many were taken."""
        self._nodes -= count
        if self._nodes < 0:
            most = f"more than {MAX_NODES:,} elements and attributes"
            raise LayoutError(f"makes {most} by xacro; make it smaller, or end what calls itself")
        self.look_at_the_clock()

    def take_text(self, count: int) -> None:
        """Takes characters; a LayoutError where too many were taken."""
        self._text -= count
        if self._text < 0:
            raise LayoutError(f"makes over {MAX_TEXT:,} characters by expressions; make it smaller")

    def look_at_the_clock(self) -> None:
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
        xacro.remove_previous_comments = _say_nothing  # its time grows with their square
        xacro.warning = _say_nothing
        xacro.print_location = _say_nothing
        xacro._global_symbols = {}  # its functions and load_yaml; `expressions` has its own
        for name in _FORBIDDEN:
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
        value = evaluated(expression, symbols.__getitem__, self._argument)
        self._budget.take_text(len(str(value)))
        return value

    def _text_value(self, text: str | None, symbols: Any) -> Any:
        """The value of a text with expressions in it, in place of `eval_text`."""
        self._budget.look_at_the_clock()
        if text is None or "$" not in text:
            return text or ""
        _check_length(text)
        value = self._eval_text(text, symbols)
        self._budget.take_text(len(value) if isinstance(value, str) else 0)
        return value

    def _substitution(self, text: str) -> str:
        """What `$(...)` stands for, in place of `eval_extension`."""
        command, _, rest = text[2:-1].strip().partition(" ")
        rest = rest.strip()
        what = f"$({' '.join(f'{command} {rest}'.split())[:80]})"
        if command == "arg":
            value = self._argument(rest)
        elif command == "eval":
            value = evaluated(rest, self._typed_argument, self._typed_argument)
        elif command == "find" and re.fullmatch(r"[\w.-]+", rest):
            value = f"{_OTHER_PACKAGE}{rest}"
        elif command in ("env", "optenv"):
            raise LayoutError(f"{what} reads the environment; write the value itself")
        elif command in ("dirname", "cwd"):
            raise LayoutError(f"{what} asks for a folder of this computer; leave it away")
        else:
            known = "$(arg ...), $(eval ...) or $(find ...)"
            raise LayoutError(f"{what} is no substitution of xacro; expected {known}")
        self._budget.take_text(len(str(value)))
        return str(value)

    def _argument(self, name: Any) -> Any:
        """The value of an argument."""
        values = self._xacro.substitution_args_context["arg"]
        if name not in values:
            what = f"{name!s:.60}"
            raise LayoutError(f"has no value for argument {what!r}; give its <xacro:arg> a default")
        return values[name]

    def _typed_argument(self, name: Any) -> Any:
        """The value of an argument in `$(eval ...)`; a KeyError where there is none."""
        return typed(self._xacro.substitution_args_context["arg"][name])

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
        elements = sum(3 + len(each.attrib) for each in root.iter())
        others = text.count("<!") + text.count("<?")
        self._budget.take_nodes(elements + others)
        return minidom.parseString(text.lstrip())

    def _included(self, file: str, symbols: Any) -> Iterator[str]:
        """The path of an included file, in place of `get_include_files`."""
        name = str(self._text_value(file, symbols))
        here = Path(self._xacro.filestack[-1]).parent
        asked = " ".join(name.split())[:80]
        asked = re.sub(f"^{_OTHER_PACKAGE}([^/]*)", r"$(find \1)", asked)
        said = f"includes {asked!r}"
        own = "expected one in the description's folder or below, by its path from there"
        if re.search(r"[*?[\]]", name):
            raise LayoutError(f"{said}, a pattern; {own}")
        if name.startswith(_OTHER_PACKAGE):
            path = self._of_package(name)
        else:
            path = None if Path(name).is_absolute() else here / name
        try:
            inside = path is not None and path.resolve().is_relative_to(self._folder)
        except (OSError, RuntimeError, ValueError):  # a circle of links, a NUL byte
            inside = False
        if path is None or not inside:
            raise LayoutError(f"{said}, a file elsewhere; {own}: copy what it includes there")
        yield str(path.resolve())

    def _of_package(self, name: str) -> Path | None:
        """The path that `$(find NAME)/...` names where the description lies below such a folder."""
        package, _, rest = name.removeprefix(_OTHER_PACKAGE).partition("/")
        for folder in (self._folder, *self._folder.parents):
            if folder.name == package:
                return folder / rest
        return None

    def _macro(self, name: str, macros: Any, symbols: Any) -> Any:
        """The macro of a name, whose elements are copied next, in place of `resolve_macro`."""
        found = self._resolve_macro(name, macros, symbols)
        self._budget.take_nodes(_size(found[2].body))
        return found

    def _parameter(self, text: str) -> Any:
        """The first parameter of a macro's list, in place of `parse_macro_arg`."""
        _check_length(text)
        self._budget.look_at_the_clock()
        return self._parse_parameter(text)

    def _sentence(self, problem: Exception) -> LayoutError:
        """The error for what an expansion has ended with."""
        own: BaseException | None = problem
        while own is not None and not isinstance(own, LayoutError | RecursionError):
            own = getattr(own, "exc", None)
        file = Path(str((self._xacro.filestack or [self._path])[-1]))
        where = "" if file == self._path else f"in {file.name}: "
        if isinstance(own, RecursionError):
            what = "has an expression, macro or include that is nested too deep"
            return LayoutError(f"{where}{what}; does it hold itself?")
        if own is not None:
            return LayoutError(f"{where}{own}")
        words = " ".join(str(problem).split())[:300] or type(problem).__name__
        return LayoutError(f"{where}is a xacro file that xacro refuses: {words}")


def _copy_of_xacro() -> ModuleType:
    """A copy of the package's module that nobody else has."""
    spec = find_spec("xacro")
    if spec is None or spec.loader is None:
        raise LayoutError("is a xacro file; to expand it, pip install finlab-marine[xacro]")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    if missing := [name for name in _NEEDED if not hasattr(module, name)]:
        problem = f"is a xacro file, and xacro {version('xacro')} has no {missing[0]}"
        raise LayoutError(f"{problem}: pip install xacro==2.1.1")
    return module


def _size(node: Any) -> int:
    """How many elements, attributes and texts there are in a node."""
    count = 0
    waiting = [node]
    while waiting:
        each = waiting.pop()
        count += 1 + (each.attributes.length if each.attributes is not None else 0)
        waiting += each.childNodes
    return count


def _check_length(text: str) -> None:
    if len(text) > LONGEST:
        start = " ".join(text[:40].split())
        what = f"has a text of {len(text):,} characters to expand"
        raise LayoutError(f"{what}, expected at most {LONGEST:,}; shorten it: {start}...")


def _is_name(name: str) -> bool:
    """Whether a property may have a name, in place of `is_valid_name`."""
    return name.isidentifier() and not keyword.iskeyword(name)


def _say_nothing(*_: object, **__: object) -> None:
    """What xacro would print to a terminal."""


def _forbidden(*_: object, **__: object) -> None:
    """What a function ends with that xacro has no use for any more."""
    raise LayoutError("is a xacro file that this xacro would run; pip install xacro==2.1.1")
