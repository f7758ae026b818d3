"""All allocation methods by name, and what they are made with."""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from finlab.allocation.bundle_settings import METHODS_ON_BOARD, About, read_about
from finlab.allocation.method import Method
from finlab.allocation.settings import Settings
from finlab.bundle_files import ABOUT, CHECKPOINT, Files, checkpoint_part, is_bundle, read_bundle_files
from finlab.errors import AllocationError, DataError
from finlab.networks.checkpoint import parse_checkpoint, read_checkpoint, resolve_checkpoint
from finlab.networks.trained import TrainedWeights
from finlab.physics.effort import EffortWeights

METHODS: dict[str, tuple[str, str]] = {
    "dual": ("finlab.allocation.dual.method", "Dual"),
    "mdn": ("finlab.mdn.method", "Mdn"),
    "paper": ("finlab.paper.pipeline", "Paper"),
    "qp": ("finlab.allocation.baselines.qp", "Qp"),
    "sqp": ("finlab.allocation.baselines.sqp", "Sqp"),
    "px4": ("finlab.allocation.baselines.px4", "Px4"),
    "ardusub": ("finlab.allocation.baselines.ardusub", "ArduSub"),
    "analytic": ("finlab.allocation.baselines.analytic", "Analytic"),
    "ipopt": ("finlab.allocation.baselines.ipopt", "Ipopt"),
}
"""Name -> module and class; modules are loaded only when their method is asked for."""
GONE = {
    **dict.fromkeys(("search", "learned"), "is now called 'dual'"),
    "fast": "has gone; 'dual' is exact on any fin and needs no network",
    **dict.fromkeys(("trf", "slsqp", "multistart"), "has gone; the yardstick is 'ipopt'"),
}
"""Earlier names -> what to say to those who ask for them."""
LEARNED = {"mdn": "default", "paper": "paper"}
"""Methods that need a trained network -> the shipped checkpoint that holds it."""
Checkpoint = str | os.PathLike[str] | TrainedWeights | None
"""A checkpoint folder, a bundle, the name of a shipped checkpoint, or the contents of one."""


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
    """The class of a method in `METHODS`.

    Raises:
        AllocationError: there is no such method.
    """
    if method in GONE:
        raise AllocationError(f"method: {method!r} {GONE[method]}")
    if method not in METHODS:
        raise AllocationError(f"method: expected one of {', '.join(METHODS)}, got {method!r:.60}")
    module, name = METHODS[method]
    kind: type[Method] = getattr(import_module(module), name)
    return kind


def choose_method(method: str, checkpoint: Checkpoint = None, **settings: Any) -> MethodChoice:
    """A method of `METHODS` by name, with its networks and settings.

    Raises:
        AllocationError: unknown method or setting, or a checkpoint for a method without networks.
        CheckpointError: missing, corrupt or foreign checkpoint.
        DataError: a bundle cannot be read, or was changed.
    """
    kind = method_class(method)
    if method not in LEARNED:
        if checkpoint is not None:
            raise AllocationError(
                f"checkpoint: method {method!r} has no networks, only {' and '.join(LEARNED)} have; "
                "leave it out"
            )
        return MethodChoice(kind, checked_settings(kind, settings))
    if isinstance(checkpoint, TrainedWeights):
        return MethodChoice(kind, checked_settings(kind, settings), checkpoint)
    if checkpoint is not None and is_bundle(checkpoint):
        return bundled_method(read_bundle_files(checkpoint), str(checkpoint), method, **settings)
    weights = read_checkpoint(resolve_checkpoint(checkpoint or LEARNED[method]))
    return MethodChoice(kind, checked_settings(kind, settings), weights)


def bundled_method(
    files: Files, source: str = "bundle", method: str | None = None, **settings: Any
) -> MethodChoice:
    """A method, by default the bundle's own, with what a bundle's files hold.

    Raises:
        AllocationError: unknown method or setting.
        DataError: the bundle is of another format, or does not hold what the method needs.
    """
    about = read_about(files, source)
    method = method or about.method
    kind = method_class(method)
    chosen = checked_settings(kind, _bundled_settings(about, f"{source}/{ABOUT}", method) | settings)
    if method not in LEARNED:
        return MethodChoice(kind, chosen)
    if method not in METHODS_ON_BOARD:
        raise DataError(
            f"{source}: method {method!r} does not run from a bundle; name its checkpoint in place of that"
        )
    part = checkpoint_part(files)
    if not part or about.checkpoint is None:
        raise DataError(
            f"{source}: holds no networks, which method {method!r} needs; export it again with "
            f"`finlab export LAYOUT -o DIR --method {method}`"
        )
    weights = parse_checkpoint(part, f"{source}/{CHECKPOINT.rstrip('/')}", about.checkpoint)
    return MethodChoice(kind, chosen, weights)


def _bundled_settings(about: About, place: str, method: str) -> dict[str, Any]:
    """The settings in a bundle, for a method: all of its own, and those that another one on board knows.

    Raises:
        DataError: settings that no robot should try.
    """
    values, kind = dict(about.settings), method_class(about.method)
    weights = values.get("effort_weights")
    try:
        if isinstance(weights, dict):
            values["effort_weights"] = EffortWeights(**weights)
        values = vars(checked_settings(kind, values))
    except (AllocationError, TypeError) as error:
        raise DataError(f"{place}: settings: {error}") from None
    known = method_class(method).option_names() if method in METHODS_ON_BOARD else []
    return {name: value for name, value in values.items() if name in known}


def checked_settings(kind: type[Method], settings: dict[str, Any]) -> Settings:
    """The settings of a method, by name.

    Raises:
        AllocationError: the method knows no such setting, or cannot work with its value.
    """
    known = kind.option_names()
    if "objective" in settings and "objective" not in known:
        raise AllocationError(
            f"objective: method {kind.name!r} has no choice; 'dual' keeps watts least, 'mdn' and 'paper' the "
            "paper's effort, and 'sqp' and 'ipopt' what they are told"
        )
    if unknown := [name for name in settings if name not in known]:
        raise AllocationError(
            f"method {kind.name!r} knows the settings {', '.join(known) or 'none'}, got {unknown[0]!r}"
        )
    return kind.settings_class(**settings)
