"""YAML and JSON text to plain values: mappings, lists, text, true, false, null, and the numbers of JSON.

The text may come from a stranger. Nothing in it runs code, expands, drops a key, or takes more than linear
time. Whatever YAML calls a number beyond JSON's (0o17, 1_000, 1:30, .inf), a date or a yes is text here.
"""

import json
import math
import re
from typing import Any

from finlab.errors import DataError, FinlabError

MAX_EVENTS = 30_000
"""Most YAML events (keys, values, brackets); a layout of 64 fins has about four thousand."""
MAX_DEPTH = 20
"""Deepest nesting of YAML; a layout needs five levels."""
MAX_DIGITS = 100
"""Most characters of a number."""

_NUMBER = re.compile(r"-?(?:0|[1-9][0-9]*)(\.[0-9]+)?([eE][-+]?[0-9]+)?")
_WORDS = {"": None, "null": None, "true": True, "false": False}
_ESCAPED_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


def parse_json(content: str, source: str, error: type[FinlabError] = DataError) -> Any:
    """Returns the values of a JSON document.

    Raises:
        FinlabError: of the kind `error`; it is no JSON, or holds a key twice or a number that is not finite.
            The message calls the document `source`.
    """
    try:
        values = json.loads(
            content, object_pairs_hook=_once, parse_float=_number, parse_constant=_number, parse_int=_number
        )
        if _ESCAPED_SURROGATE.search(content):  # half of a pair is no character, and cannot be written
            json.dumps(values, ensure_ascii=False).encode()
        return values
    except json.JSONDecodeError as problem:
        raise error.at(source, f"is not valid JSON: line {problem.lineno}: {problem.msg}") from None
    except RecursionError:
        raise error.at(source, "is nested too deeply") from None
    except ValueError as problem:
        raise error.at(source, str(problem)[:160]) from None


def parse_yaml(content: str, source: str, error: type[FinlabError] = DataError) -> Any:
    """Returns the values of one YAML document; aliases and tags are refused.

    Raises:
        FinlabError: of the kind `error`; it is no YAML, or holds what is refused. The message calls the
            document `source`.
    """
    import yaml  # a robot's computer reads JSON and may lack PyYAML

    try:
        return _document(content)
    except yaml.YAMLError as problem:
        mark = getattr(problem, "problem_mark", None)
        said = getattr(problem, "problem", None) or str(problem).splitlines()[0]
        place = f"line {mark.line + 1}: " if mark else ""
        raise error.at(source, f"is not valid YAML: {place}{said}"[:200]) from None
    except ValueError as problem:
        raise error.at(source, str(problem)[:200]) from None


def yaml_text(values: Any) -> str:
    """Returns the text of plain values, in their order."""
    import yaml

    style: Any = {"sort_keys": False, "allow_unicode": True, "default_flow_style": None, "width": 110}
    return str(yaml.safe_dump(values, **style))


def _number(text: str) -> int | float:
    """A finite number as JSON writes it."""
    if len(text) > MAX_DIGITS:
        raise ValueError(f"holds a number of {len(text):,} digits, expected at most {MAX_DIGITS}")
    value = int(text) if text.lstrip("-").isdigit() else float(text)
    if not math.isfinite(value):
        raise ValueError(f"holds {text}, expected a finite number")
    return value


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A mapping whose keys are given once each."""
    values: dict[str, Any] = {}
    for key, value in pairs:
        if key in values:
            raise ValueError(f"key {key!r:.60} is given twice")
        values[key] = value
    return values


def _document(content: str) -> Any:
    """The value of the document, built from its events while they are read."""
    import yaml

    document: list[Any] = []
    inside: list[_Collection] = [_Collection(document)]
    # libyaml's parser is ten times as fast, but PyYAML may have been built without it.
    for count, event in enumerate(yaml.parse(content, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))):
        line = event.start_mark.line + 1 if event.start_mark else 0
        if count > MAX_EVENTS:
            raise ValueError(f"line {line}: has more than {MAX_EVENTS} entries, too many to be read")
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
            raise ValueError(
                f"line {line}: anchors and aliases (& and *) are not allowed; write the value out"
            )
        if getattr(event, "tag", None):
            raise ValueError(f"line {line}: tags (!) are not allowed; write plain keys and values")
        if isinstance(event, yaml.ScalarEvent):
            inside[-1].add(event.value, event.implicit[0], line)
        elif isinstance(event, yaml.CollectionStartEvent):
            if len(inside) > MAX_DEPTH:
                raise ValueError(
                    f"line {line}: is nested deeper than {MAX_DEPTH} levels, too deep to be read"
                )
            values: Any = {} if isinstance(event, yaml.MappingStartEvent) else []
            inside[-1].put(values, line)
            inside.append(_Collection(values))
        elif isinstance(event, yaml.CollectionEndEvent):
            inside.pop()
        elif isinstance(event, yaml.DocumentStartEvent) and document:
            raise ValueError(f"is not valid YAML: line {line}: a second document begins, expected one")
    return document[0] if document else None


class _Collection:
    """A list or a mapping whose end has not been read."""

    def __init__(self, values: Any) -> None:
        self.values = values
        self.key: str | None = None

    def add(self, text: str, plain: bool, line: int) -> None:
        """Take a key, or a value."""
        if isinstance(self.values, list) or self.key is not None:
            self.put(_scalar(text, line) if plain else text, line)
        elif text in self.values:
            raise ValueError(f"line {line}: key {text!r:.60} is given twice")
        else:
            self.key = text

    def put(self, value: Any, line: int) -> None:
        """Take a value."""
        if isinstance(self.values, list):
            self.values.append(value)
        elif self.key is None:
            raise ValueError(f"line {line}: a key must be plain text")
        else:
            self.values[self.key], self.key = value, None


def _scalar(text: str, line: int) -> Any:
    """The value of text without quotes."""
    if text in _WORDS:
        return _WORDS[text]
    if text[0] in "-0123456789" and _NUMBER.fullmatch(text):
        try:
            return _number(text)
        except ValueError as problem:
            raise ValueError(f"line {line}: {problem}") from None
    return text
