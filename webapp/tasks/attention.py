"""How much the fins look at each other in the network: the graph that it sees."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocator import Allocator
from finlab.inference.features import fin_frame_features
from finlab.layout import Layout


class Attention(NamedTuple):
    """Weights of one question."""

    fins: tuple[str, ...]
    """The fins in the graph, n of them: those that work."""
    weight: NDArray[np.float64]
    """How much each fin (rows) looks at each (columns), (n, n); rows sum to 1, itself included."""


def attention(
    allocator: Allocator, layout: Layout, failed: tuple[str, ...], target: NDArray[np.float64]
) -> Attention | None:
    """What the fins of a layout look at for a target (6,) [N, N m]; None for methods without a graph."""
    from finlab.allocation.learned.learned_allocator import LearnedAllocator

    if not isinstance(allocator, LearnedAllocator):
        return None
    healthy = layout.without(failed) if failed else layout
    normalization = allocator.normalization
    centred = (np.asarray(target)[None] - normalization.mean) / normalization.std
    features = fin_frame_features(allocator.pipeline.prepare(healthy).geometry, centred).astype(np.float32)
    return Attention(
        healthy.names, np.asarray(allocator.pipeline.network.attention(features)[0], dtype=np.float64)
    )
