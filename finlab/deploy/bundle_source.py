"""The contents of a bundle's files, from a folder or an archive that may come from a stranger.

Nothing is unpacked, no link is followed, and nothing is read beyond its largest size.
"""

from __future__ import annotations

import os
import stat
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

from finlab.deploy.bundle import CHECKSUMS, FILES, GRAPH, README
from finlab.deploy.onnx.reading import MAX_BYTES
from finlab.errors import DataError

LARGEST = {GRAPH: 1_000_000, README: 100_000, CHECKSUMS: 10_000}
"""Largest size of the files that are no ONNX [bytes]."""


def files_at(path: str | os.PathLike[str]) -> dict[str, bytes]:
    """The files of a bundle by name, those that are there.

    Raises:
        DataError: it is neither a folder nor a zip archive, or holds what no bundle holds.
    """
    source = str(path)
    return _folder(Path(path), source) if os.path.isdir(source) else _archive(source)


def _folder(path: Path, source: str) -> dict[str, bytes]:
    files = {}
    try:
        for name in FILES:
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
            for entry in entries[: len(FILES) + 1]:
                # Nothing is unpacked, so a name can do no harm; still, a bundle holds these files only.
                if entry.filename not in FILES or entry.filename in files:
                    raise DataError(f"{source}: holds {entry.filename!r:.60}, which is no part of a bundle")
                with archive.open(entry) as stream:
                    files[entry.filename] = _bounded(stream.read, entry.filename, source)
    except OSError as error:
        raise DataError(f"{source}: cannot be read: {error.strerror or error}") from None
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, ValueError, zlib.error) as error:
        reason = str(error).splitlines()[0][:80] if str(error) else type(error).__name__
        raise DataError(f"{source}: is neither a bundle's folder nor its zip archive ({reason})") from None
    return files


def _bounded(read: Callable[[int], bytes], name: str, source: str) -> bytes:
    largest = LARGEST.get(name, MAX_BYTES)
    content = read(largest + 1)
    if len(content) > largest:
        raise DataError(f"{source}: {name} is larger than {largest:,} bytes")
    return content
