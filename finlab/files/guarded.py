"""Reads files of strangers: regular files up to a size, zip archives and NPZ files.

Archives are unpacked in memory: declared sizes are checked, and what is read is counted. Whatever
is wrong with a file becomes one sentence.
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
"""The path of a file."""
CHUNK_BYTES = 1 << 20
"""Bytes that are read at once."""


def read_file(
    path: Name,
    max_bytes: int,
    expected: str,
    error: type[FinlabError] = DataError,
    *,
    head: int | None = None,
) -> bytes:
    """Returns the content of a regular file.

    A pipe, a socket and a device are refused without waiting for them.

    Args:
        path: the file.
        max_bytes: its largest size [bytes].
        expected: what a sentence says was expected, such as "a layout file".
        error: the class of the error.
        head: how many bytes are read of its beginning; all when None.

    Raises:
        FinlabError: of the class `error`: the file is missing, not regular, too large or not
            readable.
    """
    try:
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            status = os.fstat(file.fileno())
            if stat.S_ISDIR(status.st_mode):
                raise error.in_file(str(path), f"is a folder, expected {expected}")
            if not stat.S_ISREG(status.st_mode):
                raise error.in_file(str(path), f"is not a regular file, expected {expected}")
            content = None
            if status.st_size <= max_bytes:
                content = _read(file, max_bytes if head is None else head - 1)
    except FileNotFoundError:
        raise error.in_file(str(path), f"no such file, expected {expected}") from None
    except IsADirectoryError:
        raise error.in_file(str(path), f"is a folder, expected {expected}") from None
    except (OSError, ValueError) as problem:  # ValueError: a NUL byte in the name
        reason = getattr(problem, "strerror", None) or problem
        raise error.in_file(str(path)[:300], f"cannot be read: {reason}") from None
    if content is None or len(content) > max_bytes:
        raise error.in_file(
            str(path), f"is larger than {max_bytes:,} bytes, too large for {expected}"
        )
    return content


def _read(file: BinaryIO, max_bytes: int) -> bytes:
    """The content, or its first `max_bytes` + 1 bytes: a file may grow while it is read, and some
    report no size at all. A single `read` of that many would take the memory of the largest file
    for a small one."""
    content = BytesIO()
    while chunk := file.read(min(CHUNK_BYTES, max_bytes + 1 - content.tell())):
        content.write(chunk)
    return content.getvalue()


def read_text(
    path: Name, max_bytes: int, expected: str, error: type[FinlabError] = DataError
) -> str:
    """Returns the text of a regular file.

    Args:
        path: the file.
        max_bytes: its largest size [bytes].
        expected: what a sentence says was expected.
        error: the class of the error.

    Raises:
        FinlabError: as `read_file`, or it is no text in UTF-8.
    """
    return decoded(read_file(path, max_bytes, expected, error), str(path), expected, error)


def decoded(
    content: bytes, source: str, expected: str, error: type[FinlabError] = DataError
) -> str:
    """Returns UTF-8 text, without a byte order mark.

    Args:
        content: the text's bytes.
        source: their name in the sentence of an error.
        expected: what a sentence says was expected.
        error: the class of the error.

    Raises:
        FinlabError: of the class `error`: the bytes are no UTF-8 text.
    """
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise error.in_file(source, f"is not UTF-8 text, expected {expected}") from None
    if "\0" in text:
        raise error.in_file(source, f"is a binary file, expected {expected}")
    return text


def is_regular(path: Name) -> bool:
    """Whether there is a regular file; False also for names that cannot be a path."""
    try:
        return Path(path).is_file()
    except (OSError, ValueError):
        return False


_DAMAGE_ERRORS = (
    *(zipfile.BadZipFile, zlib.error, struct.error, tokenize.TokenError, ArithmeticError, EOFError),
    *(LookupError, MemoryError, OSError, RuntimeError, TypeError, ValueError),
)
"""Exceptions that reading a damaged or locked archive ends with."""
_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Compressions that are unpacked."""
_ENTRY_SIGNATURE = b"PK\x01\x02"
"""The first bytes of an entry in an archive's list of files."""
MAX_FILES = 500
"""Most files in an archive."""


def unpacked(
    content: bytes,
    source: str,
    max_size_of: Callable[[str], int | None],
    max_bytes: int,
    error: type[FinlabError] = DataError,
) -> dict[str, bytes]:
    """Returns the files in a zip archive by name.

    Args:
        content: the archive.
        source: its name in the sentence of an error.
        max_size_of: returns the largest size of the file of a name [bytes], or None for one that is
            passed over; it may raise.
        max_bytes: the largest size of all files together [bytes].
        error: the class of the error.

    Raises:
        FinlabError: of the class `error`: the archive is damaged, holds a name twice, or a file is
            too large.
    """
    files: dict[str, bytes] = {}
    if content.count(_ENTRY_SIGNATURE) > MAX_FILES:  # before a list of them is made
        raise error.in_file(source, f"holds more than {MAX_FILES} files; pack it again")
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = {entry.filename: entry for entry in archive.infolist() if not entry.is_dir()}
            if len(set(archive.namelist())) < len(archive.namelist()):
                raise error.in_file(source, "holds a file twice; pack it again")
            for name, entry in entries.items():
                max_size = max_size_of(name)
                if max_size is None:
                    continue
                room = min(max_size, max_bytes)
                if entry.compress_type not in _COMPRESSIONS:
                    raise ValueError(f"{name!r:.60} is compressed in another way than deflate")
                if entry.file_size <= room:
                    with archive.open(entry) as stream:
                        files[name] = stream.read(room + 1)
                if entry.file_size > room or len(files[name]) > room:
                    raise error.in_file(source, f"{name[-60:]} in it is larger than {room:,} bytes")
                max_bytes -= len(files[name])
    except _DAMAGE_ERRORS as problem:
        reason = str(problem).splitlines()[0][:80] if str(problem) else type(problem).__name__
        raise error.in_file(source, f"cannot be read as a zip archive ({reason})") from None
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
    path: Name, names: Iterable[str] | None, max_bytes: int, expected: str
) -> dict[str, AnyArray]:
    """Returns arrays of an NPZ file by name.

    Args:
        path: the file.
        names: names of the arrays that are read, and must be there; all that are there when None.
        max_bytes: the largest size of the file, and of all these arrays together [bytes].
        expected: what a sentence says was expected, such as "a swim log".

    Raises:
        DataError: the file cannot be read, is damaged or too large, or lacks an array.
    """
    wanted_names = set(names or ())

    def max_size_of(member: str) -> int | None:
        name = member.removesuffix(".npy")
        is_array = name != member
        is_wanted = names is None or name in wanted_names
        return max_bytes if is_array and is_wanted else None

    contents = unpacked(
        read_file(path, max_bytes, expected), f"{path}: expected {expected}", max_size_of, max_bytes
    )
    by_name = {name.removesuffix(".npy"): content for name, content in contents.items()}
    if missing := sorted(wanted_names - set(by_name)):
        raise DataError(f"{path}: expected {expected}, but it holds no {missing[0]}")
    return {name: _array(content, name, str(path)) for name, content in by_name.items()}


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
    except _DAMAGE_ERRORS:
        plain = f"{name!r:.60} in it is damaged, or no array of numbers or text"
        raise DataError(f"{source}: {plain}") from None
