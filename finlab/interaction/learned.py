"""Jets by networks over pairs of actuators, learned from forward data of other robots.

A network turns the features of a pair, or of an actuator and the hull, into one factor for each
vector of the message; a receiver adds its messages up (Battaglia et al., 2018). Three networks,
trained apart, are an ensemble: where they differ, they do not know. Rows of features and vectors
are those of `finlab.interaction.messages`; `finlab.research.interaction` trains the networks.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, ClassVar

import numpy as np
from msgspec import Meta

from finlab.arrays import AnyArray, Array
from finlab.bundle_files import file_stamp, read_named_file
from finlab.errors import CheckpointError
from finlab.interaction.interaction import InteractionModel, JetGeometry, PointInteraction
from finlab.interaction.messages import ROW_SIZES, Messages, unpack_rows

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
        self._networks = {kind: Networks(weights, kind) for kind in ROW_SIZES}
        self._trust = trust
        self._messages = messages = Messages(geometry)
        self._receives = np.eye(len(geometry.position))[:, messages.receiver]
        """1 where an actuator is the receiver of a pair (n, p): sums messages over pairs."""

    def at_rest(self, force: Array) -> Array:
        return np.asarray(self._by_network(force).mean(axis=0))

    def offset(self, force: Array, inflow: Array | None = None) -> Array:
        rows = self._messages.rows(force)
        factors = {
            kind: networks.mean_factors(unpack_rows(kind, rows[kind])[0])
            for kind, networks in self._networks.items()
        }
        offset = self._messages.wrench(rows, factors)
        return offset if inflow is None else offset + self.compute_in_core(force, inflow, False)[1]

    def effect(self, force: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        rows, slopes = self._messages.rows_and_slopes(force)
        factors = {}
        jacobians = {}
        for kind, networks in self._networks.items():
            features, _ = unpack_rows(kind, rows[kind])
            factors[kind], jacobians[kind] = networks.mean_factors_and_jacobian(features)
        offset, by_force = self._messages.wrench_and_slope(rows, slopes, factors, jacobians)
        if inflow is None:
            return offset, by_force
        _, loss, loss_slope = self.compute_in_core(force, inflow, True)
        return offset + loss, by_force + loss_slope

    def deviation(self, force: Array, inflow: Array | None = None) -> Array:
        each = np.einsum("m...ib,ibw->m...w", self._by_network(force), self.lever)
        return np.asarray(self._trust * each.std(axis=0, ddof=1))

    def _by_network(self, force: Array) -> Array:
        """Further forces (MEMBERS, ..., n, 3) [N] by each network, body frame."""
        rows = self._messages.rows(force)
        change: Array = self._receives @ self._messages_by_network("pair", rows["pair"])
        if self._messages.counts["hull"] == 0:
            return change
        return change + self._messages_by_network("hull", rows["hull"])

    def _messages_by_network(self, kind: str, rows: Array) -> Array:
        """Messages (MEMBERS, ..., m, 3) [N] of packed rows: the networks' factors times the rows'
        vectors."""
        features, vectors = unpack_rows(kind, rows)
        factors = self._networks[kind].factors(features)
        return np.asarray((factors[..., None] * vectors).sum(axis=-2))


class Networks:
    """The `MEMBERS` networks for one kind of message: from its features to the factors of its
    vectors."""

    def __init__(self, weights: Weights, kind: str) -> None:
        """Takes the weights of the ensemble.

        Args:
            weights: of the ensemble.
            kind: which networks, `pair` or `hull`.
        """
        weight = [np.ascontiguousarray(weights[f"{kind}.{k}.weight"]) for k in range(LAYERS)]
        bias = [weights[f"{kind}.{k}.bias"] for k in range(LAYERS)]
        self._hidden_layers = list(zip(weight[:-1], bias[:-1], strict=True))
        """Weights (MEMBERS, in, out) and biases (MEMBERS, 1, out) of the hidden layers."""
        self._last_weight = weight[-1]
        """(MEMBERS, width, k)."""
        self._last_bias = bias[-1]
        # What the mean over the networks and its derivatives are made of, once for all questions.
        self._mean_weight = weight[-1] / MEMBERS
        self._mean_bias = bias[-1].mean(axis=0)
        self._back_weight = [_transposed_single(each) for each in weight[:-1]]
        """Weights (MEMBERS, out, in) by which slopes are propagated back through hidden layers."""
        self._first_slope = _transposed_single(self._mean_weight)[:, None]
        """Derivatives (MEMBERS, 1, k, width) of the mean factors by the last hidden layer."""

    def factors(self, features: Array) -> Array:
        """Returns the factors by each network.

        Args:
            features: (..., f) of messages.

        Returns:
            (MEMBERS, ..., k) [1].
        """
        last_hidden = self._hidden_outputs(features)[-1]
        factors: Array = last_hidden @ self._last_weight + self._last_bias
        return factors.reshape(MEMBERS, *features.shape[:-1], -1)

    def mean_factors(self, features: Array) -> Array:
        """Returns the means over the networks of the factors (..., k) for features (..., f)."""
        return self._mean_of(self._hidden_outputs(features)[-1], features)

    def mean_factors_and_jacobian(self, features: Array) -> tuple[Array, Array]:
        """Returns the means over the networks of the factors, and their Jacobian.

        Args:
            features: (..., f) of messages.

        Returns:
            Factors (..., k), and their derivatives (..., k, f) by the features [1].
        """
        hidden = self._hidden_outputs(features)
        factors = self._mean_of(hidden[-1], features)
        # Backpropagation, for all k factors at once; slope is (MEMBERS, rows, k, width). In single
        # precision it takes half the time: what reads slopes are steps, which end at the values.
        rows = hidden[-1].shape[1]
        k = self._first_slope.shape[2]
        slope = self._first_slope
        for outputs, back_weight in zip(reversed(hidden), reversed(self._back_weight), strict=True):
            # d tanh(a) / da = 1 - tanh(a)^2
            outputs_single = outputs.astype(np.float32)
            slope_of_tanh = 1.0 - outputs_single * outputs_single
            slope = slope * slope_of_tanh[:, :, None]
            slope = (slope.reshape(MEMBERS, rows * k, -1) @ back_weight).reshape(
                MEMBERS, rows, k, -1
            )
        jacobian = slope.sum(axis=0).astype(np.float64)
        return factors, jacobian.reshape(*factors.shape, -1)

    def _hidden_outputs(self, features: Array) -> list[Array]:
        """What each hidden layer gives (MEMBERS, rows, width) for features (..., f), whose leading
        axes become rows."""
        outputs: list[Array] = []
        inputs = features.reshape(-1, features.shape[-1])
        for weight, bias in self._hidden_layers:
            sums = np.matmul(inputs, weight)
            sums += bias
            inputs = np.tanh(sums, out=sums)
            outputs.append(inputs)
        return outputs

    def _mean_of(self, last_hidden: Array, features: Array) -> Array:
        """The means (..., k) of the factors, by what the last hidden layer gives."""
        factors = (last_hidden @ self._mean_weight).sum(axis=0) + self._mean_bias
        return np.asarray(factors.reshape(*features.shape[:-1], -1))


def _transposed_single(weight: AnyArray) -> AnyArray:
    """Weights (MEMBERS, in, out) as (MEMBERS, out, in), in single precision."""
    return np.ascontiguousarray(weight.swapaxes(1, 2), np.float32)


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
