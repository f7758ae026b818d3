"""Untrusted files to text and JSON text to plain Python values, safely and quickly.

A layout file may come from anywhere, so nothing in it may run code, expand without bound or silently drop a
key.
"""

import json
from pathlib import Path
from typing import Any

from finlab.errors import LayoutError

MAX_BYTES = 1_000_000
"""Largest layout file that is read [bytes]; a real one has a few thousand."""


def read_text(path: Path, source: str) -> str:
    """Returns the text of a small regular file.

    Raises:
        LayoutError: it is missing, a folder, no regular file, too large, unreadable or not UTF-8 text.
    """
    try:
        if path.is_dir():
            raise LayoutError("is a folder, expected a layout file (.yaml or .json)", source=source)
        if not path.exists():
            raise LayoutError("no such file; check the path", source=source)
        if not path.is_file():
            raise LayoutError("is not a regular file, expected a layout file", source=source)
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        raise LayoutError(
            f"cannot be read: {getattr(error, 'strerror', None) or error}", source=source
        ) from None
    if len(raw) > MAX_BYTES:
        raise LayoutError(
            f"is larger than {MAX_BYTES:,} bytes; a layout file has a few thousand", source=source
        )
    return decode_text(raw, source)


def decode_text(raw: bytes, source: str) -> str:
    """Returns the text in bytes; a `LayoutError` where they are not UTF-8 text."""
    try:
        content = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise LayoutError("is not UTF-8 text, expected a YAML or JSON layout file", source=source) from None
    if "\0" in content:
        raise LayoutError("is a binary file, expected a YAML or JSON layout file", source=source)
    return content


def parse_json(content: str, source: str) -> Any:
    """Returns the values of a JSON document; a key given twice is refused."""

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        values = dict(pairs)
        if len(values) < len(pairs):
            names = [name for name, _ in pairs]
            twice = next(name for name in names if names.count(name) > 1)
            raise LayoutError(f"key {twice!r:.60} is given twice", source=source)
        return values

    try:
        return json.loads(content, object_pairs_hook=unique)
    except json.JSONDecodeError as error:
        raise LayoutError(f"is not valid JSON: line {error.lineno}: {error.msg}", source=source) from None
    except RecursionError:
        raise LayoutError("is nested too deeply to be a layout", source=source) from None
    except ValueError as error:
        raise LayoutError(f"holds a value that cannot be read: {str(error)[:120]}", source=source) from None
