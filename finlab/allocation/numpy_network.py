"""The trained allocator network in numpy, for a few targets at a time.

A network this small spends most of its time on the overhead of each tensor operation; numpy's is a
few times smaller than a tensor library's, and a robot's computer need not have one. A test holds it
against `finlab.model.allocator_network.AllocatorNetwork`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

_LAYER_NORM_EPS = np.float32(1e-5)
_LOG_STD_LOW, _LOG_STD_RANGE = np.float32(-3.0), np.float32(6.0)


class MixtureArrays(NamedTuple):
    """A joint mixture over the commands of n fins for N targets, in normalized coordinates."""

    weight: Array
    """Weights of the components (N, M)."""
    mean: Array
    """Means (N, n, M, 3)."""
    std: Array
    """Standard deviations (N, n, M, 3)."""


class NumpyNetwork:
    """A joint-mixture allocator network: features and target in, mixture out."""

    def __init__(self, weights: Mapping[str, NDArray[np.floating]], heads: int, n_components: int) -> None:
        """Take over a trained network.

        Args:
            weights: its state by PyTorch's names.
            heads: attention heads.
            n_components: number M of mixture components.
        """
        w = {key: np.ascontiguousarray(value, dtype=np.float32) for key, value in weights.items()}
        self.heads, self.n_components = heads, n_components
        n_graph = len({key.split(".")[1] for key in w if key.startswith("graph.")})
        n_transformer = len({key.split(".")[2] for key in w if key.startswith("transformer.layers.")})
        self.graph = [_Graph(w, f"graph.{i}", heads) for i in range(n_graph)]
        self.skip = _linear(w, "skip")
        self.wrench = (_linear(w, "wrench.0"), _linear(w, "wrench.2"))
        self.join = _linear(w, "join")
        self.transformer = [_Transformer(w, f"transformer.layers.{i}", heads) for i in range(n_transformer)]
        self.norm = (w["norm.weight"], w["norm.bias"])
        self.head, self.weight = _linear(w, "head"), _linear(w, "weight")

    def __call__(
        self, x: Array, target: Array, lower: NDArray[np.floating], upper: NDArray[np.floating]
    ) -> MixtureArrays:
        """The mixture.

        Args:
            x: node features (N, n, F).
            target: normalized, centred targets (N, 6).
            lower: lower limits (n, 3).
            upper: upper limits (n, 3).
        """
        hidden = x
        for graph in self.graph:
            hidden = graph(hidden)
            hidden = np.where(hidden > 0, hidden, np.expm1(np.minimum(hidden, 0)))
        hidden = hidden + _apply(self.skip, x)
        wrench = _apply(self.wrench[0], target)
        wrench = _apply(self.wrench[1], wrench / (1.0 + np.exp(-np.clip(wrench, -80.0, 80.0))))
        weight, bias = self.join
        width = hidden.shape[-1]
        hidden = hidden @ weight[:width] + (wrench @ weight[width:] + bias)[:, None]
        for layer in self.transformer:
            hidden = layer(hidden)
        hidden = _layer_norm(hidden, self.norm)
        raw = _apply(self.head, hidden).reshape(*x.shape[:2], self.n_components, 7)
        logits = _apply(self.weight, hidden.mean(1))
        mean = np.empty((*raw.shape[:3], 3), dtype=np.float32)
        mean[..., :2] = np.tanh(raw[..., :2])
        mean[..., 2] = _direction(raw[..., 2], raw[..., 3], lower, upper)
        std = np.exp(_LOG_STD_LOW + _LOG_STD_RANGE / (1.0 + np.exp(-raw[..., 4:])))
        return MixtureArrays(_softmax(logits), mean, std)

    def attention(self, x: Array) -> Array:
        """How much each fin looks at each (N, n, n) in the first layer, mean of its heads; rows sum to 1.

        Args:
            x: node features (N, n, F).
        """
        return np.asarray(self.graph[0].attention(x)[0].mean(-1))


class _Graph:
    """One dense GATv2 layer."""

    def __init__(self, w: dict[str, Array], name: str, heads: int) -> None:
        self.both = (
            np.concatenate([w[f"{name}.source.weight"], w[f"{name}.target.weight"]]).T.copy(),
            np.concatenate([w[f"{name}.source.bias"], w[f"{name}.target.bias"]]),
        )
        attention = w[f"{name}.attention"]
        self.heads, self.width = heads, attention.size
        # Block form, so that one product scores all heads.
        self.score = np.zeros((attention.size, heads), dtype=np.float32)
        for head in range(heads):
            self.score[head * attention.shape[1] : (head + 1) * attention.shape[1], head] = attention[head]
        self.bias = w[f"{name}.bias"]

    def attention(self, x: Array) -> tuple[Array, Array]:
        """Weights (N, n, n, heads) with which each fin looks at each, and what it sees (N, n, width)."""
        both = _apply(self.both, x)
        source, target = both[..., : self.width], both[..., self.width :]
        pair = source[:, None] + target[:, :, None]
        return _softmax(np.maximum(pair, np.float32(0.2) * pair) @ self.score, axis=2), source

    def __call__(self, x: Array) -> Array:
        batch, n, _ = x.shape
        weight, source = self.attention(x)
        split = source.reshape(batch, n, self.heads, -1).transpose(0, 2, 1, 3)
        out = weight.transpose(0, 3, 1, 2) @ split
        return out.transpose(0, 2, 1, 3).reshape(batch, n, self.width) + self.bias


class _Transformer:
    """One Transformer encoder layer, normalization first, ReLU."""

    def __init__(self, w: dict[str, Array], name: str, heads: int) -> None:
        self.heads = heads
        self.qkv = (w[f"{name}.self_attn.in_proj_weight"].T.copy(), w[f"{name}.self_attn.in_proj_bias"])
        self.out = _linear(w, f"{name}.self_attn.out_proj")
        self.up, self.down = _linear(w, f"{name}.linear1"), _linear(w, f"{name}.linear2")
        self.norm1 = (w[f"{name}.norm1.weight"], w[f"{name}.norm1.bias"])
        self.norm2 = (w[f"{name}.norm2.weight"], w[f"{name}.norm2.bias"])

    def __call__(self, x: Array) -> Array:
        batch, n, width = x.shape
        qkv = _apply(self.qkv, _layer_norm(x, self.norm1)).reshape(batch, n, 3, self.heads, -1)
        q, k, v = qkv.transpose(2, 0, 3, 1, 4)
        weight = _softmax((q @ k.swapaxes(-1, -2)) * np.float32(q.shape[-1] ** -0.5))
        x = x + _apply(self.out, (weight @ v).transpose(0, 2, 1, 3).reshape(batch, n, width))
        return x + _apply(self.down, np.maximum(_apply(self.up, _layer_norm(x, self.norm2)), 0))


def _linear(w: dict[str, Array], name: str) -> tuple[Array, Array]:
    return w[f"{name}.weight"].T.copy(), w[f"{name}.bias"]


def _apply(layer: tuple[Array, Array], x: Array) -> Array:
    # One product of two matrices is much faster than numpy's loop over stacked small ones.
    return (x.reshape(-1, x.shape[-1]) @ layer[0] + layer[1]).reshape(*x.shape[:-1], -1)


def _layer_norm(x: Array, scale: tuple[Array, Array]) -> Array:
    centred = x - x.mean(-1, keepdims=True)
    variance = np.einsum("...i,...i->...", centred, centred)[..., None] / np.float32(x.shape[-1])
    return centred / np.sqrt(variance + _LAYER_NORM_EPS) * scale[0] + scale[1]


def _softmax(x: Array, axis: int = -1) -> Array:
    e = np.exp(x - x.max(axis, keepdims=True))
    return e / e.sum(axis, keepdims=True)


def _direction(x: Array, y: Array, lower: NDArray[np.floating], upper: NDArray[np.floating]) -> Array:
    """Zero directions (N, n, M) in normalized coordinates, as in `AllocatorNetwork`."""
    half = np.maximum(0.5 * (upper - lower)[:, 2], 1e-6)[:, None].astype(np.float32)
    middle = (0.5 * (upper + lower)[:, 2])[:, None].astype(np.float32)
    turn = np.float32(2 * np.pi)
    offset = np.mod(np.arctan2(y, x + np.float32(1e-6)) - middle + turn / 2, turn) - turn / 2
    return np.clip(offset, -half, half) / half
