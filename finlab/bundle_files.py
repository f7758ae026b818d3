"""The files of a deployment bundle, from a folder or a zip archive that may come from a stranger.

Nothing is unpacked, no link is followed, nothing is read beyond its largest size, and no content is believed
before its checksum fits. What the files mean is known to the rooms that read them: the layout graph to
`finlab.layout`, the weights to `finlab.inference`, the settings to `finlab.allocation`.
"""

import hashlib
import os
import stat
import zipfile
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path

from finlab.errors import DataError

VERSION = 2
"""Version of the bundle; a reader knows exactly one."""
GRAPH, ABOUT = "layout.graph.json", "bundle.json"
CHECKPOINT = "checkpoint/"
"""Folder of the weights, itself a checkpoint."""
README, CHECKSUMS = "README.md", "SHA256SUMS"
LARGEST = {
    GRAPH: 1_000_000,
    ABOUT: 100_000,
    f"{CHECKPOINT}config.json": 1_000_000,
    f"{CHECKPOINT}model.safetensors": 50_000_000,
    f"{CHECKPOINT}fast/config.json": 1_000_000,
    f"{CHECKPOINT}fast/model.safetensors": 20_000_000,
    README: 100_000,
    CHECKSUMS: 10_000,
}
"""All that a bundle may hold, and the largest size of each file [bytes]."""
REQUIRED = (GRAPH, ABOUT, f"{CHECKPOINT}config.json", f"{CHECKPOINT}model.safetensors", CHECKSUMS)
VERSION_1 = "network.onnx"
"""A file that only bundles of version 1 hold."""

Files = Mapping[str, bytes]
"""Contents by name."""


def is_bundle(path: str | os.PathLike[str]) -> bool:
    """Whether a path looks like a bundle, of whatever version: a zip archive, or a folder with its files."""
    place = Path(path)
    try:
        if place.is_dir():
            return any((place / name).is_file() for name in (ABOUT, VERSION_1))
        return place.suffix == ".zip" and place.is_file()
    except (OSError, ValueError):  # a name that is too long, or holds a NUL byte
        return False


def read_bundle_files(path: str | os.PathLike[str]) -> dict[str, bytes]:
    """The files of a bundle by name, with checksums that fit.

    Raises:
        DataError: it cannot be read, is of another version, was changed, or holds what no bundle holds.
    """
    source = str(path)
    files = _folder(Path(path), source) if os.path.isdir(source) else _archive(source)
    check_bundle_files(files, source)
    return files


def check_bundle_files(files: Files, source: str) -> None:
    """Raise a `DataError` unless all files are there and their checksums fit."""
    for name in REQUIRED:
        if name not in files:
            raise DataError(f"{source}: {name} is missing; a bundle is made by `finlab export LAYOUT -o DIR`")
    rest = {name: content for name, content in files.items() if name != CHECKSUMS}
    if checksums(rest) == files[CHECKSUMS]:
        return
    listed = {line[66:]: line[:64] for line in files[CHECKSUMS].decode("utf-8", "replace").splitlines()}
    actual = {line[66:]: line[:64] for line in checksums(rest).decode().splitlines()}
    wrong = next((name for name in actual if listed.get(name) != actual[name]), CHECKSUMS)
    raise DataError(f"{source}: {wrong} does not fit {CHECKSUMS}; it was changed; copy the bundle again")


def checksums(files: Files) -> bytes:
    """The lines of `SHA256SUMS`, which `sha256sum -c` reads as well."""
    lines = (f"{hashlib.sha256(files[name]).hexdigest()}  {name}\n" for name in sorted(files))
    return "".join(lines).encode()


def checkpoint_part(files: Files) -> dict[str, bytes]:
    """The files of the checkpoint inside a bundle, by their names in it."""
    return {name.removeprefix(CHECKPOINT): c for name, c in files.items() if name.startswith(CHECKPOINT)}


def _folder(path: Path, source: str) -> dict[str, bytes]:
    files = {}
    try:
        _check_version([VERSION_1] if (path / VERSION_1).exists() else [], source)
        for name in LARGEST:
            file = path / name
            try:
                about = file.lstat()
            except FileNotFoundError:
                continue
            if not stat.S_ISREG(about.st_mode):
                raise DataError(f"{source}: {name} is no regular file")
            with file.open("rb") as stream:
                files[name] = _bounded(stream.read, name, source)
    except OSError as error:
        raise DataError(f"{source}: cannot be read: {error.strerror}") from None
    return files


def _archive(source: str) -> dict[str, bytes]:
    files: dict[str, bytes] = {}
    try:
        with zipfile.ZipFile(source) as archive:
            entries = archive.infolist()
            _check_version([entry.filename for entry in entries], source)
            for entry in entries[: len(LARGEST) + 1]:
                # Nothing is unpacked, so a name can do no harm; still, a bundle holds these files only.
                if entry.filename not in LARGEST or entry.filename in files:
                    raise DataError(f"{source}: holds {entry.filename!r:.60}, which is no part of a bundle")
                with archive.open(entry) as stream:
                    files[entry.filename] = _bounded(stream.read, entry.filename, source)
    except OSError as error:
        raise DataError(f"{source}: cannot be read: {error.strerror or error}") from None
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, ValueError, zlib.error) as error:
        reason = str(error).splitlines()[0][:80] if str(error) else type(error).__name__
        raise DataError(f"{source}: is neither a bundle's folder nor its zip archive ({reason})") from None
    return files


def _check_version(names: list[str], source: str) -> None:
    """Refuse bundles of version 1, whose weights were ONNX files."""
    if VERSION_1 in names:
        raise DataError(
            f"{source}: is a bundle of version 1, this finlab reads version {VERSION}; export it again with "
            "`finlab export LAYOUT -o DIR`, where LAYOUT may be the old bundle's own layout.graph.json"
        )


def _bounded(read: Callable[[int], bytes], name: str, source: str) -> bytes:
    content = read(LARGEST[name] + 1)
    if len(content) > LARGEST[name]:
        raise DataError(f"{source}: {name} is larger than {LARGEST[name]:,} bytes")
    return content
