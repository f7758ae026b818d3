"""Zip archives and NPZ files, unpacked in memory: what is declared is checked, what is read is counted."""

import io
import math
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.lib import format as npy

from finlab.arrays import AnyArray
from finlab.errors import DataError, FinlabError
from finlab.files.guarded import Name, read_file
from finlab.files.plain_values import parse_json

_DAMAGED = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    ArithmeticError,
    EOFError,
    LookupError,
    OSError,
    RuntimeError,
    TypeError,
    ValueError,
)
"""What reading a damaged or locked archive ends with."""
_PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def member_names(content: bytes, source: str, error: type[FinlabError] = DataError) -> list[str]:
    """Returns the names of the files in a zip archive, folders left out.

    Raises:
        FinlabError: of the kind `error`; it is no zip archive, or holds a name twice.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            names = [entry.filename for entry in archive.infolist() if not entry.is_dir()]
    except _DAMAGED as problem:
        raise error.at(source, f"cannot be read as a zip archive ({_reason(problem)})") from None
    if len(set(names)) < len(names):
        raise error.at(source, "holds a file twice; pack it again")
    return names


def unpacked(
    content: bytes, source: str, largest: Mapping[str, int], most: int, error: type[FinlabError] = DataError
) -> dict[str, bytes]:
    """Returns members of a zip archive by name.

    Args:
        content: the archive.
        source: what to call it in the sentence.
        largest: the members that are wanted, each with its largest size [bytes]; one that is not there is
            left out.
        most: largest size of all of them together [bytes].
        error: the kind of error.

    Raises:
        FinlabError: of the kind `error`; the archive is damaged, or a member is too large.
    """
    found: dict[str, bytes] = {}
    too_large = ""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            for entry in archive.infolist():
                if entry.filename not in largest or entry.filename in found:
                    continue
                if entry.compress_type not in _PACKED:
                    raise ValueError(f"{entry.filename!r:.60} is compressed in another way than deflate")
                room = min(largest[entry.filename], most)
                if entry.file_size <= room:
                    with archive.open(entry) as stream:
                        found[entry.filename] = stream.read(room + 1)
                if entry.file_size > room or len(found[entry.filename]) > room:
                    too_large = f"{entry.filename[-60:]} in it is larger than {room:,} bytes"
                    break
                most -= len(found[entry.filename])
    except _DAMAGED as problem:
        raise error.at(source, f"is damaged, and cannot be unpacked ({_reason(problem)})") from None
    if too_large:
        raise error.at(source, too_large)
    return found


def read_arrays(path: Name, names: Iterable[str] | None, most: int, what: str) -> dict[str, AnyArray]:
    """Returns arrays of an NPZ file by name.

    Args:
        path: the file.
        names: the arrays that are wanted; None for all.
        most: largest size of the file, and of all arrays that are wanted together [bytes].
        what: what is expected, for the sentence, such as "a swim log".

    Raises:
        DataError: the file cannot be read, is damaged or too large, or lacks an array.
    """
    content, source = read_file(path, most, what), str(path)
    there = member_names(content, f"{path}: expected {what}")
    members = [name for name in there if name.endswith(".npy")]
    if names is not None:
        members = [f"{name}.npy" for name in names]
    if missing := sorted(set(members) - set(there)):
        raise DataError(f"{path}: expected {what}, but it holds no {missing[0].removesuffix('.npy')}")
    parts = unpacked(content, source, dict.fromkeys(members, most), most)
    return {name.removesuffix(".npy"): _array(part, name, source) for name, part in parts.items()}


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
        stream = io.BytesIO(content)
        header = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}[
            npy.read_magic(stream)
        ]
        shape, fortran, dtype = header(stream)
        if dtype.kind not in "biufcU" or math.prod(shape) * dtype.itemsize != len(content) - stream.tell():
            raise ValueError
        data = np.frombuffer(bytearray(content[stream.tell() :]), dtype)
        return data.reshape(shape, order="F" if fortran else "C")
    except (*_DAMAGED, tokenize.TokenError):
        plain = f"{name.removesuffix('.npy')!r:.60} in it is damaged, or no array of numbers or text"
        raise DataError(f"{source}: {plain}") from None


def _reason(problem: Exception) -> str:
    return str(problem).splitlines()[0][:80] if str(problem) else type(problem).__name__
