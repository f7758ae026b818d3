#!/usr/bin/env python3
"""Writes the published JSON Schemas from the types that files are read with: `make schemas`."""

import json
from pathlib import Path

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
        texts[PACKAGE / name] = (
            json.dumps({**head, "title": title, **msgspec.json.schema(kind)}, indent=1) + "\n"
        )
    return texts


if __name__ == "__main__":
    for path, text in schemas().items():
        path.write_text(text, encoding="utf-8")
