"""Layouts, hulls and bundles as files that a browser sends and takes, and designs in links.

Browsers do not send the part of an address behind its # to a server, so a link shows a design to
whoever opens it, and not to the way. What comes out of a link is treated like any file that a
browser sends.
"""

import base64
import binascii
import contextlib
import os
import re
import zlib
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

from finlab.assets import shipped_layouts
from finlab.deploy.bundle import with_tables_inside
from finlab.errors import FinlabError, LayoutError
from finlab.exchange import Answers
from finlab.files import yaml_text
from finlab.files.guarded import packed as pack
from finlab.layout import Layout, layout_to_dict, load_layout
from finlab.layout.body import Hull
from finlab.layout.load import MAX_BYTES
from finlab.physics import plant_of
from finlab.swim import design_files
from finlab.swim.hull.mesh_file import Mesh, SizeError, stl_of
from finlab.swim.hull.surface import UNITS, Surface

FRAGMENT = "design="
"""What the part behind the # begins with."""
WRENCH = "&wrench="
"""What stands before the six components of the wrench, after the design."""
BESIDE = "&beside="
"""What stands before the design of a second robot, after the wrench."""
MAX_LINK = 16_000
"""Most characters of a design in a link; chats and mail programs cut longer ones."""
PLAIN, ARCHIVE = "y", "a"
"""First character: a layout's YAML, compressed, or a ZIP archive with the files that it names."""
BUNDLE, GRAPH, CANDIDATES = "_bundle.zip", ".graph.json", "_candidates.csv"
CAPABILITY = "_capability"
"""Ends of the names of files, after the layout's."""
NO_DESIGN = "the link holds no whole design; copy all of it, or ask for the file"


@cache
def shipped() -> dict[str, Layout]:
    """Shipped layouts by the name that the command line knows them by."""
    return {name: load_layout(path) for name, path in shipped_layouts().items()}


def shipped_name(layout: Layout) -> str | None:
    """The name of the shipped layout that this one equals, None if it is none of them."""
    return next((name for name, known in shipped().items() if known == layout), None)


def file_stem(name: str) -> str:
    """A layout's name as the name of a file, without surprises."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_") or "layout"


def has_files(layout: Layout) -> bool:
    """Whether its file names others: tables of measured fins, a learned interaction, or a hull's
    mesh."""
    hull = None if layout.body is None else layout.body.hull
    return bool(layout.files) or (hull is not None and hull.mesh is not None)


def design_name(layout: Layout) -> str:
    """Name of the file that a layout is saved as."""
    return f"{file_stem(layout.name)}.{'zip' if has_files(layout) else 'yaml'}"


def robot_file(layout: Layout) -> str:
    """What commands and scripts open a robot by: its name where it is shipped, else the file that
    the page makes of it."""
    shipped = shipped_name(layout)
    if shipped is not None:
        return shipped
    return file_stem(layout.name) + BUNDLE if has_files(layout) else design_name(layout)


def read_layout(
    name: str, content: bytes, answers: Answers = design_files.NO_ANSWERS
) -> design_files.Opened | design_files.Unanswered:
    """The layout in an uploaded layout, bundle, archive or description; or the questions that the
    answers leave open. LayoutError, with file and key: too large, no text, no layout, or a force
    table is missing. DataError: a table cannot be read."""
    source = Path(str(name)).name[:80] or "upload"
    if source.lower().endswith(".zip"):
        opened: design_files.Opened | design_files.Unanswered = design_files.read_archive(
            source, content, cache_folder()
        )
    elif len(content) > MAX_BYTES:
        raise LayoutError(
            f"is larger than {MAX_BYTES:,} bytes, a layout has a few thousand", source=source
        )
    else:
        opened = design_files.read_design(source, content, cache_folder(), answers)
    if isinstance(opened, design_files.Opened):
        plant_of(opened.layout)  # reads the tables of its fins
    return opened


def layout_file(layout: Layout) -> tuple[str, bytes]:
    """Name and content of the layout's file: YAML, or an archive with the files that it names.
    DataError: a table or the hull's mesh cannot be read, or is too large to travel."""
    stem = file_stem(layout.name)
    inside, tables = with_tables_inside(layout)
    inside, hull = design_files.with_hull_inside(inside)
    text = yaml_text(layout_to_dict(inside)).encode()
    parts = {**tables, **hull}
    return design_name(layout), pack({f"{stem}.yaml": text, **parts}) if parts else text


def cache_folder() -> Path:
    """Where the app keeps files of its own: `$XDG_CACHE_HOME/finlab`, or `~/.cache/finlab`."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "finlab"


def table_folder() -> Path:
    """Where the app keeps the force tables of fins."""
    return cache_folder() / design_files.TABLE_FOLDER


def stored_hull(name: str, content: bytes) -> Hull:
    """The hull in an uploaded mesh file, which is checked and kept under a name made from its
    content; in the first unit in which it has the size of one. FinlabError: it is no mesh, too
    large, or cannot be kept."""
    short = Path(str(name)).name[-80:] or "upload"
    for scale in UNITS.values():
        with contextlib.suppress(SizeError):
            return Hull(
                mesh=design_files.stored_mesh(short, content, scale, cache_folder()), scale=scale
            )
    return Hull(
        mesh=design_files.stored_mesh(short, content, 1.0, cache_folder())
    )  # which says what is wrong


def reshaped_hull(hull: Hull, change: Callable[[Mesh], Mesh]) -> Hull:
    """A hull from a mesh file with another shape, in metres about the middle of its box; kept like
    an upload. FinlabError: the hull is no mesh, its file is gone, or what comes of it is no
    hull."""
    if hull.mesh is None:
        raise FinlabError("the hull is drawn from a shape; import a mesh first")
    drawn = Surface.of_file(hull.mesh, hull.scale, (0.0, 0.0, 0.0))
    content = stl_of(change(drawn.mesh))
    return replace(
        hull, mesh=design_files.stored_mesh("hull.stl", content, 1.0, cache_folder()), scale=1.0
    )


def parts_of_link(text: str) -> tuple[str, str, str]:
    """What a link carries behind its #.

    Args:
        text: that part of the address; it may be anything.

    Returns:
        The design, the six components of the wrench, and the design of a second robot that stands
        beside it; each empty where there is none.
    """
    question, _, other = text.strip().removeprefix(FRAGMENT).partition(BESIDE)
    design, _, wrench = question.partition(WRENCH)
    return design, wrench, other


def packed(layout: Layout, most: int = MAX_LINK) -> str:
    """A whole design as text of letters, digits, `-` and `_`. FinlabError: it is longer than `most`
    characters, or a file of it cannot be read."""
    name, content = layout_file(layout)
    is_archive = name.endswith(".zip")
    data = content if is_archive else zlib.compress(content, 9)
    text = (ARCHIVE if is_archive else PLAIN) + base64.urlsafe_b64encode(data).decode().rstrip("=")
    if len(text) > most:
        files, kind = (" with its files", "ZIP") if is_archive else ("", "file")
        raise FinlabError(
            f"{layout.name}{files} needs {len(text):,} characters, a link carries {most:,}; save "
            f"it, and share the {kind}"
        )
    return text


def unpacked(text: str) -> design_files.Opened:
    """The design in a link, checked like an upload; it may be anything. FinlabError: it holds no
    design, or a wrong one."""
    kind = text[:1]
    coded = text[1:]
    try:
        data = base64.b64decode(coded + "=" * (-len(coded) % 4), altchars=b"-_", validate=True)
        if kind == PLAIN:
            unpacking = zlib.decompressobj()
            data = unpacking.decompress(
                data, MAX_BYTES + 1
            )  # a small text may stand for a huge one
            if len(data) <= MAX_BYTES and not unpacking.eof:
                raise zlib.error("cut off")
    except (binascii.Error, ValueError, zlib.error):
        kind = ""
    if kind not in (PLAIN, ARCHIVE) or not kind:
        raise FinlabError(NO_DESIGN)
    opened = read_layout("link.yaml" if kind == PLAIN else "link.zip", data)
    if not isinstance(opened, design_files.Opened):
        raise FinlabError(NO_DESIGN)
    return opened
