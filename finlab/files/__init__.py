"""Parses YAML, JSON and TOML into plain values: mappings, lists, text, true, false, null, numbers.

The text may come from a stranger. Nothing in it runs code, expands, drops a key, or takes more than
linear time. Numbers are those of JSON: whatever else YAML calls a number (0o17, 1_000, 1:30, .inf),
a date or a yes is text here.
"""

import json
import math
import re
import sys
from typing import Any

from finlab.errors import DataError, FinlabError

MAX_EVENTS = 30_000
"""Most YAML events (keys, values, brackets); a layout of 256 fins has about sixteen thousand."""
MAX_DEPTH = 20
"""Deepest nesting of YAML; a layout needs five levels."""
MAX_DIGITS = 100
"""Most characters of a number."""

_NUMBER = re.compile(r"-?(?:0|[1-9][0-9]*)(\.[0-9]+)?([eE][-+]?[0-9]+)?\Z")
"""A number of JSON."""
_CONSTANTS = {"": None, "null": None, "true": True, "false": False}
"""Plain scalars of YAML that are no text."""
MAX_TOML = 100_000
"""Longest TOML [characters]; its parser is not linear in all that it may hold."""
MAX_COMMENTED = 1_000_000
"""Longest JSON that may have comments [characters]."""
_JSON_PIECE = re.compile(
    r'(?P<text>"(?:[^"\\\n]|\\.)*"?)'
    r"|(?P<comment>//[^\n]*|\#[^\n]*|/\*(?:[^*]|\*(?!/))*(?:\*/)?)"
    r"|(?P<comma>,(?=\s*[}\]]))"
    r"|(?P<other>[^\"/#,]+|.)",
    re.DOTALL,
)
"""A text in quotes, a comment, a comma before a closing bracket, or anything else of JSON."""
_LAST_COMMA = re.compile(r'"(?:[^"\\\n]|\\.)*"?|,(?=\s*[}\]])', re.DOTALL)
"""A text in quotes, or a comma before a closing bracket."""
_ESCAPED_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")
"""Half of a surrogate pair as an escape of JSON."""


def parse_json(content: str, source: str, error: type[FinlabError] = DataError) -> Any:
    """Returns the values of a JSON document.

    Args:
        content: the text of the document.
        source: its name in the sentence of an error.
        error: the class of the error.

    Raises:
        FinlabError: of the class `error`: it is no JSON, holds a key twice, or a number that is not
            finite.
    """
    try:
        values = json.loads(
            content,
            object_pairs_hook=_without_duplicates,
            parse_float=_number,
            parse_constant=_number,
            parse_int=_number,
        )
        if _ESCAPED_SURROGATE.search(content):
            # Half of a pair is no character, and cannot be encoded: UnicodeError is a ValueError.
            json.dumps(values, ensure_ascii=False).encode()
        return values
    except json.JSONDecodeError as problem:
        raise error.in_file(
            source, f"is not valid JSON: line {problem.lineno}: {problem.msg}"
        ) from None
    except RecursionError:
        raise error.in_file(source, "is nested too deeply") from None
    except ValueError as problem:
        raise error.in_file(source, str(problem)[:160]) from None


def without_comments(content: str) -> str:
    """Returns JSON without its comments (`//`, `#`, `/* */`) and commas before a closing bracket.

    Lines keep their numbers, and what stands in quotes stays as it is; so does a text that is too
    long for a robot.
    """
    if len(content) > MAX_COMMENTED:
        return content
    pieces = []
    for match in _JSON_PIECE.finditer(content):
        piece = match[0]
        if match.lastgroup == "comment":
            piece = "\n" * piece.count("\n")
        elif match.lastgroup == "comma":
            piece = ""
        pieces.append(piece)
    # A comment may stand between a comma and the bracket.
    return _LAST_COMMA.sub(_kept_quotes, "".join(pieces))


def _kept_quotes(match: re.Match[str]) -> str:
    """A text in quotes as it is; nothing for a comma before a bracket."""
    return match[0] if match[0].startswith('"') else ""


def parse_toml(content: str, source: str, error: type[FinlabError] = DataError) -> Any:
    """Returns the values of a TOML document.

    Args:
        content: the text of the document.
        source: its name in the sentence of an error.
        error: the class of the error.

    Raises:
        FinlabError: of the class `error`: it is no TOML, is too large or too deep, holds a number
            that is not finite.
    """
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib
    if len(content) > MAX_TOML:
        raise error.in_file(source, f"is TOML of more than {MAX_TOML:,} characters, too large")
    try:
        return _plain(tomllib.loads(content), 0)
    except tomllib.TOMLDecodeError as problem:
        raise error.in_file(source, f"is not valid TOML: {problem!s:.160}") from None
    except RecursionError:
        raise error.in_file(source, "is nested too deeply") from None
    except ValueError as problem:
        raise error.in_file(source, str(problem)[:160]) from None


def _plain(value: Any, depth: int) -> Any:
    """A value of TOML as one of JSON: dates are text, and numbers are finite."""
    if depth > MAX_DEPTH:
        raise ValueError(f"is nested deeper than {MAX_DEPTH} levels, too deep to be read")
    if isinstance(value, dict):
        return {key: _plain(entry, depth + 1) for key, entry in value.items()}
    if isinstance(value, list):
        return [_plain(entry, depth + 1) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"holds {value}, expected a finite number")
    return value if isinstance(value, str | bool | int | float) else str(value)


def parse_yaml(content: str, source: str, error: type[FinlabError] = DataError) -> Any:
    """Returns the values of one YAML document, without aliases and tags.

    Args:
        content: the text of the document.
        source: its name in the sentence of an error.
        error: the class of the error.

    Raises:
        FinlabError: of the class `error`: it is no YAML, or holds an alias, a tag, a key twice or
            too much.
    """
    import yaml  # a robot's computer reads JSON and may lack PyYAML

    try:
        return _document(content)
    except yaml.YAMLError as problem:
        mark = getattr(problem, "problem_mark", None)
        message = getattr(problem, "problem", None) or str(problem).splitlines()[0]
        line = f"line {mark.line + 1}: " if mark else ""
        if "nesting depth" in message:  # of libyaml, before the first of our events
            deep = f"{line}is nested deeper than {MAX_DEPTH} levels, too deep to be read"
            raise error.in_file(source, deep) from None
        raise error.in_file(source, f"is not valid YAML: {line}{message}"[:200]) from None
    except ValueError as problem:
        raise error.in_file(source, str(problem)[:200]) from None


def yaml_text(values: Any) -> str:
    """Returns the text of plain values, in their order."""
    import yaml

    style: Any = {
        "sort_keys": False,
        "allow_unicode": True,
        "default_flow_style": None,
        "width": 110,
    }
    return str(yaml.safe_dump(values, **style))


def _number(text: str) -> int | float:
    """A finite number as JSON writes it."""
    if len(text) > MAX_DIGITS:
        raise ValueError(f"holds a number of {len(text):,} digits, expected at most {MAX_DIGITS}")
    value = int(text) if text.lstrip("-").isdigit() else float(text)
    if not math.isfinite(value):
        raise ValueError(f"holds {text}, expected a finite number")
    return value


def _without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A mapping of the pairs of a JSON object; refused where a key stands twice."""
    values: dict[str, Any] = {}
    for key, value in pairs:
        if key in values:
            raise ValueError(f"key {key!r:.60} is given twice")
        values[key] = value
    return values


def _document(content: str) -> Any:
    """The value of the document; all its events are checked before any value is built."""
    import yaml

    # libyaml's parser is ten times as fast, but PyYAML may have been built without it.
    loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    depth = n_documents = 0
    for count, event in enumerate(yaml.parse(content, Loader=loader)):
        line = event.start_mark.line + 1 if event.start_mark else 0
        if count > MAX_EVENTS:
            raise ValueError(
                f"line {line}: has more than {MAX_EVENTS} entries, too many to be read"
            )
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
            raise ValueError(
                f"line {line}: anchors and aliases (&, *) are not allowed; write the value out"
            )
        if getattr(event, "tag", None):
            raise ValueError(f"line {line}: tags (!) are not allowed; write plain keys and values")
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(
            event, yaml.CollectionEndEvent
        )
        if depth > MAX_DEPTH:
            raise ValueError(
                f"line {line}: is nested deeper than {MAX_DEPTH} levels, too deep to be read"
            )
        n_documents += isinstance(event, yaml.DocumentStartEvent)
        if n_documents > 1:
            raise ValueError(
                f"is not valid YAML: line {line}: a second document begins, expected one"
            )
    node = yaml.compose(content, loader)
    return None if node is None else _value(node)


def _value(node: Any) -> Any:
    """The value of a YAML node; refused where a mapping has a key twice."""
    if node.id == "sequence":
        return [_value(item) for item in node.value]
    if node.id == "mapping":
        values: dict[str, Any] = {}
        for key, value in node.value:
            line = key.start_mark.line + 1
            if key.id != "scalar":
                raise ValueError(f"line {line}: a key must be plain text")
            if key.value in values:
                raise ValueError(f"line {line}: key {key.value!r:.60} is given twice")
            values[key.value] = _value(value)
        return values
    if node.style or not (node.value in _CONSTANTS or _NUMBER.match(node.value)):
        return node.value
    try:
        return _CONSTANTS[node.value] if node.value in _CONSTANTS else _number(node.value)
    except ValueError as problem:
        raise ValueError(f"line {node.start_mark.line + 1}: {problem}") from None
