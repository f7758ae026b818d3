"""Two networks on the tokens of a robot, both after the paper: GATv2 layers on the complete graph
of actuators, and in the second one Transformer layers for each wrench.

- `HeadConfig`: the graph layers run once for a robot, and make a small head. It gives multipliers,
  for all wrenches in two products of matrices.
- `ForceConfig`: the graph layers run once, too; then each wrench joins the features, as in the
  paper, and Transformer layers give forces.
"""

from dataclasses import dataclass
from typing import NamedTuple

from finlab.arrays import Values, library_of
from finlab.research.distilled.actuator_tokens import TOKEN_SIZE
from finlab.research.networks import layers
from finlab.research.networks.layers import Weights
from finlab.research.networks.padding import Padding
from finlab.research.networks.trained import Shapes, check_sizes, linear_shapes, norm_shapes

ROOT_EPSILON = 1e-4
"""Added to the size of a unit's input, so that its root has a derivative at 0."""
FIRST_ROOT = 0.75
"""First weight of all units of an actuator together: that of a cost ~ T^1.5, where as many
actuators push as there are axes."""
OUTPUT_SCALE = 0.1
"""Of what networks add to what they begin with."""


class RobotBatch(NamedTuple):
    """R robots of up to m actuators, with T wrenches each."""

    token: Values
    """(R, m, TOKEN_SIZE)."""
    column: Values
    """(R, m, 2, 6), of `RobotTokens`."""
    root_stiffness: Values
    """(R, m), 1 for padding."""
    mask: Values
    """(R, m), True where there is an actuator."""
    wrench: Values
    """Whitened wrenches (R, T, 6)."""


def graph_shapes(width: int, heads: int, graph_layers: int) -> Shapes:
    """Returns the shapes of the arrays of the graph layers, and of what leads into them."""
    shapes = linear_shapes("enter", TOKEN_SIZE, width)
    for i in range(graph_layers):
        name = f"graph.{i}"
        shapes |= {f"{name}.attention": (heads, width // heads), f"{name}.bias": (width,)}
        shapes |= linear_shapes(f"{name}.source", width, width)
        shapes |= linear_shapes(f"{name}.target", width, width)
        shapes |= norm_shapes(f"{name}.norm", width)
    return shapes


def graph_features(w: Weights, graph_layers: int, token: Values, mask: Values) -> Values:
    """Returns features (R, m, width) of actuators, from tokens (R, m, TOKEN_SIZE), by the
    mask (R, m) of `RobotBatch`; those of padding mean nothing."""
    padding = None if bool(mask.all()) else Padding.of(mask)
    hidden = layers.linear(w, "enter", token if padding is None else padding.rows(token))
    for i in range(graph_layers):
        name = f"graph.{i}"
        normed = layers.layer_norm(w, f"{name}.norm", hidden)
        attended = layers.graph_attention(w, name, normed, padding=padding)
        hidden = hidden + layers.elu(attended)
    return hidden if padding is None else padding.padded(hidden)


class Head(NamedTuple):
    """A head of H units for each of m actuators. A unit is a vector of two numbers, as a plane's
    price is:

        v = U w',    l' = sum V v / sqrt(|v| + epsilon) + W v |v|
    """

    U: Values
    """(R, m, H, 2, 6)."""
    V: Values
    """Of roots (R, m, H, 2, 6): multipliers ~ |w|^(1/2), as of costs ~ T^1.5."""
    W: Values
    """Of squares (R, m, H, 2, 6): multipliers that rise steeply, as near limits."""

    def multipliers(self, wrench: Values) -> Values:
        """Returns whitened multipliers (R, T, 6) of whitened wrenches (R, T, 6)."""
        xp = library_of(wrench)
        robots = wrench.shape[0]
        U, V, W = (part.reshape(robots, -1, 6) for part in self)
        v = (wrench @ U.swapaxes(1, 2)).reshape(*wrench.shape[:2], -1, 2)
        size = xp.sqrt((v * v).sum(-1) + ROOT_EPSILON**2)[..., None]
        root = (v / xp.sqrt(size)).reshape(*wrench.shape[:2], -1)
        square = (v * size).reshape(*wrench.shape[:2], -1)
        return root @ V + square @ W


@dataclass(frozen=True)
class HeadConfig:
    """Sizes of the network that makes a head for a robot."""

    width: int = 64
    heads: int = 4
    graph_layers: int = 3
    units: int = 2
    """H, units of an actuator."""

    def shapes(self) -> Shapes:
        """Shape of each array by name. Raises ValueError: there is no network of these sizes."""
        check_sizes(*vars(self).values(), heads=(self.width, self.heads))
        shapes = graph_shapes(self.width, self.heads, self.graph_layers)
        return (
            shapes
            | norm_shapes("norm", self.width)
            | linear_shapes("head", self.width, 36 * self.units)
        )

    def head(self, w: Weights, batch: RobotBatch) -> Head:
        """Returns the heads of robots, whatever their wrenches are."""
        hidden = graph_features(w, self.graph_layers, batch.token, batch.mask)
        hidden = layers.layer_norm(w, "norm", hidden)
        raw = OUTPUT_SCALE * layers.linear(w, "head", hidden)
        raw = raw.reshape(*raw.shape[:2], self.units, 3, 2, 6)
        own = batch.column[:, :, None]
        root_stiffness = batch.root_stiffness[:, :, None, None, None]
        is_there = batch.mask[:, :, None, None, None]
        U = root_stiffness * (own + raw[..., 0, :, :]) * is_there
        V = (FIRST_ROOT / self.units * own + raw[..., 1, :, :]) / root_stiffness
        W = raw[..., 2, :, :] / root_stiffness
        return Head(U, V, W)


@dataclass(frozen=True)
class ForceConfig:
    """Sizes of the network that gives forces for each wrench."""

    width: int = 48
    heads: int = 4
    graph_layers: int = 2
    transformer_layers: int = 2

    def shapes(self) -> Shapes:
        """Shape of each array by name. Raises ValueError: there is no network of these sizes."""
        check_sizes(*vars(self).values(), heads=(self.width, self.heads))
        width = self.width
        shapes = graph_shapes(width, self.heads, self.graph_layers)
        # Beside the wrench a token reads its share of it by quadratic costs, two numbers.
        shapes |= linear_shapes("wrench", 6, width) | linear_shapes("share", 2, width)
        for i in range(self.transformer_layers):
            name = f"transformer.{i}"
            attention = f"{name}.self_attn"
            shapes |= {
                f"{attention}.in_proj_weight": (3 * width, width),
                f"{attention}.in_proj_bias": (3 * width,),
            }
            shapes |= linear_shapes(f"{attention}.out_proj", width, width)
            shapes |= linear_shapes(f"{name}.linear1", width, 2 * width)
            shapes |= linear_shapes(f"{name}.linear2", 2 * width, width)
            shapes |= norm_shapes(f"{name}.norm1", width) | norm_shapes(f"{name}.norm2", width)
        return shapes | norm_shapes("norm", width) | linear_shapes("force", width, 2)

    def shares(self, w: Weights, batch: RobotBatch) -> Values:
        """Returns forces over the largest ones (R, T, m, 2) for all wrenches of robots."""
        xp = library_of(batch.token)
        robots, wrenches = batch.wrench.shape[:2]
        count = batch.token.shape[1]
        hidden = graph_features(w, self.graph_layers, batch.token, batch.mask)
        by_quadratic_costs = _quadratic_shares(batch)
        joined = (
            hidden[:, None]
            + layers.linear(w, "wrench", batch.wrench)[:, :, None]
            + layers.linear(w, "share", by_quadratic_costs)
        )
        rows = joined.reshape(robots * wrenches, count, -1)
        mask = xp.broadcast_to(batch.mask[:, None], (robots, wrenches, count))
        rows = self._transformed(w, rows, mask.reshape(robots * wrenches, count))
        raw = OUTPUT_SCALE * layers.linear(w, "force", rows)
        return by_quadratic_costs + raw.reshape(by_quadratic_costs.shape)

    def _transformed(self, w: Weights, rows: Values, mask: Values) -> Values:
        """Features (B, m, width) after the Transformer layers, by a mask (B, m)."""
        padding = None if bool(mask.all()) else Padding.of(mask)
        hidden = rows if padding is None else padding.rows(rows)
        for i in range(self.transformer_layers):
            name = f"transformer.{i}"
            normed = layers.layer_norm(w, f"{name}.norm1", hidden)
            attention = f"{name}.self_attn"
            hidden = hidden + layers.self_attention(w, attention, self.heads, normed, padding)
            normed = layers.layer_norm(w, f"{name}.norm2", hidden)
            hidden = hidden + layers.feed_forward(w, f"{name}.linear1", f"{name}.linear2", normed)
        hidden = layers.layer_norm(w, "norm", hidden)
        return hidden if padding is None else padding.padded(hidden)


def _quadratic_shares(batch: RobotBatch) -> Values:
    """Forces over the largest ones (R, T, m, 2) of quadratic costs, sqrt(d_i) column_i w', those
    that are too large cut to 1."""
    xp = library_of(batch.wrench)
    robots, count = batch.column.shape[:2]
    columns = batch.column.reshape(robots, -1, 6).swapaxes(1, 2)
    shares = (batch.wrench @ columns).reshape(*batch.wrench.shape[:2], count, 2)
    shares = shares * batch.root_stiffness[:, None, :, None]
    size = xp.sqrt((shares * shares).sum(-1))[..., None]
    return shares / size.clip(1.0)
