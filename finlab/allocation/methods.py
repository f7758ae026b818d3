"""All allocation methods by name, and what they are made with."""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal

from finlab.allocation.method import Method
from finlab.allocation.settings import Settings
from finlab.assets import checkpoint_path
from finlab.bundle_files import ABOUT, FORMAT, NETWORKS, Files
from finlab.errors import AllocationError, DataError
from finlab.files.guarded import decoded
from finlab.files.plain_values import parse_json
from finlab.networks.checkpoint import parse_checkpoint, read_checkpoint, resolve_checkpoint
from finlab.networks.trained import TrainedWeights

MethodName = Literal[
    "dual", "mdn", "paper", "qp", "sqp", "paper_sqp", "px4", "ardusub", "analytic", "fixed_frequency", "ipopt"
]
"""Names of the methods that come with finlab; `METHODS` has the classes."""
METHODS: dict[str, tuple[str, str]] = {
    "dual": ("finlab.allocation.dual.method", "Dual"),
    "mdn": ("finlab.mdn.method", "Mdn"),
    "paper": ("finlab.paper.pipeline", "Paper"),
    "qp": ("finlab.allocation.baselines.linear", "Qp"),
    "sqp": ("finlab.allocation.baselines.sqp", "Sqp"),
    "paper_sqp": ("finlab.allocation.baselines.linear", "PaperSqp"),
    "px4": ("finlab.allocation.baselines.autopilots", "Px4"),
    "ardusub": ("finlab.allocation.baselines.autopilots", "ArduSub"),
    "analytic": ("finlab.allocation.baselines.pseudo_inverse", "Analytic"),
    "fixed_frequency": ("finlab.allocation.baselines.pseudo_inverse", "FixedFrequency"),
    "ipopt": ("finlab.allocation.baselines.ipopt", "Ipopt"),
}
"""Name -> module and class; modules are loaded only when their method is asked for."""
LEARNED = {"mdn": "default", "paper": "paper"}
"""Methods that need a trained network -> the shipped checkpoint that holds it."""
METHODS_ON_BOARD = ("dual", "mdn", "paper")
"""Methods that a bundle can answer with."""
Checkpoint = str | os.PathLike[str] | TrainedWeights | None
"""A checkpoint folder, the name of a shipped checkpoint, or the contents of one."""


@dataclass(frozen=True)
class MethodChoice:
    """A method with all that it needs beside a layout."""

    kind: type[Method]
    """Its class."""
    settings: Settings
    """Its settings."""
    weights: TrainedWeights | None = None
    """Its networks, where it has any."""


def method_class(method: str) -> type[Method]:
    """The class of a method in `METHODS`. Raises AllocationError: there is no such method."""
    if method not in METHODS:
        raise AllocationError(f"method: expected one of {', '.join(METHODS)}, got {method!r:.60}")
    module, name = METHODS[method]
    kind: type[Method] = getattr(import_module(module), name)
    return kind


def choose_method(method: str, checkpoint: Checkpoint = None, **settings: Any) -> MethodChoice:
    """A method of `METHODS` by name, with its networks and settings. Raises AllocationError: unknown method
    or setting, or a checkpoint for a method without networks; CheckpointError: missing, corrupt or foreign
    checkpoint."""
    kind = method_class(method)
    if method not in LEARNED:
        if checkpoint is not None:
            raise AllocationError(
                f"checkpoint: method {method!r} has no networks, only {' and '.join(LEARNED)} have; "
                "leave it out"
            )
        return MethodChoice(kind, checked_settings(kind, settings))
    if not isinstance(checkpoint, TrainedWeights):
        checkpoint = read_checkpoint(resolve_checkpoint(checkpoint or LEARNED[method]))
    return MethodChoice(kind, checked_settings(kind, settings), checkpoint)


def bundled_method(files: Files, source: str) -> MethodChoice:
    """The method of a bundle with what its files hold. Raises CheckpointError: its networks are damaged, or
    it has none and this finlab has not those that it names; DataError: the bundle is of another format, has a
    method that runs on no robot, or settings that no robot should try."""
    place = f"{source}/{ABOUT}"
    document = parse_json(decoded(files[ABOUT], place, "JSON"), place)
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{place}: expected format {FORMAT}; a bundle is made by `finlab export`")
    method, checkpoint, values = (document.get(key) for key in ("method", "checkpoint", "settings"))
    if not isinstance(method, str) or method not in METHODS_ON_BOARD:
        known = ", ".join(METHODS_ON_BOARD)
        raise DataError(f"{place}: method must be one of {known}, got {method!r:.40}")
    if not isinstance(checkpoint, str | None) or not isinstance(values, dict):
        raise DataError(f"{place}: checkpoint must be a name and settings must be keys and values")
    kind = method_class(method)
    try:
        settings = checked_settings(kind, values)
    except AllocationError as error:
        raise DataError(f"{place}: settings: {error}") from None
    if method not in LEARNED:
        return MethodChoice(kind, settings)
    name = checkpoint or LEARNED[method]
    inside = {key.removeprefix(NETWORKS): part for key, part in files.items() if key.startswith(NETWORKS)}
    place = f"{source}/{NETWORKS.rstrip('/')}"
    networks = parse_checkpoint(inside, place, name) if inside else read_checkpoint(checkpoint_path(name))
    return MethodChoice(kind, settings, networks)


def checked_settings(kind: type[Method], settings: dict[str, Any]) -> Settings:
    """The settings of a method, by name. Raises AllocationError: the method knows no such setting, or cannot
    work with its value."""
    known = kind.option_names()
    if "objective" in settings and "objective" not in known:
        raise AllocationError(
            f"objective: method {kind.name!r} has no choice; 'dual' keeps watts least, 'mdn' and 'paper' the "
            "paper's effort, and 'sqp' what it is told"
        )
    if unknown := [name for name in settings if name not in known]:
        raise AllocationError(
            f"method {kind.name!r} knows the settings {', '.join(known) or 'none'}, got {unknown[0]!r}"
        )
    return kind.settings_class(**settings)
