"""The files of a deployment bundle, from a folder or a zip archive that may come from a stranger.

Nothing is unpacked, no file is read beyond its largest size, and no content is believed before its
checksum fits. What the files mean is known to the rooms that read them: robot and force tables to
`finlab.layout` and `finlab.physics`, settings to `finlab.allocation`, which makes allocators of
bundles. So this module stands below `finlab.deploy`, which writes bundles.
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
"""Value of the key `format` in `bundle.json`."""
VERSION = 9
"""Version of the bundle; a reader knows exactly one."""
ROBOT_FILE = "robot.json"
"""The robot: its layout, what does not work, and a self-test."""
MANIFEST_FILE = "bundle.json"
"""Format and version of the bundle, the method and its settings."""
CHECKPOINT_FOLDER = "checkpoint/"
"""Folder of a checkpoint that does not come with finlab."""
TABLE_FOLDER = "tables/"
"""Folder of the fins' force tables, and of a learned interaction, each named by the SHA-256 of its
content."""
README_FILE = "README.md"
"""How to use the bundle, for people."""
CHECKSUM_FILE = "SHA256SUMS"
"""SHA-256 of every other file."""
MAX_FILE_BYTES = {
    ROBOT_FILE: 1_000_000,
    MANIFEST_FILE: 100_000,
    README_FILE: 100_000,
    CHECKSUM_FILE: 10_000,
    CHECKPOINT_FOLDER + "config.json": 1_000_000,
    CHECKPOINT_FOLDER + "model.safetensors": 50_000_000,
}
"""All files that a bundle may hold beside force tables -> the largest size of each [bytes]."""
MAX_TABLE_BYTES = 20_000_000
"""Largest size of a force table in a bundle [bytes]."""
MAX_BUNDLE_BYTES = 100_000_000
"""Largest size of all files together [bytes]."""
MAX_ARCHIVE_BYTES = MAX_BUNDLE_BYTES + 100_000
"""Largest size of a zip archive, which adds the names of its files to what it holds [bytes]."""
REQUIRED = (ROBOT_FILE, MANIFEST_FILE, CHECKSUM_FILE)
"""Files without which there is no bundle."""

Files = Mapping[str, bytes]
"""Name of a file in the bundle -> its content."""

_TABLE_NAME = re.compile(TABLE_FOLDER + r"[0-9a-f]{64}\.(csv|safetensors)")
_DIGEST_WIDTH = 64
"""Hexadecimal digits of a SHA-256."""


def max_file_bytes(name: str) -> int:
    """Returns the largest size [bytes] of the file of this name; -1 where no bundle holds one."""
    return MAX_TABLE_BYTES if _TABLE_NAME.fullmatch(name) else MAX_FILE_BYTES.get(name, -1)


def table_name(content: bytes, suffix: str = ".csv") -> str:
    """Returns the name of a force table, or of a network, in a bundle.

    Args:
        content: of the file.
        suffix: end of its name.
    """
    return f"{TABLE_FOLDER}{hashlib.sha256(content).hexdigest()}{suffix}"


def is_bundle(path: str | os.PathLike[str]) -> bool:
    """Returns whether a path looks like a bundle, of whatever version: a zip archive, or a folder
    with its files."""
    bundle = Path(path)
    if bundle.suffix == ".zip" and is_regular(bundle):
        return True
    return is_regular(bundle / MANIFEST_FILE)


def archive_of_table(path: str | os.PathLike[str]) -> str | None:
    """Returns the zip archive of a bundle that a force table lies in, as in
    `robot.zip/tables/x.csv`; None for a file that lies in none."""
    if ".zip" not in os.fspath(path):  # asked for each table at each answer
        return None
    folder = os.path.dirname(path)
    archive = os.path.dirname(folder)
    if not archive.endswith(".zip") or os.path.basename(folder) + "/" != TABLE_FOLDER:
        return None
    return archive if os.path.isfile(archive) else None


def file_stamp(path: str | None) -> tuple[int, int] | None:
    """Returns modification time [ns] and size [bytes] of a file, by which a cache of its content is
    known to be stale; None for no file, zeros for one that is missing."""
    if path is None:
        return None
    try:
        status = os.stat(archive_of_table(path) or path)
    except (OSError, ValueError):
        return 0, 0
    return status.st_mtime_ns, status.st_size


def read_named_file(
    path: str | os.PathLike[str],
    max_bytes: int,
    expected: str,
    error: type[FinlabError] = DataError,
) -> bytes:
    """Returns the content of a file that a layout names, which may lie in the zip archive of a
    bundle.

    Args:
        path: the file, such as `force.csv` or `robot.zip/tables/x.csv`.
        max_bytes: its largest size.
        expected: what it should be, for messages.
        error: class of the errors.

    Raises:
        FinlabError: of class `error`; there is no such file, or it is too large.
    """
    archive = archive_of_table(path)
    if archive is None:
        return read_file(path, max_bytes, expected, error)
    content = read_bundle_files(archive).get(TABLE_FOLDER + os.path.basename(path))
    if content is None:
        raise error(f"{path}: no such file, expected {expected}")
    return content


def read_bundle_files(path: str | os.PathLike[str]) -> dict[str, bytes]:
    """Returns the files of a bundle by name, with checksums that fit.

    Args:
        path: the bundle's folder, or its zip archive.

    Raises:
        DataError: it cannot be read, is of another version, was changed, or holds what no bundle
            holds.
    """
    source = str(path)
    if not os.path.isdir(path):
        content = read_file(source, MAX_ARCHIVE_BYTES, "a bundle's folder or its zip archive")
        return parse_bundle_archive(content, source)
    folder = Path(path)
    names = list(MAX_FILE_BYTES)
    for file in sorted((folder / TABLE_FOLDER).glob("*.*")):
        names.append(f"{TABLE_FOLDER}{file.name}")
    files = {}
    for name in names:
        max_bytes = max_file_bytes(name)
        if max_bytes > 0 and (folder / name).exists():
            files[name] = read_file(folder / name, max_bytes, "a bundle's file")
    check_bundle_files(files, source)
    return files


def parse_bundle_archive(content: bytes, source: str) -> dict[str, bytes]:
    """Returns the files of a bundle by name, from the content of its zip archive.

    Args:
        content: of the archive.
        source: what errors call it, such as its path.

    Raises:
        DataError: as for `read_bundle_files`.
    """
    files = unpacked(content, source, partial(_max_bytes_in_archive, source), MAX_BUNDLE_BYTES)
    check_bundle_files(files, source)
    return files


def check_bundle_files(files: Files, source: str) -> None:
    """Refuses files that are no bundle: by version, names and checksums.

    Args:
        files: all files, by name.
        source: what errors call the bundle, such as its path.

    Raises:
        DataError: the version is another one, a file is missing, or one was changed.
    """
    _check_version(files.get(MANIFEST_FILE), source)
    for name in REQUIRED:
        if name not in files:
            raise DataError(
                f"{source}: {name} is missing; a bundle is made by `finlab export LAYOUT -o DIR`"
            )
    summed = {name: content for name, content in files.items() if name != CHECKSUM_FILE}
    actual = checksums(summed)
    if actual == files[CHECKSUM_FILE]:
        return
    listed = files[CHECKSUM_FILE].decode("utf-8", "replace").splitlines()
    changed = CHECKSUM_FILE  # where every file is listed as it is, a line is too many
    for line in actual.decode().splitlines():
        if line not in listed:
            changed = line[_DIGEST_WIDTH + 2 :]
            break
    raise DataError(
        f"{source}: {changed} does not fit {CHECKSUM_FILE}; it was changed; copy the bundle again"
    )


def checksums(files: Files) -> bytes:
    """Returns the content of `SHA256SUMS` for files by name; `sha256sum -c` reads it as well."""
    lines = []
    for name in sorted(files):
        digest = hashlib.sha256(files[name]).hexdigest()
        lines.append(f"{digest}  {name}\n")
    return "".join(lines).encode()


def _max_bytes_in_archive(source: str, name: str) -> int:
    """Largest size [bytes] of a file in the archive `source`. Raises DataError: no bundle holds
    one of this name."""
    max_bytes = max_file_bytes(name)
    if max_bytes < 0:
        is_layout = name.endswith((".yaml", ".yml"))
        hint = "; unpack it, and name the layout file in it" if is_layout else ""
        raise DataError(f"{source}: holds {name!r:.60}, which is no part of a bundle{hint}")
    return max_bytes


def _check_version(manifest: bytes | None, source: str) -> None:
    """Refuses bundles of other versions. Raises DataError. A manifest that cannot be read passes:
    its own reader says what is wrong."""
    text = "null" if manifest is None else manifest.decode("utf-8", "replace")
    try:
        document = parse_json(text, source)
    except DataError:
        return
    version = document.get("version") if isinstance(document, dict) else VERSION
    if type(version) is not int or version != VERSION:
        raise DataError(
            f"{source}: is a bundle of version {version!r:.40}, this finlab reads version "
            f"{VERSION}; export it again with `finlab export LAYOUT -o DIR`"
        )
