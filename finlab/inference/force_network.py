"""The network of method `mdn` in numpy, for a few targets at a time: no tensor library on a robot's computer.

A test holds it against `finlab.training.networks.force_network.ForceNetwork`, where the formulas are told.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray
from finlab.inference.activations import softmax

NODE_SIZE, PAIR_SIZE = 27, 4
"""Numbers of features of a fin and of a pair of fins."""
LEAK = 0.2
"""Slope of the leaky rectifier below zero."""
LOG_STD = (-2.0, 2.0)
"""Middle and half width of the range of the log standard deviations."""
_EPS = np.float32(1e-5)


class ForceMixture(NamedTuple):
    """A mixture of M Gaussians over the forces of n fins together, for N targets.

    A force is told as the root of its share of the fin's largest one, in the fin's own frame, as a complex
    number.
    """

    weight: AnyArray
    """Weights of the components (N, M)."""
    mean: AnyArray
    """(N, M, n), complex."""
    std: AnyArray
    """Of both components (N, M, n)."""


class NumpyForceNetwork:
    """Features of fins and pairs in, a mixture over the forces of all fins out."""

    def __init__(self, weights: Mapping[str, NDArray[np.floating]], heads: int) -> None:
        """Take over a trained network: its state by PyTorch's names, and its number of heads."""
        w = {key: np.asarray(value, dtype=np.float32) for key, value in weights.items()}
        count = len({key.split(".")[1] for key in w if key.startswith("layers.")})
        self._enter = _linear(w, "enter")
        self._layers = [_Layer(w, f"layers.{i}", heads) for i in range(count)]
        self._head, self._weight = (_normed(_linear(w, name), w, "norm") for name in ("head", "weight"))

    def __call__(self, nodes: AnyArray, pairs: AnyArray) -> ForceMixture:
        """The mixture for fins (N, n, 27) and pairs (N, n, n, 4), in single precision."""
        rows, n, _ = nodes.shape
        hidden = _apply(self._enter, nodes.reshape(rows * n, -1))
        flat = pairs.reshape(-1, PAIR_SIZE)
        for layer in self._layers:
            layer(hidden, flat, rows)
        hidden = _norm(hidden)
        everyone = np.add.reduce(hidden.reshape(rows, n, -1), axis=1)
        everyone /= np.float32(n)
        weight = softmax(_apply(self._weight, everyone))
        raw = _apply(self._head, hidden).reshape(rows, n, -1, 3).swapaxes(1, 2)
        std = np.tanh(raw[..., 2])
        std *= np.float32(LOG_STD[1])
        std += np.float32(LOG_STD[0])
        return ForceMixture(weight, raw[..., 0] + 1j * raw[..., 1], np.exp(std, out=std))

    def attention(self, nodes: AnyArray, pairs: AnyArray) -> AnyArray:
        """Attention weights (N, n, n) of the first layer, averaged over heads: what it looks at."""
        rows, n, _ = nodes.shape
        hidden = _apply(self._enter, nodes.reshape(rows * n, -1))
        weight, _ = self._layers[0].look(hidden, pairs.reshape(-1, PAIR_SIZE), rows)
        return np.asarray(weight.mean(-1))


class _Layer:
    """One Transformer layer whose attention is GATv2's with features of pairs."""

    def __init__(self, w: dict[str, AnyArray], name: str, heads: int) -> None:
        both = (_linear(w, f"{name}.look.source"), (w[f"{name}.look.target.weight"].T, 0.0))
        joined = np.concatenate([part[0] for part in both], axis=1)
        bias = np.concatenate([both[0][1], np.zeros_like(both[0][1])])
        self.both = _normed((joined, bias), w, f"{name}.norm1")
        self.pair = w[f"{name}.look.pair.weight"].T.copy()
        attention = w[f"{name}.look.attention"]
        self.heads, self.width = heads, attention.size
        # Block form, so that one product scores all heads.
        self.score = np.zeros((attention.size, heads), dtype=np.float32)
        for head, part in enumerate(np.split(self.score, heads)):
            part[:, head] = attention[head]
        self.out = _linear(w, f"{name}.look.out")
        self.up = _normed(_linear(w, f"{name}.up"), w, f"{name}.norm2")
        self.down = _linear(w, f"{name}.down")

    def look(self, x: AnyArray, pairs: AnyArray, rows: int) -> tuple[AnyArray, AnyArray]:
        """For features (N n, width) and pairs (N n n, 4): weights (N, n, n, heads) with which each fin looks
        at each, and what it sees (N, n, n, width)."""
        both = _apply(self.both, _norm(x)).reshape(rows, -1, 2 * self.width)
        n = both.shape[1]
        hidden = pairs.dot(self.pair).reshape(rows, n, n, self.width)
        hidden += both[:, None, :, : self.width]
        hidden += both[:, :, None, self.width :]
        np.maximum(hidden, hidden * np.float32(LEAK), out=hidden)
        score = hidden.reshape(-1, self.width).dot(self.score).reshape(rows, n, n, self.heads)
        return softmax(score, axis=2), hidden

    def __call__(self, x: AnyArray, pairs: AnyArray, rows: int) -> None:
        """Change hidden features (N n, width) in place."""
        weight, hidden = self.look(x, pairs, rows)
        n = weight.shape[1]
        split = hidden.reshape(rows * n, n, self.heads, -1).swapaxes(1, 2)
        message = np.matmul(weight.reshape(rows * n, n, self.heads).swapaxes(1, 2)[:, :, None], split)
        x += _apply(self.out, message.reshape(x.shape))
        up = _apply(self.up, _norm(x))
        x += _apply(self.down, np.maximum(up, 0, out=up))


def _linear(w: dict[str, AnyArray], name: str) -> tuple[AnyArray, AnyArray]:
    return w[f"{name}.weight"].T.copy(), w[f"{name}.bias"]


def _apply(layer: tuple[AnyArray, AnyArray], x: AnyArray) -> AnyArray:
    # One product of two matrices is much faster than numpy's loop over stacked small ones.
    y: AnyArray = x.dot(layer[0])
    y += layer[1]
    return y


def _normed(layer: tuple[AnyArray, AnyArray], w: dict[str, AnyArray], name: str) -> tuple[AnyArray, AnyArray]:
    """A layer that also scales and shifts, as the layer normalization `name` before it does, and takes the
    mean away."""
    weight, bias = (part.astype(np.float64) for part in layer)
    scale, shift = w[f"{name}.weight"].astype(np.float64), w[f"{name}.bias"].astype(np.float64)
    bias = bias + shift @ weight
    weight = weight * scale[:, None]
    return weight.astype(np.float32), bias.astype(np.float32)


def _norm(x: AnyArray) -> AnyArray:
    """Layer normalization of features (R, width), without scale and shift."""
    normed = x - np.add.reduce(x, axis=1, keepdims=True) / np.float32(x.shape[1])
    square = np.einsum("ri,ri->r", normed, normed)
    square /= np.float32(x.shape[1])
    square += _EPS
    normed /= np.sqrt(square, out=square)[:, None]
    return normed
