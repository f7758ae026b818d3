"""A layout with the files that it names, force tables and a hull, as one archive; from strangers,
too.

A layout that a stranger sends may name any path. None of them is ever opened: what is read came
along with it, and is kept under a name made from its content.
"""

import hashlib
import os
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from finlab.bundle_files import (
    MANIFEST_FILE,
    MAX_BUNDLE_BYTES,
    MAX_FILE_BYTES,
    MAX_TABLE_BYTES,
    parse_bundle_archive,
)
from finlab.deploy.bundle import renamed
from finlab.errors import DataError, LayoutError, layout_errors_at
from finlab.exchange import Answers, Note, Question, read_asking
from finlab.files.guarded import decoded, read_file, unpacked
from finlab.interaction.learned import NETWORK_SUFFIX
from finlab.layout import FinModelSpec, Layout
from finlab.layout.body import MESH_SUFFIXES
from finlab.layout.bundled_robot import robot_of
from finlab.layout.load import EXPECTED_LAYOUT_FILE, MAX_BYTES, parse_layout, parse_layout_text
from finlab.swim.hull.mesh_file import MAX_FACES, read_mesh, simplified, stl_of
from finlab.whole_file import make_folder, write_whole

LAYOUTS = (".yaml", ".yml", ".json")
# where files are kept, inside a folder
TABLE_FOLDER = "tables"
HULL_FOLDER = "hulls"
NO_ANSWERS: Answers = {}
"""Of somebody who was not asked yet."""
A_DESIGN = "a layout, a robot description, parameters, a matrix"


def stored_table(content: bytes, folder: Path) -> FinModelSpec:
    """The model of a force table, which is kept in a folder under a name made from its content.
    FinlabError: it cannot be kept."""
    return FinModelSpec("table", (("path", _kept(content, folder, ".csv")),))


def _kept(content: bytes, folder: Path, suffix: str) -> str:
    path = make_folder(folder) / f"{hashlib.sha256(content).hexdigest()}{suffix}"
    if not path.exists():
        write_whole(path, content, DataError)
    return str(path)


def with_hull_inside(layout: Layout) -> tuple[Layout, dict[str, bytes]]:
    """A layout whose hull's mesh has a name that can travel, and its content by that name; as it is
    where its hull is drawn from a shape. Raises DataError: the mesh cannot be read."""
    hull = None if layout.body is None else layout.body.hull
    if layout.body is None or hull is None or hull.mesh is None:
        return layout, {}
    path = Path(hull.mesh)
    content = read_file(path, MAX_TABLE_BYTES, "the hull's mesh; import it again")
    name = f"hull{path.suffix.lower()}"
    return replace(layout, body=replace(layout.body, hull=replace(hull, mesh=name))), {
        name: content
    }


class Opened(NamedTuple):
    """A layout that a stranger sent."""

    layout: Layout
    """Every file that it names is kept in that folder, under a name made from its content."""
    missing: tuple[str, ...] = ()
    """Files that it named and that did not come with it, though the layout makes sense without."""
    lost: tuple[str, ...] = ()
    """Actuators that a bundle says are lost."""
    notes: tuple[Note, ...] = ()
    """What was taken where a robot description is silent."""


class Unanswered(NamedTuple):
    """A file that somebody can be asked about."""

    questions: tuple[Question, ...]
    """What it leaves open."""
    notes: tuple[Note, ...]
    """What was taken by the defaults."""


def read_archive(source: str, content: bytes, folder: Path) -> Opened:
    """The layout in a zip archive: a bundle, or a layout file with the tables and the mesh that it
    names.

    These are kept in folders inside `folder`. Raises LayoutError: it is no such archive, its layout
    is none, or names a table that is not in it; DataError: a bundle that was changed, or a table
    that cannot be read."""
    inside = Path(os.path.abspath(source))
    manifest_alone = {MANIFEST_FILE: MAX_FILE_BYTES[MANIFEST_FILE]}.get
    if unpacked(content, source, manifest_alone, MAX_BUNDLE_BYTES, LayoutError):
        parts = parse_bundle_archive(content, source)
        robot = robot_of(parts, source, parse_layout)
        layout = robot.layout
        lost = robot.lost
    else:
        parts = unpacked(content, source, partial(_largest, source), MAX_BUNDLE_BYTES, LayoutError)
        layouts = [name for name in parts if name.endswith(LAYOUTS)]
        if len(layouts) != 1:
            raise LayoutError(
                f"holds {len(parts)} files, {len(layouts)} of them layouts; expected a bundle, or "
                "one layout file with its force tables",
                source=source,
            )
        (file,) = layouts
        layout = layout_of(f"{source}/{file}", parts[file], (inside / file).parent)
        lost = ()
    by_path = {str(inside / name): part for name, part in parts.items()}
    return adopted(layout, by_path, folder, source)._replace(lost=lost)


def read_design(
    source: str, content: bytes, folder: Path, answers: Answers = NO_ANSWERS
) -> Opened | Unanswered:
    """The layout in a file of any form that `finlab layout convert` reads, which opens no other
    file; or the questions that the answers leave open. Raises LayoutError: it is none of these, or
    something in it is wrong."""
    text = decoded(content, source, A_DESIGN, LayoutError)
    with layout_errors_at(source=source):
        reading = read_asking(text, source, answers)
    if reading.questions or reading.layout is None:
        return Unanswered(reading.questions, reading.notes)
    return adopted(reading.layout, {}, folder, source)._replace(notes=reading.notes)


def layout_of(source: str, content: bytes, folder: Path | None = None) -> Layout:
    """The layout in the content of a file; what it names is taken to be in `folder`, and not looked
    at. Raises LayoutError: it is no text, or no layout."""
    text = decoded(content, source, EXPECTED_LAYOUT_FILE, LayoutError)
    return parse_layout_text(text, Path(source).suffix, source, folder, may_open=False)


def adopted(layout: Layout, parts: Mapping[str, bytes], folder: Path, source: str) -> Opened:
    """A layout from a stranger, which may name any path, and the parts that came along kept in a
    folder; no other file is opened. These have the paths by which the layout can name them; a file
    of the same name does where there is no other, since files that are sent at once have lost their
    folders. Raises LayoutError: the layout, called `source`, names a force table that did not come
    along; FinlabError: a file cannot be kept, or is no hull."""
    by_name = {Path(path).name: path for path in parts}

    def came(path: str) -> str:
        """The path by which a file came that a layout names."""
        return path if path in parts else by_name.get(Path(path).name, path)

    names: dict[str, str] = {}
    for path in layout.files:
        if (here := came(path)) not in parts:
            raise LayoutError(
                f"names {Path(path).name!r:.60}, which did not come along; put the layout and its "
                "tables, or its learned interaction, into one ZIP archive, and open that",
                source=source,
            )
        is_network = layout.interaction is not None and path == layout.interaction.reads
        suffix = NETWORK_SUFFIX if is_network else ".csv"
        names[path] = _kept(parts[here], folder / TABLE_FOLDER, suffix)
    layout, body = renamed(layout, names), layout.body
    if body is None or body.hull is None or body.hull.mesh is None:
        return Opened(layout)
    mesh = came(body.hull.mesh)
    hull = None
    if mesh in parts:
        hull = replace(
            body.hull, mesh=stored_mesh(Path(mesh).name, parts[mesh], body.hull.scale, folder)
        )
    missing = () if hull else (Path(mesh).name[-60:],)
    return Opened(replace(layout, body=replace(body, hull=hull)), missing)


def stored_mesh(name: str, content: bytes, scale: float, folder: Path) -> str:
    """Path of a hull's mesh, which is checked and kept inside a folder under a name made from its
    content.

    One of too many triangles is kept with fewer. Raises FinlabError: it is no closed mesh, too
    large, or cannot be kept."""
    mesh, report = read_mesh(name, content, scale)
    if report.triangles > MAX_FACES:
        fewer = simplified(mesh, MAX_FACES)
        name = "hull.stl"
        content = stl_of(fewer._replace(vertices=fewer.vertices / scale))
    return _kept(content, folder / HULL_FOLDER, Path(name).suffix.lower())


def _largest(source: str, name: str) -> int:
    """Largest size [bytes] of a file; refuses names that lead out of the folder, or that no layout
    needs."""
    path = PurePosixPath(name)
    known = path.suffix.lower() in (".csv", NETWORK_SUFFIX, *MESH_SUFFIXES, *LAYOUTS)
    if path.is_absolute() or ".." in path.parts or "\\" in name or ":" in name or not known:
        raise LayoutError(
            f"holds {name!r:.60}, expected a layout file, CSV tables and a mesh", source=source
        )
    return MAX_BYTES if name.endswith(LAYOUTS) else MAX_TABLE_BYTES
