"""The paper's trained network in numpy, for a few targets at a time.

A test holds it against `finlab.training.networks.allocator_network.AllocatorNetwork`.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray
from finlab.inference import layers
from finlab.inference.mixture import LOG_STD_BOUND, MixtureArrays


class NumpyNetwork:
    """Features and target in, a mixture per fin out."""

    def __init__(self, weights: Mapping[str, NDArray[np.floating]], heads: int, n_components: int) -> None:
        """Take over a trained network: its state by PyTorch's names, and its sizes as in `NetworkConfig`."""
        w = layers.single_precision(weights)
        self.n_components = n_components
        self.graph = [_Graph(w, name, heads) for name in layers.names_of_layers(w, "graph")]
        self.enter, self.wrench, self.join = (layers.linear(w, name) for name in ("enter", "wrench", "join"))
        names = layers.names_of_layers(w, "transformer.layers")
        self.transformer = [_Transformer(w, name, heads) for name in names]
        self.head, self.weight = (layers.linear(w, end).after_norm(w, "norm") for end in ("head", "weight"))

    def __call__(self, x: AnyArray, target: AnyArray) -> MixtureArrays:
        """The mixtures for node features (N, n, F) and normalized, centred targets (N, 6)."""
        rows, n, _ = x.shape
        hidden = self.enter(x.reshape(rows * n, -1))
        for graph in self.graph:
            hidden += layers.elu(graph(hidden, rows))
        wrench = self.wrench(target)
        # The layer that sees fins and wrench side by side, as a sum of two products.
        weight, bias = self.join
        width = hidden.shape[-1]
        wrench = wrench.dot(weight[width:])
        wrench += bias
        hidden = hidden.dot(weight[:width])
        hidden.reshape(rows, n, width)[...] += wrench[:, None]
        for layer in self.transformer:
            layer(hidden, rows)
        hidden = layers.normalized(hidden)
        raw = self.head(hidden).reshape(rows, n, self.n_components, -1)
        weight = layers.softmax(self.weight(hidden)).reshape(rows, n, self.n_components)
        return MixtureArrays(weight, raw[..., :3], _std(raw[..., 3:]))


class _Graph:
    """One dense GATv2 layer."""

    def __init__(self, w: dict[str, AnyArray], name: str, heads: int) -> None:
        self.both = layers.linear(w, f"{name}.source", f"{name}.target")
        self.score = layers.head_scores(w[f"{name}.attention"])
        self.heads, self.width = heads, len(self.score)
        self.bias = w[f"{name}.bias"]

    def __call__(self, x: AnyArray, rows: int) -> AnyArray:
        """Hidden features (N n, width) of features (N n, F) of N robots."""
        both = self.both(x).reshape(rows, -1, 2 * self.width)
        n = both.shape[1]
        source, target = both[..., : self.width], both[..., self.width :]
        pair = source[:, None] + target[:, :, None]
        leak = pair * np.float32(0.2)
        np.maximum(pair, leak, out=leak)
        score = leak.reshape(-1, self.width).dot(self.score).reshape(rows, n, n, self.heads)
        weight = layers.softmax(score, axis=2)
        split = source.reshape(rows, n, self.heads, -1).transpose(0, 2, 1, 3)
        seen = (weight.transpose(0, 3, 1, 2) @ split).transpose(0, 2, 1, 3)
        return np.asarray(seen.reshape(-1, self.width) + self.bias)


class _Transformer:
    """One Transformer encoder layer, normalization first, ReLU."""

    def __init__(self, w: dict[str, AnyArray], name: str, heads: int) -> None:
        attention = f"{name}.self_attn"
        weight, bias = w[f"{attention}.in_proj_weight"].T.copy(), w[f"{attention}.in_proj_bias"].copy()
        self.heads, self.depth = heads, len(weight) // heads
        for part in (weight, bias):
            part[..., : len(weight)] *= np.float32(self.depth**-0.5)
        self.qkv = layers.Linear(weight, bias).after_norm(w, f"{name}.norm1")
        self.out = layers.linear(w, f"{attention}.out_proj")
        self.feed_forward = layers.FeedForward(w, f"{name}.linear1", f"{name}.linear2", f"{name}.norm2")

    def __call__(self, x: AnyArray, rows: int) -> None:
        """Change hidden features (N n, width) of N robots in place."""
        qkv = self.qkv(layers.normalized(x)).reshape(rows, -1, 3, self.heads, self.depth)
        q, k, v = qkv.transpose(2, 0, 3, 1, 4)
        score = q @ k.swapaxes(-1, -2)
        seen = (layers.softmax(score) @ v).transpose(0, 2, 1, 3)
        x += self.out(seen.reshape(x.shape))
        self.feed_forward(x)


def _std(raw: AnyArray) -> AnyArray:
    """Standard deviations of the network's outputs: their logarithm is a sigmoid between the bounds, which
    are as far above zero as below."""
    out = np.multiply(raw, np.float32(0.5))
    np.tanh(out, out=out)
    out *= np.float32(LOG_STD_BOUND)
    return np.exp(out, out=out)
