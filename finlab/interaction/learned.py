"""Jets by networks over pairs of actuators, learned from forward data of other robots.

A network turns the features of a pair, or of an actuator and the hull, into one factor for each
vector of the message; a receiver adds its messages up (Battaglia et al., 2018). Three networks,
trained apart, are an ensemble: where they differ, they do not know. Rows of features and vectors
are those of `finlab.interaction.messages`; `finlab.research.interaction` trains the networks.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, ClassVar

import numpy as np
from msgspec import Meta

from finlab.arrays import AnyArray, Array
from finlab.bundle_files import file_stamp, read_named_file
from finlab.errors import CheckpointError
from finlab.interaction.interaction import (
    InteractionModel,
    JetGeometry,
    PointInteraction,
    complex_slope,
    with_diagonal,
)
from finlab.interaction.messages import ROW_SIZES, JetPairs, pack_hull_rows, unpack_rows

MEMBERS = 3
"""Networks of the ensemble, each trained from another start."""
LAYERS = 3
"""Layers of a network: hidden ones with tanh, and a linear one."""
NETWORK_SUFFIX = ".safetensors"
"""End of the name of a network's file."""
MAX_NETWORK_BYTES = 5_000_000
"""Largest file of a network [bytes]."""
EXPECTED_NETWORK_FILE = "a learned interaction (.safetensors)"
"""What messages say was expected of a file that cannot be read."""

Weights = Mapping[str, AnyArray]
"""Arrays by name, `pair.0.weight` (MEMBERS, in, out) and `pair.0.bias` (MEMBERS, 1, out) to layer
2, and the same for `hull`."""


@dataclass(frozen=True)
class Learned(InteractionModel):
    """Model of the interaction by a network. Checked on construction.

    Args:
        path: file of the network, as `finlab train interaction` writes it; absolute once loaded
            from a layout file.
    """

    type: ClassVar[str] = "learned"

    path: Annotated[str, Meta(min_length=1, max_length=4096)]

    def of(self, geometry: JetGeometry) -> "LearnedInteraction":
        """Returns the interaction of a robot's actuators. Raises CheckpointError: the file holds no
        such network."""
        return LearnedInteraction(*_cached_network(self.path, file_stamp(self.path)), geometry)

    @property
    def reads(self) -> str:
        return self.path

    def reading(self, path: str) -> "Learned":
        return Learned(path)


class LearnedInteraction(PointInteraction):
    """The ensemble of networks for one robot."""

    def __init__(self, weights: Weights, trust: float, geometry: JetGeometry) -> None:
        """Prepares one robot.

        Args:
            weights: of the `MEMBERS` networks.
            trust: ratio of the networks' error to the standard deviation among them.
            geometry: points and jets of the n actuators, and the hull.
        """
        super().__init__(geometry)
        self._weights = weights
        self._trust = trust
        self._pairs = pairs = JetPairs(geometry)
        self._receives = np.eye(len(geometry.position))[:, pairs.receiver]
        """1 where an actuator is the receiver of a pair (n, p): sums messages over pairs."""
        self._has_hull = bool(geometry.hull[1].all())

    def at_rest(self, force: Array) -> Array:
        return np.asarray(self._by_network(force).mean(axis=0))

    def offset(self, force: Array, inflow: Array | None = None) -> Array:
        offset = np.asarray(np.einsum("...ib,ibw->...w", self.at_rest(force), self.lever))
        return offset if inflow is None else offset + self.compute_in_core(force, inflow, False)[1]

    def effect(self, force: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        change, slope = self._slope_at_rest(force)
        offset = np.asarray(np.einsum("...ib,ibw->...w", change, self.lever))
        by_force = np.asarray(np.einsum("...jaib,ibw->...jaw", slope, self.lever))
        if inflow is None:
            return offset, by_force
        _, loss, loss_slope = self.compute_in_core(force, inflow, True)
        return offset + loss, by_force + loss_slope

    def deviation(self, force: Array) -> Array:
        each = np.einsum("m...ib,ibw->m...w", self._by_network(force), self.lever)
        return np.asarray(self._trust * each.std(axis=0, ddof=1))

    def _by_network(self, force: Array) -> Array:
        """Further forces (MEMBERS, ..., n, 3) [N] by each network, body frame."""
        pairs = self._pairs
        rows = pairs.rows(force[..., pairs.source, :], force[..., pairs.receiver, :])
        change = self._receives @ self._messages_by_network("pair", rows)
        if not self._has_hull:
            return change
        return change + self._messages_by_network("hull", pack_hull_rows(self.geometry, force))

    def _messages_by_network(self, name: str, rows: Array) -> Array:
        """Messages (MEMBERS, ..., p, 3) [N] of packed rows (..., p, m): the networks' factors times
        the rows' vectors."""
        features, vectors = unpack_rows(name, rows)
        factors = ensemble_factors(self._weights, name, features)
        return np.asarray((factors[..., None] * vectors).sum(axis=-2))

    def _slope_at_rest(self, force: Array) -> tuple[Array, Array]:
        """`at_rest`, and its derivatives (..., n, 3, n, 3): by the force of the first axes, of the
        further force of the last ones."""
        n = force.shape[-2]
        pairs = self._pairs
        source = force[..., pairs.source, :]
        receiver = force[..., pairs.receiver, :]
        sent, by_source, by_receiver = self._slopes(
            "pair",
            (lambda varied: pairs.rows(varied, receiver), source),
            (lambda varied: pairs.rows(source, varied), receiver),
        )
        change = self._receives @ sent
        by_own = np.einsum("np,...pab->...nab", self._receives, by_receiver)
        if self._has_hull:
            hull_change, by_hull_force = self._slopes(
                "hull", (lambda varied: pack_hull_rows(self.geometry, varied), force)
            )
            change = change + hull_change
            by_own = by_own + by_hull_force
        slope = np.zeros((*force.shape[:-2], n * n, 3, 3))
        slope[..., pairs.source * n + pairs.receiver, :, :] = by_source
        slope = slope.reshape(*force.shape[:-2], n, n, 3, 3).swapaxes(-3, -2)
        return change, with_diagonal(slope, by_own)

    def _slopes(
        self, name: str, *variations: tuple[Callable[[AnyArray], Any], Array]
    ) -> list[Array]:
        """Mean messages of the networks, and their derivatives.

        Args:
            name: which networks and rows, `pair` or `hull`.
            variations: for each of the forces of a message that is varied, the function that makes
                packed rows of it, and its values (..., p, 3) [N].

        Returns:
            Messages (..., p, 3) [N], then for each variation their derivatives (..., p, 3, 3) by
            that force [1], these first.
        """
        rows_and_slopes = [complex_slope(*variation) for variation in variations]
        features, vectors = unpack_rows(name, rows_and_slopes[0][0])
        factors, factor_jacobian = mean_factors_and_jacobian(self._weights, name, features)
        results = [(factors[..., None] * vectors).sum(axis=-2)]
        for _, row_slopes in rows_and_slopes:
            feature_slopes, vector_slopes = unpack_rows(name, row_slopes)
            # Product rule of sum_k factor_k vector_k.
            by_factors = (feature_slopes @ factor_jacobian.swapaxes(-1, -2)) @ vectors
            by_vectors = (factors[..., None, :, None] * vector_slopes).sum(axis=-2)
            results.append(by_factors + by_vectors)
        return results


def _layer_outputs(weights: Weights, name: str, features: AnyArray) -> list[AnyArray]:
    """What each layer of the networks gives (MEMBERS, rows, width) for features (..., m), whose
    leading axes become rows."""
    outputs: list[AnyArray] = []
    inputs: Any = features.reshape(-1, features.shape[-1])
    for layer in range(LAYERS):
        sums = inputs @ weights[f"{name}.{layer}.weight"] + weights[f"{name}.{layer}.bias"]
        inputs = sums if layer == LAYERS - 1 else np.tanh(sums)
        outputs.append(inputs)
    return outputs


def ensemble_factors(weights: Weights, name: str, features: AnyArray) -> AnyArray:
    """Returns the factors of a message's vectors by each network.

    Args:
        weights: of the ensemble.
        name: which networks, `pair` or `hull`.
        features: features (..., m) of the messages.

    Returns:
        Factors (MEMBERS, ..., k) [1].
    """
    outputs = _layer_outputs(weights, name, features)
    return outputs[-1].reshape(MEMBERS, *features.shape[:-1], -1)


def mean_factors_and_jacobian(weights: Weights, name: str, features: Array) -> tuple[Array, Array]:
    """Returns the mean over the networks of the factors, and its Jacobian.

    Args:
        weights: of the ensemble.
        name: which networks, `pair` or `hull`.
        features: features (..., m) of the messages.

    Returns:
        Factors (..., k), and their derivatives (..., k, m) by the features [1].
    """
    *hidden, last = _layer_outputs(weights, name, features)
    # Backpropagation, for all k outputs at once; slope is (MEMBERS, rows, k, width).
    slope = weights[f"{name}.{LAYERS - 1}.weight"].swapaxes(1, 2)[:, None]
    for layer in reversed(range(LAYERS - 1)):
        # d tanh(a) / da = 1 - tanh(a)^2
        slope = slope * (1.0 - hidden[layer] * hidden[layer])[:, :, None, :]
        rows = slope.shape[1]
        k = slope.shape[2]
        transposed_weight = weights[f"{name}.{layer}.weight"].swapaxes(1, 2)
        slope = slope.reshape(MEMBERS, rows * k, -1) @ transposed_weight
        slope = slope.reshape(MEMBERS, rows, k, -1)
    factors = last.mean(axis=0)
    jacobian = slope.mean(axis=0)
    batch = features.shape[:-1]
    return factors.reshape(*batch, -1), jacobian.reshape(*batch, factors.shape[-1], -1)


@lru_cache(maxsize=16)
def _cached_network(path: str, stamp: object) -> tuple[Weights, float]:
    """As `read_network`; once for all robots that name the file, until its stamp changes."""
    return read_network(path)


def read_network(path: str) -> tuple[Weights, float]:
    """Returns the weights in a file, and the `trust` of `LearnedInteraction`.

    Raises:
        CheckpointError: the file is missing, damaged or of another kind.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    content = read_named_file(path, MAX_NETWORK_BYTES, EXPECTED_NETWORK_FILE, CheckpointError)
    try:
        weights = {name: array.astype(np.float64) for name, array in load(content).items()}
        trust = float(weights.pop("trust")[0])
        _check_weights(weights)
    except (SafetensorError, KeyError, IndexError, ValueError) as error:
        reason = str(error).splitlines()[0][:100]
        raise CheckpointError(
            f"{path}: no learned interaction ({reason}); see `finlab train interaction`"
        ) from None
    return weights, trust


def _check_weights(weights: Weights) -> None:
    """Refuses weights that are no ensemble. Raises ValueError: an array has another shape, there
    are others, or a weight is no finite number; KeyError, IndexError: one is missing."""
    for name, sizes in ROW_SIZES.items():
        width = sizes.features
        for layer in range(LAYERS):
            weight = weights[f"{name}.{layer}.weight"]
            bias = weights[f"{name}.{layer}.bias"]
            width_out = weight.shape[2]
            if weight.shape[:2] != (MEMBERS, width) or bias.shape != (MEMBERS, 1, width_out):
                raise ValueError(f"{name}.{layer} has another shape")
            width = width_out
        if width != sizes.vectors:
            raise ValueError(f"{name} gives another number of vectors")
    is_finite = all(np.isfinite(weight).all() for weight in weights.values())
    if len(weights) != 2 * LAYERS * len(ROW_SIZES) or not is_finite:
        raise ValueError("it holds what no network has")
