"""The settings that travel with a bundle, in its `bundle.json`: what the allocator on board is made with."""

import json
from collections.abc import Mapping
from dataclasses import asdict, fields, is_dataclass
from typing import Any

from finlab.allocation.search.settings import Settings
from finlab.bundle_files import ABOUT, VERSION, Files
from finlab.errors import DataError
from finlab.physics.energy import EnergyWeights

FORMAT = "finlab-bundle"
METHODS_ON_BOARD = ("search",)
"""Methods that a bundle can answer with; they share their settings."""

_LARGEST = {"n_candidates": 4096, "n_seeds": 256, "n_refined": 256, "search_steps": 100, "refine_steps": 100}
"""Largest settings that a robot accepts from a file; more would keep it from answering."""


def about_bundle(options: Mapping[str, Any], checkpoint: str, made_by: str) -> bytes:
    """The contents of `bundle.json`.

    Args:
        options: those of the allocator, see `Allocator.options`.
        checkpoint: name of the checkpoint.
        made_by: version of finlab.
    """
    settings = {key: asdict(value) if is_dataclass(value) else value for key, value in options.items()}  # type: ignore[arg-type]
    document = {"format": FORMAT, "version": VERSION, "finlab": made_by, "checkpoint": checkpoint}
    return (json.dumps(document | {"settings": settings}, indent=1, allow_nan=False) + "\n").encode()


def read_about(files: Files, source: str) -> tuple[str, dict[str, Any]]:
    """The checkpoint's name in a bundle, and the settings to make the allocator with.

    Raises:
        DataError: of another format or version, or settings that no robot should try.
    """
    place = f"{source}/{ABOUT}"
    try:
        document = json.loads(files[ABOUT])
    except (ValueError, RecursionError):
        raise DataError(f"{place}: not readable as JSON") from None
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{place}: expected format {FORMAT}; a bundle is made by `finlab export`")
    if document.get("version") != VERSION:
        raise DataError(
            f"{place}: bundle version {document.get('version')!r:.40}, this finlab reads version {VERSION}; "
            "export it again with `finlab export LAYOUT -o DIR`"
        )
    name, values = document.get("checkpoint"), document.get("settings")
    if not isinstance(name, str) or not isinstance(values, dict):
        raise DataError(f"{place}: checkpoint must be a name and settings must be keys and values")
    weights = values.get("energy_weights")
    plain = {key: value for key, value in values.items() if key != "energy_weights"}
    settings = _checked(Settings(), plain, f"{place}: settings")
    energy_weights = EnergyWeights(**_checked(EnergyWeights(), weights, f"{place}: energy_weights"))
    return name, settings | {"energy_weights": energy_weights}


def _checked(default: Any, values: Any, place: str) -> dict[str, Any]:
    """Values for the fields of a dataclass, each of the kind that its default is."""
    usual = {field.name: getattr(default, field.name) for field in fields(default)}
    if not isinstance(values, Mapping) or set(values) != set(usual):
        raise DataError(f"{place} must be {', '.join(usual)}")
    for name, value in values.items():
        if isinstance(usual[name], bool):
            if not isinstance(value, bool):
                raise DataError(f"{place}: {name} must be true or false, got {value!r:.40}")
        elif value is not None or usual[name] is not None:
            kind = (int, float) if isinstance(usual[name], float) else int
            largest = _LARGEST.get(name, 100)
            if isinstance(value, bool) or not isinstance(value, kind) or not 0 <= value <= largest:
                raise DataError(f"{place}: {name} must lie within 0..{largest}, got {value!r:.40}")
    return dict(values)
