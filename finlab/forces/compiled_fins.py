"""Compiled fins that travel with a robot: known by the content of what they were compiled from, in one file.

A robot's computer that has them answers at once. The key of a compiled fin is a hash of its model's numbers
or the bytes of its force table, its limits and the objective; any other fin is compiled where it is needed.
"""

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import asdict
from functools import lru_cache
from typing import Any

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.forces.fin_envelope import (
    AMPLITUDE,
    AMPLITUDES,
    COST,
    DIRECTIONS,
    FREQUENCIES,
    FREQUENCY,
    LEVELS,
    SHAFT,
    TURNS,
    FinEnvelope,
    fin_envelope,
)
from finlab.layout import MAX_FINS, FinModelSpec, Layout, Limits
from finlab.physics.fin_model import file_stamp
from finlab.physics.objective import Objective
from finlab.physics.table_file import table_bytes

CompiledFins = Mapping[str, FinEnvelope]
"""Compiled fins by the hash of what they were compiled from."""

COLUMNS = SHAFT + 1
"""Columns of an envelope's table."""
LARGEST_NUMBER = 1e9
"""Largest magnitude in a compiled fin; far beyond it answers would be no numbers."""

_NAME = re.compile(r"([0-9a-f]{64})\.(arc|sizes|table)")


def content_key(model: FinModelSpec, limits: Limits, objective: Objective) -> str:
    """The hash of all that a compiled fin depends on, hexadecimal.

    Raises:
        DataError: the fin's force table cannot be read.
    """
    return _key(model, limits, objective, file_stamp(model))


@lru_cache(maxsize=512)
def _key(model: FinModelSpec, limits: Limits, objective: Objective, stamp: tuple[int, int] | None) -> str:
    values: dict[str, Any] = model.values()
    if model.type == "table":
        values = {"sha256": hashlib.sha256(table_bytes(values["path"])).hexdigest()}
    about = {
        "model": {"type": model.type, **values},
        "limits": [limits.lower, limits.upper],
        "objective": asdict(objective),
        "grid": [LEVELS, DIRECTIONS, AMPLITUDES, FREQUENCIES, TURNS],
    }
    return hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()


def compiled_fins(layout: Layout, objective: Objective) -> dict[str, FinEnvelope]:
    """All different fins of a layout.

    Raises:
        DataError: a fin's force table cannot be read.
    """
    return {
        content_key(fin.model, fin.limits, objective): fin_envelope(fin.model, fin.limits, objective)
        for fin in layout.fins
    }


def compiled_bytes(fins: CompiledFins) -> bytes:
    """The contents of a file of compiled fins; the same fins give the same bytes."""
    from safetensors.numpy import save

    arrays = {}
    for key, fin in fins.items():
        arrays[f"{key}.arc"] = np.array([fin.middle, fin.half])
        arrays[f"{key}.sizes"] = np.stack([fin.smallest, fin.largest])
        arrays[f"{key}.table"] = np.ascontiguousarray(fin.table)
    return bytes(save(arrays))


def parse_compiled(content: bytes, source: str) -> dict[str, FinEnvelope]:
    """The compiled fins in a file.

    Raises:
        DataError: it holds something else, or numbers that no fin has.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    try:
        arrays = load(content)
        parts: dict[str, dict[str, Array]] = {}
        for name, array in arrays.items():
            found = _NAME.fullmatch(name)
            if found is None:
                raise ValueError(f"{name!r:.40} is not expected")
            parts.setdefault(found[1], {})[found[2]] = array
        if len(parts) > MAX_FINS:
            raise ValueError(f"expected at most {MAX_FINS} fins, got {len(parts)}")
        return {key: _checked(**part) for key, part in parts.items()}
    except (KeyError, TypeError, ValueError, SafetensorError) as error:
        reason = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise DataError(f"{source}: holds no compiled fins ({reason}); export the bundle again") from None


def _checked(arc: Array, sizes: Array, table: Array) -> FinEnvelope:
    """A compiled fin, or a `ValueError` where the search could not live with it."""
    count = sizes.shape[-1] if sizes.ndim else 0
    shapes = (arc.shape, sizes.shape, table.shape)
    if count not in (1, DIRECTIONS) or shapes != ((2,), (2, count), (count, LEVELS, COLUMNS)):
        raise ValueError(f"arrays of shapes {shapes}")
    for array in (arc, sizes, table):
        if array.dtype != np.float64 or not (np.abs(array) <= LARGEST_NUMBER).all():
            raise ValueError("expected finite numbers of ordinary size in double precision")
    if not (abs(arc[0]) <= 4.0 * np.pi and 0.0 <= arc[1] <= np.pi):
        raise ValueError("an impossible arc")
    if not (sizes[0] >= 0.0).all() or not (sizes[0] <= sizes[1]).all():
        raise ValueError("forces that are negative, or larger at rest than at most")
    if not (table[..., (AMPLITUDE, FREQUENCY)] >= 0.0).all():
        raise ValueError("negative amplitudes or frequencies")
    return FinEnvelope(float(arc[0]), float(arc[1]), sizes[0].copy(), sizes[1].copy(), table)


def difference(found: FinEnvelope, expected: FinEnvelope) -> float:
    """How far two compiled fins differ: in arc as a share of a turn, in force and cost as shares of the
    largest; infinite where they are of different kinds."""
    if found.table.shape != expected.table.shape:
        return np.inf
    force, cost = float(expected.largest.max()), float(np.abs(expected.table[..., COST]).max())
    pairs = (
        (found.middle, expected.middle, 2.0 * np.pi),
        (found.half, expected.half, 2.0 * np.pi),
        (found.smallest, expected.smallest, force),
        (found.largest, expected.largest, force),
        (found.table[..., COST], expected.table[..., COST], cost),
    )
    return float(np.max([np.abs(a - b).max() / max(scale, 1e-300) for a, b, scale in pairs]))
