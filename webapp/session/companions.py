"""Force tables of fins: kept under a name made from their content, and carried along with layouts."""

import hashlib
import io
import tempfile
import zipfile
from dataclasses import replace
from pathlib import Path, PurePosixPath

from finlab.bundle_files import ABOUT, LARGEST_BUNDLE, LARGEST_TABLE, MOST_FILES, UNREADABLE
from finlab.errors import DataError, FinlabError, LayoutError
from finlab.layout import FinModelSpec, Layout, load_layout
from finlab.layout.reading import MAX_BYTES
from finlab.physics.table_file import table_bytes
from finlab.whole_file import write_whole

LAYOUTS = (".yaml", ".yml", ".json")
"""How the layout's file in an archive may end."""


def stored_table(content: bytes, folder: Path) -> FinModelSpec:
    """The model of a force table, which is kept in a folder under a name made from its content.

    Raises:
        FinlabError: it cannot be kept.
    """
    path = folder / f"{hashlib.sha256(content).hexdigest()}.csv"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FinlabError(f"{folder}: cannot be made: {error.strerror}") from None
    if not path.exists():
        write_whole(path, content, DataError)
    return FinModelSpec("table", (("path", str(path)),))


def has_tables(layout: Layout) -> bool:
    """Whether a fin is known by a table, so that the layout needs more than its own file."""
    return any(fin.model.type == "table" for fin in layout.fins)


def archive_of(name: str, document: bytes, tables: dict[str, bytes]) -> bytes:
    """A document and the force tables that it names, as one zip archive; the same bytes each time."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for part, content in {name: document, **tables}.items():
            archive.writestr(zipfile.ZipInfo(part, (1980, 1, 1, 0, 0, 0)), content, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def read_archive(source: str, content: bytes, folder: Path) -> Layout:
    """The layout in a zip archive: a bundle, or a layout file with the force tables that it names.

    Its tables are kept in `folder`.

    Raises:
        LayoutError: it is no such archive, or its layout is none.
        DataError: a bundle that was changed, or a table that cannot be read.
    """
    with tempfile.TemporaryDirectory() as place:
        packed = Path(place) / "upload.zip"
        packed.write_bytes(content)
        try:
            layout = load_layout(_unpacked(packed, source, Path(place) / "files"))
            fins = tuple(
                replace(fin, model=stored_table(table_bytes(str(fin.model.values()["path"])), folder))
                if fin.model.type == "table"
                else fin
                for fin in layout.fins
            )
        except FinlabError as error:
            text = str(error).replace(str(packed), source).replace(f"{place}/files/", f"{source}/")
            raise type(error)(text) from None
    return replace(layout, fins=fins)


def _unpacked(packed: Path, source: str, folder: Path) -> Path:
    """The layout's file of an archive, its tables beside it; the archive itself where it is a bundle."""
    try:
        with zipfile.ZipFile(packed) as archive:
            entries = [entry for entry in archive.infolist() if not entry.is_dir()]
            names = [entry.filename for entry in entries]
            if ABOUT in names:
                return packed
            layouts = [name for name in names if name.endswith(LAYOUTS)]
            if len(layouts) != 1 or len(names) > MOST_FILES:
                raise LayoutError(
                    f"holds {len(names)} files, {len(layouts)} of them layouts; expected a bundle, or one "
                    "layout file with its force tables",
                    source=source,
                )
            left = LARGEST_BUNDLE
            for entry in entries:
                _check_name(entry.filename, source)
                with archive.open(entry) as stream:
                    most = MAX_BYTES if entry.filename in layouts else LARGEST_TABLE
                    content = stream.read(min(most, left) + 1)
                left -= len(content)
                if len(content) > most or left < 0:
                    raise LayoutError(f"{entry.filename} in it is too large", source=source)
                path = folder / entry.filename
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
            return folder / layouts[0]
    except UNREADABLE as error:
        raise LayoutError(f"cannot be read as a zip archive: {error}", source=source) from None


def _check_name(name: str, source: str) -> None:
    """Refuse names that lead out of the folder, or that no layout needs."""
    path = PurePosixPath(name)
    known = path.suffix.lower() in (".csv", *LAYOUTS)
    if path.is_absolute() or ".." in path.parts or "\\" in name or ":" in name or not known:
        raise LayoutError(f"holds {name!r:.60}, expected a layout file and CSV tables", source=source)
