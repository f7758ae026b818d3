"""Logs of PX4 from arrays, written by pyulog."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from pyulog import ULog


def write_ulog(
    path: Path,
    topics: Mapping[str, tuple[np.ndarray, Mapping[str, np.ndarray]]],
    parameters: Mapping[str, float | int],
) -> Path:
    """Writes topics, each by its times [s] and columns (N,) or (N, k), and parameters. A column
    `part.key` (N, k) is that of k messages inside the topic's."""
    log = ULog(None)
    log._initial_parameters = dict(parameters)
    for number, (name, (time, columns)) in enumerate(topics.items()):
        fields = [("uint64_t", 0, "timestamp")]
        values = [("timestamp", np.round(time * 1e6).astype("<u8"))]
        for key, array in columns.items():
            kind = {"f": "float", "u": "uint16_t", "i": "int8_t"}[array.dtype.kind]
            array = array.astype({"float": "<f4", "uint16_t": "<u2", "int8_t": "<i1"}[kind])
            part, _, inner = key.partition(".")
            if inner:
                about = f"{part}_report:{kind} {inner};"
                kind = f"{part}_report"
                log._message_formats[kind] = ULog.MessageFormat(about.encode(), None)
            fields.append((kind, 0 if array.ndim == 1 else array.shape[1], part))
            end = f".{inner}" if inner else ""
            rows = enumerate(array.T)
            values += (
                [(key, array)] if array.ndim == 1 else [(f"{part}[{i}]{end}", c) for i, c in rows]
            )
        text = ";".join(f"{kind}[{n}] {key}" if n else f"{kind} {key}" for kind, n, key in fields)
        log._message_formats[name] = ULog.MessageFormat(f"{name}:{text};".encode(), None)
        about = bytes([0, *number.to_bytes(2, "little")]) + name.encode()
        added = ULog._MessageAddLogged(about, None, log._message_formats)
        table = np.zeros(len(time), added.dtype)
        for key, array in values:
            table[key] = array
        added.buffer = bytearray(table.tobytes())
        log._data_list.append(ULog.Data(added))
    log.write_ulog(str(path))
    return path
