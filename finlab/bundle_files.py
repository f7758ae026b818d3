"""The files of a deployment bundle, from a folder or a zip archive that may come from a stranger.

Nothing is unpacked, no link is followed, nothing is read beyond its largest size, and no content is believed
before its checksum fits. What the files mean is known to the rooms that read them: layout graph and force
tables to `finlab.layout` and `finlab.physics`, compiled fins to `finlab.forces`, weights to
`finlab.inference`, settings to `finlab.allocation`.
"""

import hashlib
import json
import os
import re
import stat
import zipfile
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path

from finlab.errors import DataError

VERSION = 3
"""Version of the bundle; a reader knows exactly one."""
GRAPH, ABOUT = "layout.graph.json", "bundle.json"
COMPILED = "compiled_fins.safetensors"
"""What each fin can do, ready for the search."""
TABLES = "tables/"
"""Folder of the fins' force tables, each named by the SHA-256 of its content."""
CHECKPOINT = "checkpoint/"
"""Folder of the weights, itself a checkpoint; there for methods with networks."""
README, CHECKSUMS = "README.md", "SHA256SUMS"
LARGEST = {
    GRAPH: 1_000_000,
    ABOUT: 100_000,
    COMPILED: 5_000_000,
    f"{CHECKPOINT}config.json": 1_000_000,
    f"{CHECKPOINT}model.safetensors": 50_000_000,
    README: 100_000,
    CHECKSUMS: 10_000,
}
"""All that a bundle may hold beside force tables, and the largest size of each file [bytes]."""
LARGEST_TABLE = 20_000_000
"""Largest size of a force table in a bundle [bytes]."""
LARGEST_BUNDLE = 100_000_000
"""Largest size of all files together [bytes]."""
MOST_FILES = len(LARGEST) + 16
"""Most files; a robot has up to 16 fins, each with a table at most."""
REQUIRED = (GRAPH, ABOUT, COMPILED, CHECKSUMS)
UNREADABLE = (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, ValueError, zlib.error)
"""What reading a zip archive ends with that is damaged, locked or none."""

Files = Mapping[str, bytes]
"""Contents by name."""

_TABLE = re.compile(TABLES + r"[0-9a-f]{64}\.csv")


def largest(name: str) -> int:
    """Largest size [bytes] of the file of this name; -1 for names that no bundle holds."""
    return LARGEST_TABLE if _TABLE.fullmatch(name) else LARGEST.get(name, -1)


def table_name(content: bytes) -> str:
    """The name of a force table in a bundle."""
    return f"{TABLES}{hashlib.sha256(content).hexdigest()}.csv"


def is_bundle(path: str | os.PathLike[str]) -> bool:
    """Whether a path looks like a bundle, of whatever version: a zip archive, or a folder with its files."""
    place = Path(path)
    try:
        if place.is_dir():
            return (place / ABOUT).is_file()
        return place.suffix == ".zip" and place.is_file()
    except (OSError, ValueError):  # a name that is too long, or holds a NUL byte
        return False


def archive_around(path: str | os.PathLike[str]) -> str | None:
    """The zip archive of a bundle that a force table lies in, as in `robot.zip/tables/x.csv`; None for a
    file that lies in none."""
    if ".zip" not in os.fspath(path):  # asked for each table at each answer
        return None
    tables = os.path.dirname(path)
    archive = os.path.dirname(tables)
    within = archive.endswith(".zip") and os.path.basename(tables) + "/" == TABLES
    return archive if within and os.path.isfile(archive) else None


def read_bundle_files(path: str | os.PathLike[str]) -> dict[str, bytes]:
    """The files of a bundle by name, with checksums that fit.

    Raises:
        DataError: it cannot be read, is of another version, was changed, or holds what no bundle holds.
    """
    source = str(path)
    files = _Contents(source)
    try:
        if os.path.isdir(source):
            _read_folder(Path(path), files)
        else:
            _read_archive(files)
    except OSError as error:
        raise DataError(f"{source}: cannot be read: {error.strerror or error}") from None
    except UNREADABLE as error:
        reason = str(error).splitlines()[0][:80] if str(error) else type(error).__name__
        raise DataError(f"{source}: is neither a bundle's folder nor its zip archive ({reason})") from None
    check_bundle_files(files, source)
    return dict(files)


def check_bundle_files(files: Files, source: str) -> None:
    """Raise a `DataError` unless version, files and checksums are right."""
    _check_version(files.get(ABOUT), source)
    for name in REQUIRED:
        if name not in files:
            raise DataError(f"{source}: {name} is missing; a bundle is made by `finlab export LAYOUT -o DIR`")
    rest = {name: content for name, content in files.items() if name != CHECKSUMS}
    if checksums(rest) == files[CHECKSUMS]:
        return
    listed = files[CHECKSUMS].decode("utf-8", "replace").splitlines()
    wrong = next(
        (line[66:] for line in checksums(rest).decode().splitlines() if line not in listed), CHECKSUMS
    )
    raise DataError(f"{source}: {wrong} does not fit {CHECKSUMS}; it was changed; copy the bundle again")


def checksums(files: Files) -> bytes:
    """The lines of `SHA256SUMS`, which `sha256sum -c` reads as well."""
    lines = (f"{hashlib.sha256(files[name]).hexdigest()}  {name}\n" for name in sorted(files))
    return "".join(lines).encode()


def checkpoint_part(files: Files) -> dict[str, bytes]:
    """The files of the checkpoint inside a bundle, by their names in it; empty where there is none."""
    return {name.removeprefix(CHECKPOINT): c for name, c in files.items() if name.startswith(CHECKPOINT)}


class _Contents(dict[str, bytes]):
    """Files that are being read, of this version, none beyond its largest size, nor all together."""

    def __init__(self, source: str) -> None:
        super().__init__()
        self.source, self.left = source, LARGEST_BUNDLE

    def take(self, name: str, read: Callable[[int], bytes]) -> None:
        """Read one more."""
        most = largest(name)
        content = read(min(most, self.left) + 1)
        if len(content) > most:
            raise DataError(f"{self.source}: {name} is larger than {most:,} bytes")
        self.left -= len(content)
        if len(self) >= MOST_FILES:
            raise DataError(f"{self.source}: holds more than {MOST_FILES} files")
        if self.left < 0:
            raise DataError(f"{self.source}: its files are larger than {LARGEST_BUNDLE:,} bytes together")
        self[name] = content
        if name == ABOUT:
            _check_version(content, self.source)


def _read_folder(path: Path, files: _Contents) -> None:
    for name in (ABOUT, *sorted((set(LARGEST) - {ABOUT}) | _tables_in(path))):
        file = path / name
        try:
            about = file.lstat()
        except FileNotFoundError:
            continue
        if not stat.S_ISREG(about.st_mode) or (file.parent != path and file.parent.is_symlink()):
            raise DataError(f"{files.source}: {name} is no regular file")
        with file.open("rb") as stream:
            files.take(name, stream.read)


def _tables_in(path: Path) -> set[str]:
    """Names of the force tables in a bundle's folder."""
    try:
        return {name for entry in os.scandir(path / TABLES) if _TABLE.fullmatch(name := TABLES + entry.name)}
    except (FileNotFoundError, NotADirectoryError):
        return set()


def _read_archive(files: _Contents) -> None:
    with zipfile.ZipFile(files.source) as archive:
        # The version comes first: files of another one are not the news.
        entries = sorted(archive.infolist(), key=lambda entry: entry.filename != ABOUT)
        for entry in entries:
            # Nothing is unpacked, so a name can do no harm; still, a bundle holds these files only.
            if largest(entry.filename) < 0 or entry.filename in files:
                layout = entry.filename.endswith((".yaml", ".graph.json"))
                hint = "; unpack it, and name the layout file in it" if layout else ""
                name = f"{entry.filename!r:.60}"
                raise DataError(f"{files.source}: holds {name}, which is no part of a bundle{hint}")
            with archive.open(entry) as stream:
                files.take(entry.filename, stream.read)


def _check_version(about: bytes | None, source: str) -> None:
    """Refuse bundles of other versions; what cannot be understood is left to its reader."""
    try:
        document = json.loads(about or b"null")
    except (ValueError, RecursionError):
        return
    if not isinstance(document, dict):
        return
    version = document.get("version")
    if type(version) is not int or version != VERSION:  # neither 3.0 nor "3"
        raise DataError(
            f"{source}: is a bundle of version {version!r:.40}, this finlab reads version {VERSION}; "
            "export it again with `finlab export LAYOUT -o DIR`"
        )
