"""What stands beside the weights in a bundle's ONNX files, and its way back. numpy only.

Every value is text; numbers and lists are JSON. `format` and `version` say what the rest means.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

import numpy as np

import finlab
from finlab.allocation.learned.settings import Settings
from finlab.deploy.graph import LayoutGraph
from finlab.deploy.onnx.model import Model
from finlab.errors import DataError
from finlab.inference.learned_fin import FORCE_UNIT, REFERENCE
from finlab.inference.normalization import Normalization
from finlab.inference.weights import TrainedWeights
from finlab.physics.energy import EnergyWeights

VERSION = "1"
"""Version of the bundle; a reader knows exactly one."""
NETWORK_FORMAT, SURROGATE_FORMAT, FAST_FORMAT = "finlab-network", "finlab-surrogate", "finlab-fast"

_MOST = {"n_candidates": 4096, "n_seeds": 256, "n_refined": 256, "search_steps": 100, "refine_steps": 100}
"""Largest settings that a robot accepts from a file; more would keep it from answering."""


def network_metadata(
    graph: LayoutGraph, weights: TrainedWeights, settings: Settings, energy_weights: EnergyWeights
) -> dict[str, str]:
    """What to write into `network.onnx`."""
    return _shared(NETWORK_FORMAT, graph, weights) | {
        "features": graph.feature_set,
        "heads": str(weights.check_network().heads),
        "n_components": str(weights.check_network().n_components),
        "settings": json.dumps(asdict(settings)),
        "energy_weights": json.dumps(asdict(energy_weights)),
        "fins": json.dumps(list(graph.layout.names), ensure_ascii=False),
        "limits_lower": json.dumps([fin.limits.lower for fin in graph.layout.fins]),
        "limits_upper": json.dumps([fin.limits.upper for fin in graph.layout.fins]),
        "command": "amplitude [rad], frequency [Hz], zero direction [rad], each -1..1 between its limits",
    }


def surrogate_metadata(graph: LayoutGraph, weights: TrainedWeights) -> dict[str, str]:
    """What to write into `surrogate.onnx`."""
    return _shared(SURROGATE_FORMAT, graph, weights) | {
        "reference": json.dumps(list(REFERENCE)),
        "force_unit_n": json.dumps(FORCE_UNIT),
        "fin_model": json.dumps(dict(weights.fin_model), sort_keys=True),
    }


def fast_metadata(graph: LayoutGraph, weights: TrainedWeights) -> dict[str, str]:
    """What to write into `fast.onnx`."""
    return _shared(FAST_FORMAT, graph, weights) | {"features": graph.feature_set}


def _shared(form: str, graph: LayoutGraph, weights: TrainedWeights) -> dict[str, str]:
    mean, std = weights.normalization
    return {
        "format": form,
        "version": VERSION,
        "finlab": finlab.__version__,
        "layout": graph.layout.name,
        "checkpoint": graph.checkpoint,
        "checkpoint_sha256": graph.checkpoint_sha256,
        "wrench_mean": json.dumps(mean.tolist()),
        "wrench_std": json.dumps(std.tolist()),
        "frame": "FLU, origin at the centre of gravity; wrench [Fx, Fy, Fz, Tx, Ty, Tz] in N and N m",
    }


def check_format(model: Model, form: str, source: str) -> None:
    """Refuse a model of another format or version."""
    found = model.metadata.get("format")
    if found != form:
        raise DataError(f"{source}: expected format {form}, got {found!r:.40}")
    if model.metadata.get("version") != VERSION:
        got = model.metadata.get("version")
        raise DataError(f"{source}: this finlab reads version {VERSION}, got {got!r:.40}; export it again")


def value_of(model: Model, key: str, source: str) -> Any:
    """One value of the metadata, read as JSON; text that is no JSON is refused."""
    if key not in model.metadata:
        raise DataError(f"{source}: the metadata lacks {key!r}")
    try:
        return json.loads(model.metadata[key])
    except (ValueError, RecursionError):
        raise DataError(f"{source}: {key} is not readable") from None


def whole_of(model: Model, key: str, most: int, source: str) -> int:
    """A whole number from 1 to `most` in the metadata."""
    value = value_of(model, key, source)
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
        raise DataError(f"{source}: {key} must be a whole number from 1 to {most}, got {value!r:.40}")
    return value


def numbers_of(model: Model, key: str, count: int, source: str) -> tuple[float, ...]:
    """Positive or negative finite numbers in the metadata."""
    value = value_of(model, key, source)
    values = value if isinstance(value, list) else [value]
    plain = all(isinstance(item, int | float) and not isinstance(item, bool) for item in values)
    if not plain or len(values) != count or not all(abs(item) < 1e300 for item in values):
        raise DataError(f"{source}: {key} must be {count} finite numbers, got {value!r:.40}")
    return tuple(float(item) for item in values)


def normalization_of(model: Model, source: str) -> Normalization:
    """The statistics of the wrench."""
    mean, std = (numbers_of(model, key, 6, source) for key in ("wrench_mean", "wrench_std"))
    if min(std) <= 0:
        raise DataError(f"{source}: wrench_std must be above 0, got {min(std):g}")
    return Normalization(np.array(mean), np.array(std))


def settings_of(model: Model, source: str) -> dict[str, Any]:
    """What to make the allocator with: the fields of `Settings`, and `energy_weights`; checked one by one."""
    settings = _fields_of(Settings(), value_of(model, "settings", source), f"{source}: settings")
    weights = value_of(model, "energy_weights", source)
    costs = EnergyWeights(**_fields_of(EnergyWeights(), weights, f"{source}: energy_weights"))
    return settings | {"energy_weights": costs}


def _fields_of(default: Any, values: Any, place: str) -> dict[str, Any]:
    """Values for the fields of a dataclass, each of the kind that its default is."""
    known = {field.name: getattr(default, field.name) for field in fields(default)}
    if not isinstance(values, Mapping) or set(values) != set(known):
        raise DataError(f"{place} must be {', '.join(known)}")
    result: dict[str, Any] = {}
    for name, value in values.items():
        usual = known[name]
        if not (value is None and usual is None) and not isinstance(usual, bool):
            kind = (int, float) if isinstance(usual, float) else int
            most = _MOST.get(name, 100)
            if isinstance(value, bool) or not isinstance(value, kind) or not 0 <= value <= most:
                raise DataError(f"{place}: {name} must lie within 0..{most}, got {value!r:.40}")
        elif isinstance(usual, bool) and not isinstance(value, bool):
            raise DataError(f"{place}: {name} must be true or false, got {value!r:.40}")
        result[name] = value
    return result
