"""All allocation methods by name."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any, Literal

from finlab.allocation.allocator import Allocator
from finlab.errors import AllocationError
from finlab.inference.checkpoint import read_checkpoint, read_normalization, resolve_checkpoint

METHODS: dict[str, tuple[str, str]] = {
    "learned": ("finlab.allocation.learned.learned_allocator", "LearnedAllocator"),
    "fast": ("finlab.allocation.learned.fast", "FastAllocator"),
    "paper": ("finlab.allocation.learned.paper", "PaperAllocator"),
    "qp": ("finlab.allocation.baselines.qp", "Qp"),
    "sqp": ("finlab.allocation.baselines.sqp", "Sqp"),
    "analytic": ("finlab.allocation.baselines.analytic", "Analytic"),
    "multistart": ("finlab.allocation.baselines.multistart", "Multistart"),
    "trf": ("finlab.allocation.baselines.trf", "Trf"),
    "slsqp": ("finlab.allocation.baselines.slsqp", "Slsqp"),
    "ipopt": ("finlab.allocation.baselines.ipopt", "Ipopt"),
}
"""Name -> module and class; modules are loaded only when their method is asked for."""

LEARNED = ("learned", "fast", "paper")
"""Methods that need a trained network; the others take only the normalization from a checkpoint."""


Method = Literal["learned", "fast", "paper", "qp", "sqp", "analytic", "multistart", "trf", "slsqp", "ipopt"]
"""The names again, for type checkers and editors."""


def load_allocator(
    method: Method | str = "learned",
    *,
    checkpoint: str | Path | None = None,
    **options: Any,
) -> Allocator:
    """The allocator of a method, ready to answer.

    Args:
        method: one of `METHODS`.
        checkpoint: a checkpoint folder or the name of a shipped one; by default `paper` for the
            method `paper` and `default` for all others.
        options: passed to the method's class.

    Raises:
        AllocationError: unknown method.
        CheckpointError: missing, corrupt or foreign checkpoint.
    """
    if method not in METHODS:
        raise AllocationError(f"method: expected one of {', '.join(METHODS)}, got {method!r}")
    path = resolve_checkpoint(checkpoint or ("paper" if method == "paper" else "default"))
    module, name = METHODS[method]
    kind = getattr(import_module(module), name)
    model = read_checkpoint(path) if method in LEARNED else read_normalization(path)
    kind.check_options(options)
    allocator: Allocator = kind(model, **options)
    return allocator
