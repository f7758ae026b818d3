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
    """Writes topics, each by its times [s] and columns (N,) or (N, k), and parameters."""
    log = ULog(None)
    log._initial_parameters = dict(parameters)
    for number, (name, (time, columns)) in enumerate(topics.items()):
        fields, values = [("uint64_t", 0, "timestamp")], [("timestamp", np.round(time * 1e6).astype("<u8"))]
        for key, array in columns.items():
            kind = {"f": "float", "u": "uint16_t", "i": "int8_t"}[array.dtype.kind]
            array = array.astype({"float": "<f4", "uint16_t": "<u2", "int8_t": "<i1"}[kind])
            fields.append((kind, 0 if array.ndim == 1 else array.shape[1], key))
            parts = [(key, array)] if array.ndim == 1 else [(f"{key}[{i}]", c) for i, c in enumerate(array.T)]
            values += parts
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
