"""All allocation methods by name."""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal, Unpack, overload

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.allocation.bundle_settings import METHODS_ON_BOARD, read_about
from finlab.bundle_files import (
    ABOUT,
    CHECKPOINT,
    Files,
    checkpoint_part,
    is_bundle,
    read_bundle_files,
)
from finlab.errors import AllocationError, DataError
from finlab.networks.checkpoint import (
    parse_checkpoint,
    read_checkpoint,
    read_normalization,
    resolve_checkpoint,
)
from finlab.networks.normalization import Normalization
from finlab.networks.trained import TrainedWeights

if TYPE_CHECKING:
    from finlab.allocation.search.search_allocator import SearchAllocator
    from finlab.allocation.search.settings import MdnOptions, SearchOptions
    from finlab.mdn.allocator import MdnAllocator
    from finlab.paper.pipeline import PaperAllocator
    from finlab.paper.settings import PaperOptions

METHODS: dict[str, tuple[str, str]] = {
    "search": ("finlab.allocation.search.search_allocator", "SearchAllocator"),
    "mdn": ("finlab.mdn.allocator", "MdnAllocator"),
    "paper": ("finlab.paper.pipeline", "PaperAllocator"),
    "qp": ("finlab.allocation.baselines.qp", "Qp"),
    "sqp": ("finlab.allocation.baselines.sqp", "Sqp"),
    "analytic": ("finlab.allocation.baselines.analytic", "Analytic"),
    "ipopt": ("finlab.allocation.baselines.ipopt", "Ipopt"),
}
"""Name -> module and class; modules are loaded only when their method is asked for. The one list of methods:
tests hold `MethodName` and the command line's words against it."""

GONE = {
    "learned": "is now called 'search'",
    "fast": "has gone; 'search' is exact on any fin and needs no network",
    **dict.fromkeys(("trf", "slsqp", "multistart"), "has gone; the yardstick is 'ipopt'"),
}
"""Earlier names -> what to say to those who ask for them."""
LEARNED = ("mdn", "paper")
"""Methods that need a trained network; the others take only the normalization from a checkpoint."""


MethodName = Literal["search", "mdn", "paper", "qp", "sqp", "analytic", "ipopt"]
"""The names again, for type checkers and editors."""


@overload
def load_allocator(
    method: Literal["search"] = "search",
    *,
    checkpoint: str | os.PathLike[str] | None = None,
    **options: Unpack[SearchOptions],
) -> SearchAllocator: ...
@overload
def load_allocator(
    method: Literal["mdn"],
    *,
    checkpoint: str | os.PathLike[str] | None = None,
    **options: Unpack[MdnOptions],
) -> MdnAllocator: ...
@overload
def load_allocator(
    method: Literal["paper"],
    *,
    checkpoint: str | os.PathLike[str] | None = None,
    **options: Unpack[PaperOptions],
) -> PaperAllocator: ...
@overload
def load_allocator(
    method: str | os.PathLike[str],
    *,
    checkpoint: str | os.PathLike[str] | None = None,
    **options: Any,
) -> Allocator: ...
def load_allocator(
    method: MethodName | str | os.PathLike[str] = "search",
    *,
    checkpoint: str | os.PathLike[str] | None = None,
    **options: Any,
) -> Allocator:
    """The allocator of a method, ready to answer.

    Args:
        method: one of `METHODS`; or a bundle made by `finlab export`, which answers by the method that it was
            made for.
        checkpoint: a checkpoint folder, a bundle, or the name of a shipped checkpoint; by default `paper` for
            the method `paper` and `default` for all others.
        options: passed to the method's class; where a bundle holds settings, they stand for those left out.

    Raises:
        AllocationError: unknown method.
        CheckpointError: missing, corrupt or foreign checkpoint.
        DataError: the bundle cannot be read, or was changed.
    """
    if str(method) in GONE:
        raise AllocationError(f"method: {str(method)!r} {GONE[str(method)]}")
    if method not in METHODS:
        if checkpoint is not None or not (isinstance(method, os.PathLike) or is_bundle(method)):
            raise AllocationError(f"method: expected one of {', '.join(METHODS)}, got {str(method)!r}")
        return allocator_from_bundle(read_bundle_files(method), str(method), None, **options)
    name = str(method)
    if checkpoint is not None and is_bundle(checkpoint):
        return allocator_from_bundle(read_bundle_files(checkpoint), str(checkpoint), name, **options)
    path = resolve_checkpoint(checkpoint or ("paper" if name == "paper" else "default"))
    return _made(name, read_checkpoint(path) if name in LEARNED else read_normalization(path), options)


def allocator_from_bundle(
    files: Files, source: str = "bundle", method: str | None = None, **options: Any
) -> Allocator:
    """The allocator of a method, by default the bundle's own, with what a bundle's files hold; see
    `load_allocator`."""
    about = read_about(files, source)
    method, options = method or about.method, about.settings_for(method or about.method) | options
    if method not in LEARNED:
        return _made(method, about.normalization, options)
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
    if not all(np.array_equal(a, b) for a, b in zip(weights.normalization, about.normalization, strict=True)):
        raise DataError(f"{source}: {ABOUT} and the networks differ in normalization; export it again")
    return _made(method, weights, options)


def _made(method: str, model: TrainedWeights | Normalization, options: Mapping[str, Any]) -> Allocator:
    kind: Any = method_class(method)
    kind.check_options(options)
    allocator: Allocator = kind(model, **options)
    return allocator


def method_class(method: str) -> type[Allocator]:
    """The class of a method in `METHODS`."""
    module, name = METHODS[method]
    kind: type[Allocator] = getattr(import_module(module), name)
    return kind
