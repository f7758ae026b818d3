"""All allocation methods by name."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from finlab.allocation.allocator import Allocator
from finlab.errors import AllocationError

METHODS: dict[str, tuple[str, str]] = {
    "learned": ("finlab.allocation.learned", "LearnedAllocator"),
    "fast": ("finlab.allocation.fast", "FastAllocator"),
    "paper": ("finlab.allocation.paper", "PaperAllocator"),
    "qp": ("finlab.allocation.qp", "Qp"),
    "sqp": ("finlab.allocation.sqp", "Sqp"),
    "analytic": ("finlab.allocation.analytic", "Analytic"),
    "multistart": ("finlab.allocation.multistart", "Multistart"),
    "trf": ("finlab.allocation.trf", "Trf"),
    "slsqp": ("finlab.allocation.slsqp", "Slsqp"),
    "ipopt": ("finlab.allocation.ipopt", "Ipopt"),
}
"""Name -> module and class; modules are loaded only when their method is asked for."""

LEARNED = ("learned", "fast", "paper")
"""Methods that need a trained network; the others take only the normalization from a checkpoint."""


def load_allocator(
    checkpoint: str | Path | None = None, method: str = "learned", **options: Any
) -> Allocator:
    """The allocator of a method, ready to answer.

    Args:
        checkpoint: a checkpoint folder or the name of a shipped one; by default `paper` for the
            method `paper` and `default` for all others.
        method: one of `METHODS`.
        options: passed to the method's class.

    Raises:
        AllocationError: unknown method.
        CheckpointError: missing, corrupt or foreign checkpoint.
    """
    if method not in METHODS:
        raise AllocationError(f"method: expected one of {', '.join(METHODS)}, got {method!r}")
    from finlab.model.checkpoint import load_allocator_checkpoint, load_normalization, resolve_checkpoint

    path = resolve_checkpoint(checkpoint or ("paper" if method == "paper" else "default"))
    module, name = METHODS[method]
    kind = getattr(import_module(module), name)
    model = load_allocator_checkpoint(path) if method in LEARNED else load_normalization(path)
    known = kind.option_names()
    if unknown := [name for name in options if name not in known]:
        raise AllocationError(
            f"method {method!r} knows the options {', '.join(known) or 'none'}, got {unknown[0]!r}"
        )
    allocator: Allocator = kind(model, **options)
    return allocator
