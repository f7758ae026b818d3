"""Protocol-buffer wire format, as much of it as ONNX files need.

A message is a run of fields; each is a key (number and wire type) and a value. Four wire types exist: whole
numbers of 7 bits per byte, 8 bytes, length and bytes, 4 bytes.
https://protobuf.dev/programming-guides/encoding
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from finlab.errors import DataError

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5
"""Wire types."""
_MASK64 = (1 << 64) - 1

Value = int | memoryview
"""A field's value: a whole number, or the bytes behind it."""


def varint(value: int) -> bytes:
    """A whole number of at most 64 bits; negative ones by two's complement, as protocol buffers do."""
    value &= _MASK64
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def integer(number: int, value: int) -> bytes:
    """A field that holds a whole number."""
    return varint(number << 3 | VARINT) + varint(value)


def single(number: int, value: float) -> bytes:
    """A field that holds a float of four bytes."""
    return varint(number << 3 | FIXED32) + struct.pack("<f", value)


def block(number: int, value: bytes | str) -> bytes:
    """A field that holds text, bytes or a message."""
    raw = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | BYTES) + varint(len(raw)) + raw


def fields(message: memoryview) -> Iterator[tuple[int, Value]]:
    """The fields of a message, in order.

    Raises:
        DataError: the bytes are no message.
    """
    position, end = 0, len(message)
    while position < end:
        key, position = _varint(message, position)
        number, kind = key >> 3, key & 7
        if kind == VARINT:
            value, position = _varint(message, position)
            yield number, value
            continue
        if kind == BYTES:
            size, position = _varint(message, position)
        elif kind in (FIXED64, FIXED32):
            size = 8 if kind == FIXED64 else 4
        else:
            raise DataError(f"is no ONNX file: field {number} is of unknown wire type {kind}")
        if number == 0 or size > end - position:
            raise DataError(f"is no ONNX file, or was cut off: field {number} wants {size} bytes")
        yield number, message[position : position + size]
        position += size


def signed(value: int) -> int:
    """A whole number read as one that may be negative."""
    return value - (1 << 64) if value >> 63 else value


def _varint(message: memoryview, position: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        if position >= len(message):
            raise DataError("is no ONNX file, or was cut off: it ends inside a number")
        byte = message[position]
        position += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value & _MASK64, position
    raise DataError("is no ONNX file: it holds a number of more than 64 bits")
