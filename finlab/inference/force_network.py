"""The network of method `mdn` in numpy, for a few targets at a time: no tensor library on a robot's computer.

A test holds it against `finlab.training.networks.force_network.ForceNetwork`, where the formulas are told.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray
from finlab.inference import layers

NODE_SIZE, PAIR_SIZE = 27, 4
"""Numbers of features of a fin and of a pair of fins."""
LEAK = 0.2
"""Slope of the leaky rectifier below zero."""
LOG_STD = (-2.0, 2.0)
"""Middle and half width of the range of the log standard deviations."""


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
        w = layers.single_precision(weights)
        self._enter = layers.linear(w, "enter")
        self._layers = [_Layer(w, name, heads) for name in layers.names_of_layers(w, "layers")]
        self._head, self._weight = (layers.linear(w, end).after_norm(w, "norm") for end in ("head", "weight"))

    def __call__(self, nodes: AnyArray, pairs: AnyArray) -> ForceMixture:
        """The mixture for fins (N, n, 27) and pairs (N, n, n, 4), in single precision."""
        rows, n, _ = nodes.shape
        hidden = self._enter(nodes.reshape(rows * n, -1))
        flat = pairs.reshape(-1, PAIR_SIZE)
        for layer in self._layers:
            layer(hidden, flat, rows)
        hidden = layers.normalized(hidden)
        everyone = np.add.reduce(hidden.reshape(rows, n, -1), axis=1)
        everyone /= np.float32(n)
        weight = layers.softmax(self._weight(everyone))
        raw = self._head(hidden).reshape(rows, n, -1, 3).swapaxes(1, 2)
        std = np.tanh(raw[..., 2])
        std *= np.float32(LOG_STD[1])
        std += np.float32(LOG_STD[0])
        return ForceMixture(weight, raw[..., 0] + 1j * raw[..., 1], np.exp(std, out=std))

    def attention(self, nodes: AnyArray, pairs: AnyArray) -> AnyArray:
        """Attention weights (N, n, n) of the first layer, averaged over heads: what it looks at."""
        rows, n, _ = nodes.shape
        hidden = self._enter(nodes.reshape(rows * n, -1))
        weight, _ = self._layers[0].look(hidden, pairs.reshape(-1, PAIR_SIZE), rows)
        return np.asarray(weight.mean(-1))


class _Layer:
    """One Transformer layer whose attention is GATv2's with features of pairs."""

    def __init__(self, w: dict[str, AnyArray], name: str, heads: int) -> None:
        look = f"{name}.look"
        self.both = layers.linear(w, f"{look}.source", f"{look}.target").after_norm(w, f"{name}.norm1")
        self.pair = w[f"{look}.pair.weight"].T.copy()
        self.score = layers.head_scores(w[f"{look}.attention"])
        self.heads, self.width = heads, len(self.score)
        self.out = layers.linear(w, f"{look}.out")
        self.feed_forward = layers.FeedForward(w, f"{name}.up", f"{name}.down", f"{name}.norm2")

    def look(self, x: AnyArray, pairs: AnyArray, rows: int) -> tuple[AnyArray, AnyArray]:
        """For features (N n, width) and pairs (N n n, 4): weights (N, n, n, heads) with which each fin looks
        at each, and what it sees (N, n, n, width)."""
        both = self.both(layers.normalized(x)).reshape(rows, -1, 2 * self.width)
        n = both.shape[1]
        hidden = pairs.dot(self.pair).reshape(rows, n, n, self.width)
        hidden += both[:, None, :, : self.width]
        hidden += both[:, :, None, self.width :]
        np.maximum(hidden, hidden * np.float32(LEAK), out=hidden)
        score = hidden.reshape(-1, self.width).dot(self.score).reshape(rows, n, n, self.heads)
        return layers.softmax(score, axis=2), hidden

    def __call__(self, x: AnyArray, pairs: AnyArray, rows: int) -> None:
        """Change hidden features (N n, width) in place."""
        weight, hidden = self.look(x, pairs, rows)
        n = weight.shape[1]
        split = hidden.reshape(rows * n, n, self.heads, -1).swapaxes(1, 2)
        message = np.matmul(weight.reshape(rows * n, n, self.heads).swapaxes(1, 2)[:, :, None], split)
        x += self.out(message.reshape(x.shape))
        self.feed_forward(x)
