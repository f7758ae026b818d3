"""Jets by networks over pairs of actuators, learned from forward data of other robots.

A network turns the features of a pair, or of an actuator and the hull, into one number for each
vector of the message; a receiver adds its messages up (Battaglia et al., 2018). Three networks,
trained apart, tell by how much they differ what they do not know.
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
from finlab.interaction.messages import FORMS, Pairs, hull_rows, unpacked

MEMBERS = 3
"""Networks of an ensemble, each trained from another start."""
LAYERS = 3
"""Layers of a network."""
NETWORK_SUFFIX = ".safetensors"
"""End of the name of a network's file."""
MAX_BYTES = 5_000_000
"""Largest file of a network [bytes]."""
WHAT = "a learned interaction (.safetensors)"
"""What a sentence calls such a file."""

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
    """The networks for one robot."""

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
        self._pairs = pairs = Pairs(geometry)
        self._among = np.eye(len(geometry.position))[:, pairs.receiver]
        """Which pairs (n, p) each actuator receives from."""
        self._has_hull = bool(geometry.hull[1].all())

    def at_rest(self, force: Array) -> Array:
        return np.asarray(self._each(force).mean(axis=0))

    def offset(self, force: Array, inflow: Array | None = None) -> Array:
        offset = np.asarray(np.einsum("...ib,ibw->...w", self.at_rest(force), self.lever))
        return offset if inflow is None else offset + self.by_core(force, inflow, False)[1]

    def effect(self, force: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        change, slope = self._slope_at_rest(force)
        offset = np.asarray(np.einsum("...ib,ibw->...w", change, self.lever))
        by_force = np.asarray(np.einsum("...jaib,ibw->...jaw", slope, self.lever))
        if inflow is None:
            return offset, by_force
        _, loss, loss_slope = self.by_core(force, inflow, True)
        return offset + loss, by_force + loss_slope

    def deviation(self, force: Array) -> Array:
        each = np.einsum("m...ib,ibw->m...w", self._each(force), self.lever)
        return np.asarray(self._trust * each.std(axis=0, ddof=1))

    def _each(self, force: Array) -> Array:
        """Changes (MEMBERS, ..., n, 3) [N] by each network."""
        pairs = self._pairs
        rows = pairs.rows(force[..., pairs.source, :], force[..., pairs.receiver, :])
        change = self._among @ self._messages("pair", rows)
        if not self._has_hull:
            return change
        return change + self._messages("hull", hull_rows(self.geometry, force))

    def _messages(self, name: str, rows: Array) -> Array:
        """Messages (MEMBERS, ..., p, 3) [N] of packed rows (..., p, m): the networks' numbers times
        the rows' vectors."""
        features, vectors = unpacked(name, rows)
        factors = numbers(self._weights, name, features)
        return np.asarray((factors[..., None] * vectors).sum(axis=-2))

    def _slope_at_rest(self, force: Array) -> tuple[Array, Array]:
        """Returns `at_rest`, and its derivatives (..., n, 3, n, 3) by the forces, these first."""
        n = force.shape[-2]
        pairs = self._pairs
        source = force[..., pairs.source, :]
        receiver = force[..., pairs.receiver, :]
        sent, by_source, by_receiver = self._slopes(
            "pair",
            (lambda varied: pairs.rows(varied, receiver), source),
            (lambda varied: pairs.rows(source, varied), receiver),
        )
        change = self._among @ sent
        by_own = np.einsum("np,...pab->...nab", self._among, by_receiver)
        if self._has_hull:
            hull_change, by_hull_force = self._slopes(
                "hull", (lambda varied: hull_rows(self.geometry, varied), force)
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
        """Messages (..., p, 3) [N], and their derivatives (..., p, 3, 3) by each of some forces
        (..., p, 3), given with the function that makes rows of them."""
        rows_and_slopes = [complex_slope(*variation) for variation in variations]
        features, vectors = unpacked(name, rows_and_slopes[0][0])
        number, factor_jacobian = numbers_and_slopes(self._weights, name, features)
        results = [(number[..., None] * vectors).sum(axis=-2)]
        for _, rows in rows_and_slopes:
            by_features, by_vectors = unpacked(name, rows)
            part = (by_features @ factor_jacobian.swapaxes(-1, -2)) @ vectors
            results.append(part + (number[..., None, :, None] * by_vectors).sum(axis=-2))
        return results


def _layers(weights: Weights, name: str, features: AnyArray) -> list[AnyArray]:
    """What each layer of the networks gives (MEMBERS, rows, width) for features (..., m), row by
    row."""
    flat: list[Any] = [features.reshape(-1, features.shape[-1])]
    for layer in range(LAYERS):
        sums = flat[-1] @ weights[f"{name}.{layer}.weight"] + weights[f"{name}.{layer}.bias"]
        flat.append(sums if layer == LAYERS - 1 else np.tanh(sums))
    return flat[1:]


def numbers(weights: Weights, name: str, features: AnyArray) -> AnyArray:
    """Returns what the networks give (MEMBERS, ..., k) for features (..., m)."""
    return _layers(weights, name, features)[-1].reshape(MEMBERS, *features.shape[:-1], -1)


def numbers_and_slopes(weights: Weights, name: str, features: Array) -> tuple[Array, Array]:
    """Returns the mean (..., k) of the same over the networks, and its derivatives (..., k, m)."""
    *hidden, last = _layers(weights, name, features)
    slope = weights[f"{name}.{LAYERS - 1}.weight"].swapaxes(1, 2)[
        :, None
    ]  # (MEMBERS, rows, k, width)
    for layer in reversed(range(LAYERS - 1)):
        slope = slope * (1.0 - hidden[layer] * hidden[layer])[:, :, None, :]
        rows = slope.shape[1]
        k = slope.shape[2]
        slope = slope.reshape(MEMBERS, rows * k, -1) @ weights[f"{name}.{layer}.weight"].swapaxes(
            1, 2
        )
        slope = slope.reshape(MEMBERS, rows, k, -1)
    number = last.mean(axis=0)
    shape = features.shape[:-1]
    return number.reshape(*shape, -1), slope.mean(axis=0).reshape(*shape, number.shape[-1], -1)


@lru_cache(maxsize=16)
def _cached_network(path: str, stamp: object) -> tuple[Weights, float]:
    """A network as it is read from its file; once for all robots that name it."""
    return read_network(path)


def read_network(path: str) -> tuple[Weights, float]:
    """Returns the weights in a file, and the `trust` of `LearnedInteraction`.

    Raises:
        CheckpointError: the file is missing, damaged or of another kind.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    content = read_named_file(path, MAX_BYTES, WHAT, CheckpointError)
    try:
        weights = {name: array.astype(np.float64) for name, array in load(content).items()}
        trust = float(weights.pop("trust")[0])
        for name, form in FORMS.items():
            for layer in range(LAYERS):
                width_in = (
                    form.features if layer == 0 else weights[f"{name}.{layer - 1}.weight"].shape[2]
                )
                weight, bias = (weights[f"{name}.{layer}.{kind}"] for kind in ("weight", "bias"))
                if weight.shape[:2] != (MEMBERS, width_in) or bias.shape != (
                    MEMBERS,
                    1,
                    weight.shape[2],
                ):
                    raise ValueError(f"{name}.{layer} has another shape")
            if weight.shape[2] != form.vectors:
                raise ValueError(f"{name} gives another number of vectors")
        if len(weights) != 2 * LAYERS * len(FORMS) or not all(
            np.isfinite(w).all() for w in weights.values()
        ):
            raise ValueError("it holds what no network has")
    except (SafetensorError, KeyError, IndexError, ValueError) as error:
        reason = str(error).splitlines()[0][:100]
        raise CheckpointError(
            f"{path}: no learned interaction ({reason}); see `finlab train interaction`"
        ) from None
    return weights, trust
