"""Files opened in one way: a regular file, within a size, and one sentence where it is not; zip
archives and NPZ files, unpacked in memory: what is declared is checked, what is read is counted.
"""

import io
import os
import stat
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Iterable, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

from numpy.lib import format as npy

from finlab.arrays import AnyArray
from finlab.errors import DataError, FinlabError
from finlab.files import parse_json

Name = str | os.PathLike[str]
PART = 1 << 20
"""Bytes that are read at once."""


def read_file(
    path: Name,
    most: int,
    what: str,
    error: type[FinlabError] = DataError,
    *,
    head: int | None = None,
) -> bytes:
    """Returns the content of a regular file of up to `most` bytes, or of these its first `head`.

    A pipe, a socket and a device are refused without waiting for them. Raises FinlabError of the
    kind `error`: the file is missing, not regular, too large or not readable; the sentence says
    `what` is expected, such as "a layout file"."""
    try:
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            about = os.fstat(file.fileno())
            if stat.S_ISDIR(about.st_mode):
                raise error.at(str(path), f"is a folder, expected {what}")
            if not stat.S_ISREG(about.st_mode):
                raise error.at(str(path), f"is not a regular file, expected {what}")
            content = (
                _read(file, most if head is None else head - 1) if about.st_size <= most else None
            )
    except FileNotFoundError:
        raise error.at(str(path), f"no such file, expected {what}") from None
    except IsADirectoryError:
        raise error.at(str(path), f"is a folder, expected {what}") from None
    except (OSError, ValueError) as problem:  # ValueError: a NUL byte in the name
        reason = getattr(problem, "strerror", None) or problem
        raise error.at(str(path)[:300], f"cannot be read: {reason}") from None
    if content is None or len(content) > most:
        raise error.at(str(path), f"is larger than {most:,} bytes, too large for {what}")
    return content


def _read(file: BinaryIO, most: int) -> bytes:
    """The content, or its first `most` + 1 bytes: a file may grow while it is read, and some report
    no size at all. A single `read` of that many would take the memory of the largest file for a
    small one."""
    content = BytesIO()
    while part := file.read(min(PART, most + 1 - content.tell())):
        content.write(part)
    return content.getvalue()


def read_text(path: Name, most: int, what: str, error: type[FinlabError] = DataError) -> str:
    """Returns the text of a regular file; arguments and errors as in `read_file`, and it must be
    text."""
    return decoded(read_file(path, most, what, error), str(path), what, error)


def decoded(content: bytes, source: str, what: str, error: type[FinlabError] = DataError) -> str:
    """Returns UTF-8 text, without a byte order mark. Raises FinlabError of the kind `error`: the
    bytes are no UTF-8 text; the message calls them `source`."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise error.at(source, f"is not UTF-8 text, expected {what}") from None
    if "\0" in text:
        raise error.at(source, f"is a binary file, expected {what}")
    return text


def is_regular(path: Name) -> bool:
    """Whether there is a regular file; False also for names that cannot be a path."""
    try:
        return Path(path).is_file()
    except (OSError, ValueError):
        return False


_DAMAGED = (
    *(zipfile.BadZipFile, zlib.error, struct.error, tokenize.TokenError, ArithmeticError, EOFError),
    *(LookupError, MemoryError, OSError, RuntimeError, TypeError, ValueError),
)
"""What reading a damaged or locked archive ends with."""
_PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ENTRY = b"PK\x01\x02"
"""What an entry of an archive's list of files begins with."""
MOST_FILES = 500
"""Most files in an archive."""


def unpacked(
    content: bytes,
    source: str,
    largest: Callable[[str], int | None],
    most: int,
    error: type[FinlabError] = DataError,
) -> dict[str, bytes]:
    """Returns files in a zip archive by name.

    `largest` says the largest size [bytes] of the file of a name, None for one that is passed over,
    and may raise; `most` is that of all of them together. Raises FinlabError of the kind `error`,
    whose sentence calls the archive `source`: it is damaged, holds a name twice, or a file is too
    large."""
    files: dict[str, bytes] = {}
    if content.count(_ENTRY) > MOST_FILES:  # before a list of them is made
        raise error.at(source, f"holds more than {MOST_FILES} files; pack it again")
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = {entry.filename: entry for entry in archive.infolist() if not entry.is_dir()}
            if len(set(archive.namelist())) < len(archive.namelist()):
                raise error.at(source, "holds a file twice; pack it again")
            for name, entry in entries.items():
                if (own := largest(name)) is None:
                    continue
                room = min(own, most)
                if entry.compress_type not in _PACKED:
                    raise ValueError(f"{name!r:.60} is compressed in another way than deflate")
                if entry.file_size <= room:
                    with archive.open(entry) as stream:
                        files[name] = stream.read(room + 1)
                if entry.file_size > room or len(files[name]) > room:
                    raise error.at(source, f"{name[-60:]} in it is larger than {room:,} bytes")
                most -= len(files[name])
    except _DAMAGED as problem:
        reason = str(problem).splitlines()[0][:80] if str(problem) else type(problem).__name__
        raise error.at(source, f"cannot be read as a zip archive ({reason})") from None
    return files


def packed(files: Mapping[str, bytes]) -> bytes:
    """Returns files by name as one zip archive; the same bytes each time."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.create_system = 3
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, content, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def read_arrays(
    path: Name, names: Iterable[str] | None, most: int, what: str
) -> dict[str, AnyArray]:
    """Returns arrays of an NPZ file by name, those of some names or, for None, all.

    `most` is the largest size of the file, and of all arrays that are wanted together [bytes].
    Raises DataError: the file cannot be read, is damaged or too large, or lacks an array; the
    sentence says `what` is expected, such as "a swim log"."""

    def largest(member: str) -> int | None:
        name = member.removesuffix(".npy")
        return most if name != member and (names is None or name in wanted) else None

    wanted = set(names or ())
    parts = unpacked(read_file(path, most, what), f"{path}: expected {what}", largest, most)
    named = {name.removesuffix(".npy"): content for name, content in parts.items()}
    if missing := sorted(wanted - set(named)):
        raise DataError(f"{path}: expected {what}, but it holds no {missing[0]}")
    return {name: _array(content, name, str(path)) for name, content in named.items()}


def json_of(array: AnyArray, source: str) -> Any:
    """Returns the values in an array that holds JSON as text, or as bytes; a `DataError` where it
    is none."""
    try:
        text = array.tobytes().decode() if array.dtype.kind == "u" else str(array)
    except ValueError:
        raise DataError(f"{source} is no text") from None
    return parse_json(text, source)


def check_shapes(
    arrays: Mapping[str, AnyArray], shapes: Mapping[str, tuple[int, ...]], source: str
) -> None:
    """Raises a `DataError` unless arrays of these names hold numbers, and have these shapes."""
    for name, shape in shapes.items():
        if arrays[name].shape != shape or arrays[name].dtype.kind not in "biuf":
            raise DataError(
                f"{source}: {name}: expected numbers of shape {shape}, got {arrays[name].shape}"
            )


def _array(content: bytes, name: str, source: str) -> AnyArray:
    """The array of an NPY file of numbers, truth values or text."""
    try:
        array: AnyArray = npy.read_array(io.BytesIO(content), allow_pickle=False)
        if array.dtype.kind not in "biufcU":
            raise ValueError
        return array
    except _DAMAGED:
        plain = f"{name!r:.60} in it is damaged, or no array of numbers or text"
        raise DataError(f"{source}: {plain}") from None
