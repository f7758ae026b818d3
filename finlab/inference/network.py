"""The paper's trained network in numpy, for a few targets at a time.

A network this small spends most of its time on the overhead of each tensor operation; numpy's is a
few times smaller than a tensor library's, and a robot's computer need not have one. A test holds it
against `finlab.training.networks.allocator_network.AllocatorNetwork`.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray
from finlab.inference.activations import elu, silu, softmax
from finlab.inference.mixture import LOG_STD_BOUND, MixtureArrays

_LAYER_NORM_EPS = np.float32(1e-5)
_LOG_STD_BOUND = np.float32(LOG_STD_BOUND)


class NumpyNetwork:
    """Features and target in, a mixture per fin out."""

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
        self.join = _centred(_linear(w, "join"))
        self.transformer = [_Transformer(w, f"transformer.layers.{i}", heads) for i in range(n_transformer)]
        self.head, self.weight = (_normed(_linear(w, name), w, "norm") for name in ("head", "weight"))

    def __call__(self, x: AnyArray, target: AnyArray) -> MixtureArrays:
        """The mixtures for node features (N, n, F) and normalized, centred targets (N, 6)."""
        rows, n, _ = x.shape
        flat = x.reshape(rows * n, -1)
        hidden = flat
        for graph in self.graph:
            hidden = elu(graph(hidden, rows))
        hidden += _apply(self.skip, flat)
        wrench = _apply(self.wrench[1], silu(_apply(self.wrench[0], target)))
        weight, bias = self.join
        width = hidden.shape[-1]
        wrench = wrench.dot(weight[width:])
        wrench += bias
        hidden = hidden.dot(weight[:width])
        hidden.reshape(rows, n, width)[...] += wrench[:, None]
        for layer in self.transformer:
            hidden = layer(hidden, rows)
        hidden = _norm(hidden)
        raw = _apply(self.head, hidden).reshape(rows, n, self.n_components, -1)
        weight = softmax(_apply(self.weight, hidden)).reshape(rows, n, self.n_components)
        return MixtureArrays(weight, raw[..., :3], _std(raw[..., 3:]))


class _Graph:
    """One dense GATv2 layer."""

    def __init__(self, w: dict[str, AnyArray], name: str, heads: int) -> None:
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

    def __call__(self, x: AnyArray, rows: int) -> AnyArray:
        """Hidden features (N n, width) of features (N n, F) of N robots."""
        both = _apply(self.both, x).reshape(rows, -1, 2 * self.width)
        n = both.shape[1]
        source, target = both[..., : self.width], both[..., self.width :]
        pair = source[:, None] + target[:, :, None]
        leak = pair * np.float32(0.2)
        np.maximum(pair, leak, out=leak)
        score = leak.reshape(-1, self.width).dot(self.score).reshape(rows, n, n, self.heads)
        weight = softmax(score, axis=2)
        split = source.reshape(rows, n, self.heads, -1).transpose(0, 2, 1, 3)
        out = np.empty((rows, n, self.heads, split.shape[-1]), dtype=np.float32)
        np.matmul(weight.transpose(0, 3, 1, 2), split, out=out.transpose(0, 2, 1, 3))
        flat = out.reshape(-1, self.width)
        flat += self.bias
        return flat


class _Transformer:
    """One Transformer encoder layer, normalization first, ReLU."""

    def __init__(self, w: dict[str, AnyArray], name: str, heads: int) -> None:
        self.heads = heads
        self.depth = len(w[f"{name}.self_attn.out_proj.bias"]) // heads
        qkv = w[f"{name}.self_attn.in_proj_weight"].T.copy(), w[f"{name}.self_attn.in_proj_bias"].copy()
        for part in qkv:
            part[..., : heads * self.depth] *= np.float32(self.depth**-0.5)
        self.qkv = _normed(qkv, w, f"{name}.norm1")
        self.out = _centred(_linear(w, f"{name}.self_attn.out_proj"))
        self.up = _normed(_linear(w, f"{name}.linear1"), w, f"{name}.norm2")
        self.down = _centred(_linear(w, f"{name}.linear2"))

    def __call__(self, x: AnyArray, rows: int) -> AnyArray:
        """Hidden features (N n, width) of hidden features (N n, width) of N robots, which are overwritten."""
        qkv = _apply(self.qkv, _norm(x)).reshape(rows, -1, 3, self.heads, self.depth)
        q, k, v = qkv.transpose(2, 0, 3, 1, 4)
        score = q @ k.swapaxes(-1, -2)
        attended = np.empty((rows, qkv.shape[1], self.heads, self.depth), dtype=np.float32)
        np.matmul(softmax(score), v, out=attended.transpose(0, 2, 1, 3))
        x += _apply(self.out, attended.reshape(x.shape))
        up = _apply(self.up, _norm(x))
        x += _apply(self.down, np.maximum(up, 0, out=up))
        return x


def _linear(w: dict[str, AnyArray], name: str) -> tuple[AnyArray, AnyArray]:
    return w[f"{name}.weight"].T.copy(), w[f"{name}.bias"]


def _apply(layer: tuple[AnyArray, AnyArray], x: AnyArray) -> AnyArray:
    # One product of two matrices is much faster than numpy's loop over stacked small ones.
    y: AnyArray = x.dot(layer[0])
    y += layer[1]
    return y


def _centred(layer: tuple[AnyArray, AnyArray]) -> tuple[AnyArray, AnyArray]:
    """A layer whose outputs have mean 0.

    What adds to the hidden features is only ever seen through a normalization, which takes the mean away; so
    it may as well not be there, and the normalization saves its first steps.
    """
    weight, bias = (part.astype(np.float64) for part in layer)
    weight -= weight.mean(-1, keepdims=True)
    bias -= bias.mean()
    return weight.astype(np.float32), bias.astype(np.float32)


def _normed(layer: tuple[AnyArray, AnyArray], w: dict[str, AnyArray], name: str) -> tuple[AnyArray, AnyArray]:
    """A layer that also scales and shifts, as the layer normalization `name` before it does."""
    weight, bias = (part.astype(np.float64) for part in layer)
    scale, shift = w[f"{name}.weight"].astype(np.float64), w[f"{name}.bias"].astype(np.float64)
    bias = bias + shift @ weight
    weight = weight * (scale * np.sqrt(len(scale)))[:, None]
    return weight.astype(np.float32), bias.astype(np.float32)


def _norm(x: AnyArray) -> AnyArray:
    """Layer normalization of features (R, width) of mean 0; divided by the root of the width."""
    square = np.einsum("ri,ri->r", x, x)
    square += np.float32(x.shape[-1]) * _LAYER_NORM_EPS
    normed: AnyArray = x / np.sqrt(square, out=square)[:, None]
    return normed


def _std(raw: AnyArray) -> AnyArray:
    """Standard deviations of the network's outputs: their logarithm is a sigmoid between the bounds, which
    are as far above zero as below."""
    out = np.multiply(raw, np.float32(0.5))
    np.tanh(out, out=out)
    out *= _LOG_STD_BOUND
    return np.exp(out, out=out)
