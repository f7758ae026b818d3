"""The paper's network: node features and a target wrench in, a mixture over each fin's commands
out.

GATv2 layers (Brody, Alon, Yahav, ICLR 2022) on complete graphs of fins, then Transformer layers,
then a mixture of diagonal Gaussians per fin. Graphs are small and complete, so that a dense form
with a mask serves in place of lists of edges. Commands are in coordinates in which every range of
limits is [-1, 1].
"""

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from finlab.arrays import Values, library_of
from finlab.layout.graph_file import COMMAND_SCALES, POSITION_SCALE
from finlab.research.networks import layers
from finlab.research.networks.layers import Weights
from finlab.research.networks.padding import Padding
from finlab.research.networks.trained import Shapes, check_sizes, linear_shapes, norm_shapes

RAW_SIZE = 10
"""Number of node features (paper: x_i in R^10)."""


def raw_features(position: Values, mounting_angle: Values, lower: Values, upper: Values) -> Values:
    """Returns the node features x_i (..., n, 10) of fins, scaled.

    Args:
        position: (..., n, 3) [m].
        mounting_angle: (..., n) [rad].
        lower: lower limits of commands (..., n, 3) [rad, Hz, rad].
        upper: upper ones (..., n, 3).
    """
    xp = library_of(position)
    limits = []
    for i, scale in enumerate(COMMAND_SCALES):
        limits.append(lower[..., i] / scale)
        limits.append(upper[..., i] / scale)
    angle = mounting_angle[..., None] / math.pi
    return xp.concatenate([position / POSITION_SCALE, angle, xp.stack(limits, axis=-1)], axis=-1)


LOG_STD_BOUND = 3.0
"""Largest size of the components' log standard deviation (paper, implementation details)."""


@dataclass(frozen=True)
class NetworkConfig:
    """The paper's network: its sizes, the arrays that follow from them, and what it gives with
    these."""

    features: ClassVar[str] = "raw"
    joint: ClassVar[bool] = False
    """Whether one component is chosen for all fins together."""
    shipped: ClassVar[str] = "paper"
    width: int = 128
    heads: int = 4
    graph_layers: int = 2
    transformer_layers: int = 3
    feedforward: int = 512
    """Hidden width of the Transformer's feed-forward blocks; not printed."""
    n_components: int = 8
    """Number M of mixture components."""

    def shapes(self) -> Shapes:
        """Shape of each array by name. Raises ValueError: there is no network of these sizes."""
        check_sizes(*vars(self).values(), heads=(self.width, self.heads))
        width = self.width
        m = self.n_components
        shapes = linear_shapes("enter", RAW_SIZE, width) | linear_shapes("wrench", 6, width)
        shapes |= linear_shapes("join", 2 * width, width)
        for name in self._named("graph", self.graph_layers):
            shapes |= {
                f"{name}.attention": (self.heads, width // self.heads),
                f"{name}.bias": (width,),
            }
            shapes |= linear_shapes(f"{name}.source", width, width)
            shapes |= linear_shapes(f"{name}.target", width, width)
        for name in self._named("transformer.layers", self.transformer_layers):
            attention = f"{name}.self_attn"
            shapes |= {
                f"{attention}.in_proj_weight": (3 * width, width),
                f"{attention}.in_proj_bias": (3 * width,),
            }
            shapes |= linear_shapes(f"{attention}.out_proj", width, width)
            shapes |= linear_shapes(f"{name}.linear1", width, self.feedforward)
            shapes |= linear_shapes(f"{name}.linear2", self.feedforward, width)
            shapes |= norm_shapes(f"{name}.norm1", width) | norm_shapes(f"{name}.norm2", width)
        return (
            shapes
            | norm_shapes("norm", width)
            | linear_shapes("head", width, 6 * m)
            | linear_shapes("weight", width, m)
        )

    def __call__(
        self, w: Weights, x: Values, target: Values, mask: Values | None = None
    ) -> "Mixture":
        """Returns the mixtures that a network gives.

        Args:
            w: its weights.
            x: node features (B, n, 10).
            target: normalized, centred targets (B, 6).
            mask: the padding mask (B, n) where robots have fewer than n fins, True where there is
                one: GATv2's edges keep to these, and so do the keys of self-attention.
        """
        return self.mixture(w, self.encoded(w, x, target, mask))

    def encoded(self, w: Weights, x: Values, target: Values, mask: Values | None = None) -> Values:
        """What the encoding phase makes of them: features (B, n, width) of each fin."""
        xp = library_of(x)
        padding = None if mask is None else Padding.of(mask)
        hidden = layers.linear(w, "enter", x if padding is None else padding.rows(x))
        for name in self._named("graph", self.graph_layers):
            attended = layers.graph_attention(w, name, hidden, padding=padding)
            hidden = hidden + layers.elu(attended)
        wrench = layers.linear(w, "wrench", target)
        if padding is None:
            wrench = xp.broadcast_to(wrench[:, None], (*hidden.shape[:-1], wrench.shape[-1]))
        else:
            wrench = padding.rows_of_robots(wrench)
        hidden = layers.linear(w, "join", xp.concatenate([hidden, wrench], -1))
        for name in self._named("transformer.layers", self.transformer_layers):
            attention = f"{name}.self_attn"
            normed = layers.layer_norm(w, f"{name}.norm1", hidden)
            hidden = hidden + layers.self_attention(w, attention, self.heads, normed, padding)
            normed = layers.layer_norm(w, f"{name}.norm2", hidden)
            hidden = hidden + layers.feed_forward(w, f"{name}.linear1", f"{name}.linear2", normed)
        hidden = layers.layer_norm(w, "norm", hidden)
        return hidden if padding is None else padding.padded(hidden)

    def mixture(self, w: Weights, hidden: Values) -> "Mixture":
        """The mixtures of fins with features (B, n, width)."""
        logits = layers.linear(w, "weight", hidden)
        raw = layers.linear(w, "head", hidden)
        raw = raw.reshape(*raw.shape[:-1], self.n_components, 6)
        log_std = LOG_STD_BOUND * library_of(raw).tanh(0.5 * raw[..., 3:])
        return Mixture(logits, raw[..., :3], log_std)

    @staticmethod
    def _named(kind: str, count: int) -> list[str]:
        return [f"{kind}.{i}" for i in range(count)]


class Mixture(NamedTuple):
    """Mixture of M diagonal Gaussians over the commands of each of n fins, for B robots or targets:
    Eq. 2."""

    logits: Values
    """Unnormalized log weights (B, n, M)."""
    mean: Values
    """Means (B, n, M, 3)."""
    log_std: Values
    """Log standard deviations (B, n, M, 3)."""

    def expected(self) -> Values:
        """Mean command (B, n, 3) of the whole mixture."""
        return (layers.softmax(self.logits)[..., None] * self.mean).sum(2)

    def log_prob(self, x: Values) -> Values:
        """Log likelihoods (B, K, n) of commands (B, K, n, 3); zero directions are numbers as in the
        paper, no angles."""
        xp = library_of(x)
        deviation = (x[:, :, :, None] - self.mean[:, None]) * xp.exp(-self.log_std)[:, None]
        log_normal = -(0.5 * deviation * deviation + self.log_std[:, None]).sum(-1)
        log_weight = layers.log_softmax(self.logits)[:, None] - 1.5 * math.log(2.0 * math.pi)
        return layers.log_sum_exp(log_weight + log_normal)

    def sample(self, uniform: Values, normal: Values, temperature: float = 1.0) -> Values:
        """Returns commands (B, K, n, 3): the weights are raised to the power 1/T, the Gaussians
        keep their deviations (Eq. 3).

        Args:
            uniform: numbers in [0, 1) that choose components (B, n, K).
            normal: standard normal numbers (B, n, K, 3).
            temperature: T, from 0.
        """
        weight = layers.softmax(layers.log_softmax(self.logits) * (1.0 / max(temperature, 1e-6)))
        cumulative = weight.cumsum(-1)[..., None, :-1]
        choice = (uniform[..., None] > cumulative).sum(-1)[..., None]
        mean = layers.take(self.mean, choice, 2)
        log_std = layers.take(self.log_std, choice, 2)
        return (mean + library_of(log_std).exp(log_std) * normal).swapaxes(1, 2)
