"""What travels with a bundle in its `bundle.json`: the method, its yardstick, and what it is made with."""

import json
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from finlab.allocation.learned.settings import MdnSettings
from finlab.allocation.search.settings import Settings
from finlab.bundle_files import ABOUT, VERSION, Files
from finlab.errors import DataError
from finlab.inference.normalization import Normalization
from finlab.physics.energy import EnergyWeights

if TYPE_CHECKING:
    from finlab.allocation.search.search_allocator import SearchAllocator

FORMAT = "finlab-bundle"
METHODS_ON_BOARD: Mapping[str, type[Settings]] = {"search": Settings, "mdn": MdnSettings}
"""Methods that a bundle can answer with, and their settings."""
AIM = {"objective": "power", "copper_loss": 0.0}
"""What is kept least, beside the weights of the effort."""

_CHOICES = {"objective": ("power", "effort")}
_LARGEST = {"n_candidates": 4096, "n_refined": 256, "search_steps": 100, "refine_steps": 100}
"""Largest settings that a robot accepts from a file; more would keep it from answering."""


class About(NamedTuple):
    """What a bundle says of itself."""

    method: str
    """One of `METHODS_ON_BOARD`."""
    checkpoint: str | None
    """Name of the checkpoint that the networks come from; None for methods without."""
    normalization: Normalization
    """Yardstick of the error."""
    settings: dict[str, Any]
    """Settings of the method, by name."""

    def settings_for(self, method: str) -> dict[str, Any]:
        """Those settings that another method knows as well; none for methods that do not run on board."""
        if method not in METHODS_ON_BOARD:
            return {}
        known = {"energy_weights", *AIM, *vars(METHODS_ON_BOARD[method]())}
        return {name: value for name, value in self.settings.items() if name in known}


def about_bundle(allocator: "SearchAllocator", made_by: str) -> bytes:
    """The contents of `bundle.json` for an allocator, made by a version of finlab."""
    options = allocator.options.items()
    document = {
        "format": FORMAT,
        "version": VERSION,
        "finlab": made_by,
        "method": allocator.name,
        "checkpoint": allocator.checkpoint,
        "normalization": {key: value.tolist() for key, value in allocator.normalization._asdict().items()},
        "settings": {key: asdict(value) if is_dataclass(value) else value for key, value in options},  # type: ignore[arg-type]
    }
    return (json.dumps(document, indent=1, allow_nan=False) + "\n").encode()


def read_about(files: Files, source: str) -> About:
    """What the allocator on board is made with.

    Raises:
        DataError: of another format, or settings that no robot should try.
    """
    place = f"{source}/{ABOUT}"
    try:
        document = json.loads(files[ABOUT])
    except (ValueError, RecursionError):
        raise DataError(f"{place}: not readable as JSON") from None
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{place}: expected format {FORMAT}; a bundle is made by `finlab export`")
    method, checkpoint, values = (document.get(key) for key in ("method", "checkpoint", "settings"))
    if not isinstance(method, str) or method not in METHODS_ON_BOARD:
        known = ", ".join(METHODS_ON_BOARD)
        raise DataError(f"{place}: method must be one of {known}, got {method!r:.40}")
    if not isinstance(checkpoint, str | None) or not isinstance(values, dict):
        raise DataError(f"{place}: checkpoint must be a name and settings must be keys and values")
    plain = {key: value for key, value in values.items() if key != "energy_weights"}
    settings = _checked({**AIM, **vars(METHODS_ON_BOARD[method]())}, plain, f"{place}: settings")
    weights = _checked(
        vars(EnergyWeights()), values.get("energy_weights"), f"{place}: settings: energy_weights"
    )
    try:
        normalization = Normalization.parse(document.get("normalization"))
    except ValueError as error:
        raise DataError(f"{place}: {error}") from None
    return About(method, checkpoint, normalization, {**settings, "energy_weights": EnergyWeights(**weights)})


def _checked(usual: Mapping[str, Any], values: Any, place: str) -> dict[str, Any]:
    """Values by the same names as the usual ones, each of the kind that the usual one is."""
    if not isinstance(values, Mapping) or set(values) != set(usual):
        raise DataError(f"{place} must be {', '.join(usual)}")
    for name, value in values.items():
        if name in _CHOICES:
            if value not in _CHOICES[name]:
                raise DataError(f"{place}: {name} must be {' or '.join(_CHOICES[name])}, got {value!r:.40}")
        elif isinstance(usual[name], bool):
            if not isinstance(value, bool):
                raise DataError(f"{place}: {name} must be true or false, got {value!r:.40}")
        elif value is not None or usual[name] is not None:
            kind = (int, float) if isinstance(usual[name], float) else int
            largest = _LARGEST.get(name, 100)
            if isinstance(value, bool) or not isinstance(value, kind) or not 0 <= value <= largest:
                raise DataError(f"{place}: {name} must lie within 0..{largest}, got {value!r:.40}")
    return dict(values)
