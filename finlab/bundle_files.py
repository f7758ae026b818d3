"""The files of a deployment bundle, from a folder or a zip archive that may come from a stranger.

Nothing is unpacked, nothing is read beyond its largest size, and no content is believed before its
checksum fits. What the files mean is known to the rooms that read them: robot and force tables to
`finlab.layout` and `finlab.physics`, settings to `finlab.allocation`, which makes allocators of
bundles: so this stands below `finlab.deploy`.
"""

import hashlib
import os
import re
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from finlab.errors import DataError, FinlabError
from finlab.files import parse_json
from finlab.files.guarded import is_regular, read_file, unpacked

FORMAT = "finlab-bundle"
VERSION = 9
"""Version of the bundle; a reader knows exactly one."""
ROBOT = "robot.json"
ABOUT = "bundle.json"
NETWORKS = "checkpoint/"
"""Folder of a checkpoint that does not come with finlab."""
TABLES = "tables/"
"""Folder of the fins' force tables, and of a learned interaction, each named by the SHA-256 of its
content."""
README = "README.md"
CHECKSUMS = "SHA256SUMS"
LARGEST = {
    ROBOT: 1_000_000,
    ABOUT: 100_000,
    README: 100_000,
    CHECKSUMS: 10_000,
    NETWORKS + "config.json": 1_000_000,
    NETWORKS + "model.safetensors": 50_000_000,
}
"""All that a bundle may hold beside force tables, and the largest size of each file [bytes]."""
LARGEST_TABLE = 20_000_000
"""Largest size of a force table in a bundle [bytes]."""
LARGEST_BUNDLE = 100_000_000
"""Largest size of all files together [bytes]."""
REQUIRED = (ROBOT, ABOUT, CHECKSUMS)

Files = Mapping[str, bytes]
"""Contents by name."""

_TABLE = re.compile(TABLES + r"[0-9a-f]{64}\.(csv|safetensors)")


def largest(name: str) -> int:
    """Largest size [bytes] of the file of this name; -1 for names that no bundle holds."""
    return LARGEST_TABLE if _TABLE.fullmatch(name) else LARGEST.get(name, -1)


def table_name(content: bytes, suffix: str = ".csv") -> str:
    """The name of a force table in a bundle."""
    return f"{TABLES}{hashlib.sha256(content).hexdigest()}{suffix}"


def is_bundle(path: str | os.PathLike[str]) -> bool:
    """Whether a path looks like a bundle, of whatever version: a zip archive, or a folder with its
    files."""
    place = Path(path)
    return (place.suffix == ".zip" and is_regular(place)) or is_regular(place / ABOUT)


def archive_around(path: str | os.PathLike[str]) -> str | None:
    """The zip archive of a bundle that a force table lies in, as in `robot.zip/tables/x.csv`; None
    for a file that lies in none."""
    if ".zip" not in os.fspath(path):  # asked for each table at each answer
        return None
    tables = os.path.dirname(path)
    archive = os.path.dirname(tables)
    within = archive.endswith(".zip") and os.path.basename(tables) + "/" == TABLES
    return archive if within and os.path.isfile(archive) else None


def file_stamp(path: str | None) -> tuple[int, int] | None:
    """Returns time and size of a file, by which one that is kept is known to be old; None for no
    file."""
    if path is None:
        return None
    try:
        result = os.stat(archive_around(path) or path)
    except (OSError, ValueError):
        return 0, 0
    return result.st_mtime_ns, result.st_size


def named_content(
    path: str | os.PathLike[str], most: int, what: str, error: type[FinlabError] = DataError
) -> bytes:
    """The content of a file that a layout names, which may lie in the zip archive of a bundle.
    Raises FinlabError of the kind `error`: there is no such file, or it is too large; it says
    `what` is expected."""
    archive = archive_around(path)
    if archive is None:
        return read_file(path, most, what, error)
    content = read_bundle_files(archive).get(TABLES + os.path.basename(path))
    if content is None:
        raise error(f"{path}: no such file, expected {what}")
    return content


def read_bundle_files(path: str | os.PathLike[str]) -> dict[str, bytes]:
    """The files of a bundle by name, with checksums that fit. Raises DataError: it cannot be read,
    is of another version, was changed, or holds what no bundle holds."""
    source = str(path)
    if not os.path.isdir(path):
        content = read_file(
            source, LARGEST_BUNDLE + 100_000, "a bundle's folder or its zip archive"
        )
        return bundle_files_of(content, source)
    folder = Path(path)
    names = [*LARGEST, *(f"{TABLES}{file.name}" for file in sorted((folder / TABLES).glob("*.*")))]
    there = [name for name in names if largest(name) > 0 and (folder / name).exists()]
    files = {name: read_file(folder / name, largest(name), "a bundle's file") for name in there}
    check_bundle_files(files, source)
    return files


def bundle_files_of(content: bytes, source: str) -> dict[str, bytes]:
    """The same of a zip archive, by its content; `source` is what errors call it."""
    files = unpacked(content, source, partial(_largest, source), LARGEST_BUNDLE)
    check_bundle_files(files, source)
    return files


def check_bundle_files(files: Files, source: str) -> None:
    """Raise a `DataError` unless version, files and checksums are right."""
    _check_version(files.get(ABOUT), source)
    for name in REQUIRED:
        if name not in files:
            raise DataError(
                f"{source}: {name} is missing; a bundle is made by `finlab export LAYOUT -o DIR`"
            )
    rest = {name: content for name, content in files.items() if name != CHECKSUMS}
    if checksums(rest) == files[CHECKSUMS]:
        return
    listed = files[CHECKSUMS].decode("utf-8", "replace").splitlines()
    wrong = next(
        (line[66:] for line in checksums(rest).decode().splitlines() if line not in listed),
        CHECKSUMS,
    )
    raise DataError(
        f"{source}: {wrong} does not fit {CHECKSUMS}; it was changed; copy the bundle again"
    )


def checksums(files: Files) -> bytes:
    """The lines of `SHA256SUMS`, which `sha256sum -c` reads as well."""
    lines = (f"{hashlib.sha256(files[name]).hexdigest()}  {name}\n" for name in sorted(files))
    return "".join(lines).encode()


def _largest(source: str, name: str) -> int:
    """Largest size [bytes] of a file in an archive; a `DataError` for one that no bundle holds."""
    if (most := largest(name)) < 0:
        hint = "; unpack it, and name the layout file in it" * name.endswith((".yaml", ".yml"))
        raise DataError(f"{source}: holds {name!r:.60}, which is no part of a bundle{hint}")
    return most


def _check_version(about: bytes | None, source: str) -> None:
    """Refuse bundles of other versions; what cannot be understood is left to its reader."""
    try:
        document = parse_json((about or b"null").decode("utf-8", "replace"), source)
    except DataError:
        return
    version = document.get("version") if isinstance(document, dict) else VERSION
    if type(version) is not int or version != VERSION:
        raise DataError(
            f"{source}: is a bundle of version {version!r:.40}, this finlab reads version "
            f"{VERSION}; export it again with `finlab export LAYOUT -o DIR`"
        )
