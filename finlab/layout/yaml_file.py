"""YAML layout files: untrusted text to plain values, and values to text people like to edit."""

import re
from typing import TYPE_CHECKING, Any

import yaml

from finlab.errors import LayoutError
from finlab.layout.rules import under

MAX_EVENTS = 30_000
"""Most YAML events (keys, values, brackets); a layout of 16 fins has under a thousand."""
MAX_DEPTH = 20
"""Deepest nesting; a layout needs five levels."""

if TYPE_CHECKING:
    _Base = yaml.SafeLoader
else:  # libyaml's parser is ten times as fast, but PyYAML may have been built without it
    _Base = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_Base):
    """Safe YAML loader that refuses a key given twice and reads `1e-3` as the number it is."""

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        seen: set[str] = set()
        for key_node, _ in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                raise LayoutError(f"line {key_node.start_mark.line + 1}: a key must be plain text")
            if key_node.value in seen:
                raise LayoutError(
                    f"line {key_node.start_mark.line + 1}: key {key_node.value!r:.60} is given twice"
                )
            seen.add(key_node.value)
        result: dict[Any, Any] = super().construct_mapping(node, deep=deep)
        return result


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?[0-9][0-9_]*(\.[0-9_]*)?[eE][-+]?[0-9]+$"),
    list("-+0123456789"),
)


def parse_yaml(content: str, source: str) -> Any:
    """Returns the values of one YAML document; aliases, tags and duplicate keys are refused."""
    try:
        with under(source=source):
            _inspect(content)
            return yaml.load(content, Loader=_Loader)  # noqa: S506 (a safe loader)
    except yaml.YAMLError as error:
        raise LayoutError(f"is not valid YAML: {_place(error)}", source=source) from None
    except (ValueError, OverflowError, RecursionError) as error:
        raise LayoutError(f"holds a value that cannot be read: {str(error)[:120]}", source=source) from None


def yaml_text(data: Any) -> str:
    """The text of plain values, in their order."""
    text: str = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, default_flow_style=None, width=110)
    return text


def _inspect(content: str) -> None:
    """Walks the YAML events, at a cost in proportion to the text, before anything is built from them."""
    depth = 0
    for count, event in enumerate(yaml.parse(content, Loader=_Loader)):
        line = event.start_mark.line + 1 if event.start_mark else 0
        if count > MAX_EVENTS:
            raise LayoutError(f"line {line}: has more than {MAX_EVENTS} entries, too many for a layout")
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
            raise LayoutError(
                f"line {line}: anchors and aliases (& and *) are not allowed; write the value out"
            )
        if getattr(event, "tag", None):
            raise LayoutError(f"line {line}: tags (!) are not allowed; write plain keys and values")
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > MAX_DEPTH:
                raise LayoutError(
                    f"line {line}: is nested deeper than {MAX_DEPTH} levels, too deep for a layout"
                )
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1


def _place(error: yaml.YAMLError) -> str:
    """Returns one line of text on where and why YAML parsing stopped."""
    mark = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None) or str(error).splitlines()[0]
    return f"line {mark.line + 1}: {problem}" if mark else str(problem)[:160]
