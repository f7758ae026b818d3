"""Logs of ArduPilot from arrays: DataFlash as its format is described by its own FMT messages."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

KINDS = {
    "Q": "<u8",
    "f": "<f4",
    "H": "<u2",
    "N": "S16",
    "Z": "S64",
    "B": "u1",
    "e": "<i4",
    "c": "<i2",
}
"""Letter of a column's type -> numpy's."""


def write_dataflash(
    path: Path,
    messages: Mapping[str, tuple[str, Mapping[str, np.ndarray]]],
    parameters: Mapping[str, float],
) -> Path:
    """Writes messages by name, each with the letters of its columns and the columns, TimeUS first,
    in order of time, after all parameters."""
    stamps = np.zeros(len(parameters))
    names = np.array([*parameters], "S16")
    values = np.array([*parameters.values()])
    every = {"PARM": ("QNf", {"TimeUS": stamps, "Name": names, "Value": values}), **messages}
    content = _packed(128, ["BBnNZ", "Type,Length,Name,Format,Columns"], b"FMT", 89)
    rows: list[tuple[float, bytes]] = []
    for number, (name, (letters, columns)) in enumerate(every.items(), 1):
        kind = np.dtype(
            [("head", "S3"), *zip(columns, (KINDS[letter] for letter in letters), strict=True)]
        )
        content += _packed(number, [letters, ",".join(columns)], name.encode(), kind.itemsize)
        table = np.zeros(len(columns["TimeUS"]), kind)
        table["head"] = bytes([0xA3, 0x95, number])
        for key, column in columns.items():
            table[key] = column
        size = kind.itemsize
        packed = table.tobytes()
        parts = [packed[k : k + size] for k in range(0, len(packed), size)]
        rows += zip(columns["TimeUS"], parts, strict=True)
    rows.sort(key=lambda row: row[0])
    path.write_bytes(content + b"".join(part for _, part in rows))
    return path


def _packed(number: int, words: list[str], name: bytes, size: int) -> bytes:
    """One FMT message."""
    letters, columns = (word.encode() for word in words)
    head = bytes([0xA3, 0x95, 128, number, size])
    return head + name.ljust(4, b"\0") + letters.ljust(16, b"\0") + columns.ljust(64, b"\0")
