"""All allocation methods by name, and what they are made with.

A new method is a line in `METHODS` and a word of `MethodName`; one that a robot may run from a
bundle is in `METHODS_ON_BOARD`, too. All else that is to be known of it are facts of its class.
"""

from __future__ import annotations

from dataclasses import dataclass
from pkgutil import resolve_name
from typing import Any, Literal

from finlab.allocation.method import Checkpoint, Method, Networks, Settings
from finlab.errors import AllocationError

MethodName = Literal[
    "dual",
    "mdn",
    "paper",
    "qp",
    "sqp",
    "paper_sqp",
    "px4",
    "ardusub",
    "analytic",
    "fixed_frequency",
    "ipopt",
]
"""Names of the methods that come with finlab; `METHODS` says where their classes stand."""
METHODS: dict[str, str] = {
    "dual": "finlab.allocation.dual.method:Dual",
    "mdn": "finlab.research.mdn.method:Mdn",
    "paper": "finlab.research.paper.pipeline:Paper",
    "qp": "finlab.allocation.baselines.linear:Qp",
    "sqp": "finlab.allocation.baselines.sqp:Sqp",
    "paper_sqp": "finlab.allocation.baselines.linear:PaperSqp",
    "px4": "finlab.allocation.baselines.autopilots:Px4",
    "ardusub": "finlab.allocation.baselines.autopilots:ArduSub",
    "analytic": "finlab.allocation.baselines.pseudo_inverse:Analytic",
    "fixed_frequency": "finlab.allocation.baselines.pseudo_inverse:FixedFrequency",
    "ipopt": "finlab.allocation.baselines.ipopt:Ipopt",
}
"""Name -> where its class stands, `module:Class`; it is imported when the method is asked for."""
METHODS_ON_BOARD = ("dual", "mdn", "paper")
"""Methods that a bundle can answer with. Their names stand here, and no fact in their classes: a
bundle is a file of strangers, and what it names is not imported unless it is one of these. They
need numpy and msgspec alone."""


@dataclass(frozen=True)
class MethodChoice:
    """A method with all that it needs beside a layout."""

    kind: type[Method]
    """Its class."""
    settings: Settings
    """Its settings."""
    networks: Networks | None = None
    """Its networks, where it has any."""


def method_class(method: str) -> type[Method]:
    """Imports the class of a method.

    Args:
        method: a name in `METHODS`.

    Returns:
        Its class.

    Raises:
        AllocationError: there is no such method.
    """
    if method not in METHODS:
        raise AllocationError(f"method: expected one of {', '.join(METHODS)}, got {method!r:.60}")
    kind: type[Method] = resolve_name(METHODS[method])
    return kind


def choose_method(method: str, checkpoint: Checkpoint = None, **settings: Any) -> MethodChoice:
    """Chooses a method by name, with its networks and settings.

    Args:
        method: a name in `METHODS`.
        checkpoint: where its networks come from; None for the shipped ones, or for a method
            without.
        settings: by name; those that are not given have their usual values.

    Returns:
        All that the method needs beside a layout.

    Raises:
        AllocationError: unknown method or setting, or a checkpoint for a method without networks.
        CheckpointError: missing, corrupt or foreign checkpoint.
    """
    kind = method_class(method)
    if checkpoint is not None and not kind.needs_networks:
        raise AllocationError(
            f"checkpoint: method {method!r} has no networks, only methods with networks take one; "
            "leave it out"
        )
    networks = kind.read_networks(checkpoint)
    return MethodChoice(kind, checked_settings(kind, settings), networks)


def checked_settings(kind: type[Method], settings: dict[str, Any]) -> Settings:
    """Makes the settings of a method.

    Args:
        kind: class of the method.
        settings: values by name.

    Returns:
        An object of its `settings_class`, which has checked itself.

    Raises:
        AllocationError: the method knows no such setting, or cannot work with its value.
    """
    known = kind.option_names()
    if "objective" in settings and "objective" not in known:
        raise AllocationError(
            f"objective: method {kind.name!r} has no choice; 'dual' keeps watts least, 'mdn' and "
            "'paper' the paper's effort, and 'sqp' what it is told"
        )
    unknown = [name for name in settings if name not in known]
    if unknown:
        raise AllocationError(
            f"method {kind.name!r} knows the settings {', '.join(known) or 'none'}, got "
            f"{unknown[0]!r}"
        )
    return kind.settings_class(**settings)
