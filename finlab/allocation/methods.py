"""All allocation methods by name, and what they are made with."""

from __future__ import annotations

from dataclasses import dataclass
from pkgutil import resolve_name
from typing import Any, Literal

from finlab.allocation.method import Checkpoint, Method, Networks
from finlab.allocation.settings import Settings
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
LEARNED = ("mdn", "paper")
"""Methods that need a trained network."""
METHODS_ON_BOARD = ("dual", "mdn", "paper")
"""Methods that a bundle can answer with."""


@dataclass(frozen=True)
class MethodChoice:
    """A method with all that it needs beside a layout."""

    kind: type[Method]
    """Its class."""
    settings: Settings
    """Its settings."""
    weights: Networks | None = None
    """Its networks, where it has any."""


def method_class(method: str) -> type[Method]:
    """The class of a method in `METHODS`. Raises AllocationError: there is no such method."""
    if method not in METHODS:
        raise AllocationError(f"method: expected one of {', '.join(METHODS)}, got {method!r:.60}")
    kind: type[Method] = resolve_name(METHODS[method])
    return kind


def choose_method(method: str, checkpoint: Checkpoint = None, **settings: Any) -> MethodChoice:
    """A method of `METHODS` by name, with its networks and settings. Raises AllocationError:
    unknown method or setting, or a checkpoint for a method without networks; CheckpointError:
    missing, corrupt or foreign checkpoint."""
    kind = method_class(method)
    if method not in LEARNED and checkpoint is not None:
        raise AllocationError(
            f"checkpoint: method {method!r} has no networks, only {' and '.join(LEARNED)} have; "
            "leave it out"
        )
    networks = kind.read_networks(checkpoint)
    return MethodChoice(kind, checked_settings(kind, settings), networks)


def checked_settings(kind: type[Method], settings: dict[str, Any]) -> Settings:
    """The settings of a method, by name. Raises AllocationError: the method knows no such setting,
    or cannot work with its value."""
    known = kind.option_names()
    if "objective" in settings and "objective" not in known:
        raise AllocationError(
            f"objective: method {kind.name!r} has no choice; 'dual' keeps watts least, 'mdn' and "
            "'paper' the "
            "paper's effort, and 'sqp' what it is told"
        )
    if unknown := [name for name in settings if name not in known]:
        raise AllocationError(
            f"method {kind.name!r} knows the settings {', '.join(known) or 'none'}, got "
            f"{unknown[0]!r}"
        )
    return kind.settings_class(**settings)
