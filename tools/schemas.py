#!/usr/bin/env python3
"""Writes the published JSON Schemas from the types that files are read with: `make schemas`."""

import json
from pathlib import Path
from typing import Any

import msgspec

from finlab.layout.graph_file import Graph
from finlab.layout.load import layout_form

PACKAGE = Path(__file__).parents[1] / "finlab"


def schemas() -> dict[Path, str]:
    """Returns the text of each schema by its file."""
    kinds = {
        "layout/layout.schema.json": ("finlab-layout-2", layout_form()),
        "layout/graph.schema.json": ("finlab-graph-4", Graph),
    }
    texts = {}
    for name, (title, kind) in kinds.items():
        head = {
            "$schema": "https://json-schema.org/draft/2020-12/schema",
            "$id": f"{title}.schema.json",
        }
        schema = {**head, "title": title, **unwrapped(msgspec.json.schema(kind))}
        texts[PACKAGE / name] = json.dumps(schema, indent=1) + "\n"
    return texts


def unwrapped(schema: Any) -> Any:
    """Returns a schema whose descriptions, which come from docstrings, have one line for each
    paragraph: how wide the source is does not show in them."""
    if isinstance(schema, list):
        return [unwrapped(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    result = {}
    for key, value in schema.items():
        if key == "description" and isinstance(value, str):
            paragraphs = value.split("\n\n")
            result[key] = "\n\n".join(" ".join(words.split()) for words in paragraphs)
        else:
            result[key] = unwrapped(value)
    return result


if __name__ == "__main__":
    for path, text in schemas().items():
        path.write_text(text, encoding="utf-8")
