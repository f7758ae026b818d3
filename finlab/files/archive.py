"""Zip archives and NPZ files, unpacked in memory: what is declared is checked, what is read is counted."""

import io
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from numpy.lib import format as npy

from finlab.arrays import AnyArray
from finlab.errors import DataError, FinlabError
from finlab.files.guarded import Name, read_file
from finlab.files.plain_values import parse_json

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

    `largest` says the largest size [bytes] of the file of a name, None for one that is passed over, and may
    raise; `most` is that of all of them together. Raises FinlabError of the kind `error`, whose sentence
    calls the archive `source`: it is damaged, holds a name twice, or a file is too large."""
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
            entry.create_system, entry.external_attr = 3, 0o100644 << 16
            archive.writestr(entry, content, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def read_arrays(path: Name, names: Iterable[str] | None, most: int, what: str) -> dict[str, AnyArray]:
    """Returns arrays of an NPZ file by name, those of some names or, for None, all.

    `most` is the largest size of the file, and of all arrays that are wanted together [bytes]. Raises
    DataError: the file cannot be read, is damaged or too large, or lacks an array; the sentence says `what`
    is expected, such as "a swim log"."""

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
    """Returns the values in an array that holds JSON as text, or as bytes; a `DataError` where it is none."""
    try:
        text = array.tobytes().decode() if array.dtype.kind == "u" else str(array)
    except ValueError:
        raise DataError(f"{source} is no text") from None
    return parse_json(text, source)


def check_shapes(arrays: Mapping[str, AnyArray], shapes: Mapping[str, tuple[int, ...]], source: str) -> None:
    """Raises a `DataError` unless arrays of these names hold numbers, and have these shapes."""
    for name, shape in shapes.items():
        if arrays[name].shape != shape or arrays[name].dtype.kind not in "biuf":
            raise DataError(f"{source}: {name}: expected numbers of shape {shape}, got {arrays[name].shape}")


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
