"""Opens what a user may name as a layout: a shipped one, a layout file, or a bundle."""

import os
from pathlib import Path

from finlab.assets import shipped_layouts
from finlab.bundle_files import is_bundle, read_bundle_files
from finlab.errors import LayoutError
from finlab.files.guarded import read_text
from finlab.files.plain_values import parse_json, parse_yaml
from finlab.layout.file import parse_layout
from finlab.layout.file_form import under
from finlab.layout.graph_form import is_graph, layout_in_graph
from finlab.layout.layout import Layout
from finlab.layout.robot_file import robot_of

MAX_BYTES = 1_000_000
"""Largest layout file that is read [bytes]; a real one has a few thousand."""
A_LAYOUT = "a layout file (.yaml or .json)"


def load_layout(layout: str | os.PathLike[str]) -> Layout:
    """Returns a shipped layout by its bare name, such as "A", or the layout in a file or bundle.

    Files are layout files (YAML, JSON) and layout graph files (JSON); a bundle is a folder or zip archive
    made by `finlab export`. A bare name is never looked up in the current folder while a layout of that name
    is shipped; write `./A` for a file called `A` there. Relative paths inside a layout file (a force table, a
    hull mesh) are taken from the file's own folder.

    Raises:
        LayoutError: the file cannot be read or is not a valid layout; the message names file and key.
        DataError: the bundle cannot be read, or was changed.
    """
    return layout_and_failed(layout)[0]


def layout_and_failed(layout: str | os.PathLike[str]) -> tuple[Layout, tuple[str, ...]]:
    """A layout as `load_layout` opens it, and the actuators that a bundle marks as failed."""
    file = layout_path(layout)
    source = str(layout)
    if is_bundle(file):
        robot = robot_of(read_bundle_files(file), source)
        return robot.layout, robot.failed
    content = read_text(file, MAX_BYTES, A_LAYOUT, LayoutError)
    return layout_in(content, file.suffix, source, file.resolve().parent), ()


def layout_in(
    text: str, suffix: str, source: str, folder: Path | None = None, *, may_open: bool = True
) -> Layout:
    """The layout in the text of a file whose name ends in `suffix`; the rest as for `parse_layout`.

    Raises:
        LayoutError: it is no JSON or YAML, or no layout.
    """
    parse = parse_json if suffix.lower() == ".json" else parse_yaml
    data = parse(text, source, LayoutError)
    if is_graph(data):
        with under(source=source):
            data = layout_in_graph(data)
    return parse_layout(data, source, folder, may_open=may_open)


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
