"""Opens what a user may name as a layout: a shipped one, a layout file, a layout graph file, or a bundle."""

from __future__ import annotations

import os
from pathlib import Path

from finlab.assets import shipped_layouts
from finlab.bundle_files import GRAPH, is_bundle, read_bundle_files
from finlab.errors import LayoutError
from finlab.layout.file import parse_layout
from finlab.layout.graph_layout import SUFFIX, parse_graph_layout
from finlab.layout.layout import Layout
from finlab.layout.reading import decode_text, parse_json, read_text


def load_layout(layout: str | os.PathLike[str]) -> Layout:
    """Returns a shipped layout by its bare name, such as "A", or the layout in a file or bundle.

    Files are layout files (YAML, JSON) and layout graph files (`.graph.json`); a bundle is a folder or zip
    archive made by `finlab export`. A bare name is never looked up in the current folder while a layout of
    that name is shipped; write `./A` for a file called `A` there. Relative paths inside a layout file (a
    force table, a hull mesh) are taken from the file's own folder.

    Raises:
        LayoutError: the file cannot be read or is not a valid layout; the message names file and key.
        DataError: the bundle cannot be read, or was changed.
    """
    file = layout_path(layout)
    source = str(layout)
    if is_bundle(file):
        content = decode_text(read_bundle_files(file)[GRAPH], f"{source}/{GRAPH}")
        return parse_graph_layout(content, f"{source}/{GRAPH}")
    content = read_text(file, source)
    if file.name.endswith(SUFFIX):
        return parse_graph_layout(content, source)
    if file.suffix.lower() == ".json":
        data = parse_json(content, source)
    else:
        from finlab.layout.yaml_file import parse_yaml  # a robot's computer reads JSON and may lack PyYAML

        data = parse_yaml(content, source)
    return parse_layout(data, source=source, folder=file.resolve().parent)


def layout_path(layout: str | os.PathLike[str]) -> Path:
    """The path that a user means: text may be the name of a shipped layout, a `Path` is always a path.

    Raises:
        LayoutError: there is neither a shipped layout nor anything else of this name.
    """
    if not isinstance(layout, str):
        return Path(layout)
    shipped = shipped_layouts()
    if layout in shipped:
        return shipped[layout]
    path = Path(layout)
    try:
        if path.exists():
            return path
    except (OSError, ValueError) as error:  # a name that is too long, or holds a NUL byte
        reason = getattr(error, "strerror", None) or error
        raise LayoutError(f"layout {layout[:80]!r} cannot be a path: {reason}") from error
    raise LayoutError(
        f"layout {layout!r} is neither a file nor a shipped layout; "
        f"shipped are {', '.join(shipped) or 'none'}"
    )
