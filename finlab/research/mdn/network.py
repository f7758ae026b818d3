"""The network of method `mdn`: fins and pairs of fins in, a joint mixture over the forces of all
fins out.

Transformer layers over the fins whose attention is GATv2's (Brody, Alon, Yahav, ICLR 2022) with
features of pairs: fin i scores leaky(source_j + target_i + pair_ij), and what it scores is also the
message.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from finlab.arrays import AnyArray, Values, library_of
from finlab.research.networks import layers
from finlab.research.networks.layers import Weights
from finlab.research.networks.trained import Shapes, check_sizes, linear_shapes, norm_shapes

NODE_SIZE = 26
"""Number of features of a fin."""
PAIR_SIZE = 4
"""Number of features of a pair of fins."""
LOG_STD = (-2.0, 2.0)
"""Middle and half width of the range of the log standard deviations."""


@dataclass(frozen=True)
class ForceNetworkConfig:
    """The network of method `mdn`: its sizes, the arrays that follow from them, and what it
    gives."""

    features: ClassVar[str] = "forces"
    """What it is fed, by its name in files."""
    joint: ClassVar[bool] = True
    """Whether one component is chosen for all fins together."""
    shipped: ClassVar[str] = "default"
    """What `finlab train` calls it."""
    width: int = 64
    """Width of every hidden layer."""
    heads: int = 4
    """Attention heads."""
    layers: int = 4
    """Number of Transformer layers."""
    feedforward: int = 128
    """Hidden width of their feed-forward blocks."""
    n_components: int = 16
    """Number M of mixture components."""

    def shapes(self) -> Shapes:
        """Shape of each array by name. Raises ValueError: there is no network of these sizes."""
        check_sizes(*vars(self).values(), heads=(self.width, self.heads))
        width = self.width
        m = self.n_components
        shapes = linear_shapes("enter", NODE_SIZE, width) | norm_shapes("norm", width)
        shapes |= linear_shapes("head", width, 3 * m) | linear_shapes("weight", width, m)
        for i in range(self.layers):
            name = f"layers.{i}"
            attention = f"layers.{i}.look"
            shapes |= {f"{attention}.attention": (self.heads, width // self.heads)}
            shapes |= {
                f"{attention}.target.weight": (width, width),
                f"{attention}.pair.weight": (width, PAIR_SIZE),
            }
            shapes |= linear_shapes(f"{attention}.source", width, width)
            shapes |= linear_shapes(f"{attention}.out", width, width)
            shapes |= linear_shapes(f"{name}.up", width, self.feedforward)
            shapes |= linear_shapes(f"{name}.down", self.feedforward, width)
            shapes |= norm_shapes(f"{name}.norm1", width) | norm_shapes(f"{name}.norm2", width)
        return shapes

    def __call__(self, w: Weights, nodes: Values, pairs: Values) -> "ForceMixture":
        """The mixture for fins (B, n, 26) and pairs (B, n, n, 4), with these weights."""
        hidden = layers.linear(w, "enter", nodes)
        for name in (f"layers.{i}" for i in range(self.layers)):
            normed = layers.layer_norm(w, f"{name}.norm1", hidden)
            attended = layers.graph_attention(w, f"{name}.look", normed, pairs)
            hidden = hidden + layers.linear(w, f"{name}.look.out", attended)
            normed = layers.layer_norm(w, f"{name}.norm2", hidden)
            hidden = hidden + layers.feed_forward(w, f"{name}.up", f"{name}.down", normed)
        hidden = layers.layer_norm(w, "norm", hidden)
        raw = layers.linear(w, "head", hidden)
        raw = raw.reshape(*raw.shape[:-1], self.n_components, 3)
        log_std = LOG_STD[0] + LOG_STD[1] * library_of(raw).tanh(raw[..., 2])
        return ForceMixture(layers.linear(w, "weight", hidden.mean(1)), raw[..., :2], log_std)


class ForceMixture(NamedTuple):
    """A mixture of M Gaussians over the forces of n fins together, for B targets.

    A force is given as the root of its share of the fin's largest one, in the fin's own frame.
    """

    logits: Values
    """Unnormalized log weights (B, M)."""
    mean: Values
    """(B, n, M, 2)."""
    log_std: Values
    """Of both components (B, n, M)."""

    def log_prob(self, way: Values, temper: float = 1.0) -> Values:
        """Returns log likelihoods (B, L): T log sum_m exp(log p_m / T).

        Args:
            way: L forces for each target, as roots of shares (B, L, n, 2).
            temper: T; above 1 several components may stand for one force.
        """
        deviation = way[:, :, :, None] - self.mean[:, None]  # (B, L, n, M, 2)
        scaled = (deviation * deviation).sum(-1) * library_of(way).exp(-2.0 * self.log_std)[:, None]
        normal = -0.5 * scaled - (2.0 * self.log_std + math.log(2.0 * math.pi))[:, None]
        by_component = layers.log_softmax(self.logits)[:, None] + normal.sum(2)  # (B, L, M)
        return temper * layers.log_sum_exp(by_component / temper)

    def complex_parts(self) -> tuple[AnyArray, AnyArray, AnyArray]:
        """Weights (B, M), means (B, M, n) as complex numbers, and standard deviations (B, M, n); of
        numpy arrays."""
        mean = (self.mean[..., 0] + 1j * self.mean[..., 1]).swapaxes(1, 2)
        return layers.softmax(self.logits), mean, np.exp(self.log_std).swapaxes(1, 2)
