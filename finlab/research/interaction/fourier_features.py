"""A Gaussian process over messages, across robots, by random Fourier features.

With a kernel that is Gaussian in the features of a message, the factors of its vectors are
`sum_r w_r cos(a_r . x + b_r)`: frequencies a_r that are normal, phases b_r that are uniform
(Rahimi and Recht, 2007). The weights are then those of a ridge regression on the wrenches of many
robots, as `finlab.research.interaction.linear_prior` does with polynomials. It is there to be
compared with: it has no slopes in the core, and no samples of one robot change it.
"""

from collections.abc import Sequence

import numpy as np

from finlab.arrays import Array
from finlab.fit.interaction.samples import Samples, left_by_laws
from finlab.interaction.interaction import JetGeometry, lever_of
from finlab.interaction.messages import ROW_SIZES, Messages, unpack_rows
from finlab.layout.jet_geometry import jet_geometry_of

FREQUENCIES = {"pair": 320, "hull": 142}
"""Frequencies by kind of message: 1,706 weights in all."""
LENGTH = {"pair": 4.0, "hull": 3.0}
"""Length of the kernel, in standard deviations of the features."""
RIDGE = 1e-5
"""Penalty of the regression, over the mean square of the terms."""


class FourierFeatures:
    """Factors of messages by random Fourier features; their weights are learned."""

    def __init__(self, samples: Sequence[Samples], seed: int = 0) -> None:
        """Learns from samples of many robots at rest.

        Args:
            samples: of each robot.
            seed: of the frequencies.
        """
        rng = np.random.default_rng([34_000, seed])
        self._frequency = {}
        self._phase = {}
        self._unit = _deviations(samples)
        for kind, count in FREQUENCIES.items():
            drawn = rng.normal(size=(ROW_SIZES[kind].features, count))
            self._frequency[kind] = drawn / LENGTH[kind]
            self._phase[kind] = rng.uniform(0.0, 2.0 * np.pi, count)
        self._weights = self._learned(samples)

    def wrench_offset(self, geometry: JetGeometry, force: Array) -> Array:
        """Returns wrench offsets (K, 6) [N, N m] of forces (K, n, 3) [N], body frame."""
        return np.asarray(self._terms(geometry, force) @ self._weights)

    def _learned(self, samples: Sequence[Samples]) -> Array:
        """The weights of ridge regression."""
        gram: Array | float = 0.0
        moment: Array | float = 0.0
        for one in samples:
            force, missed, scale, _ = left_by_laws(one)
            terms = self._terms(jet_geometry_of(one.layout), force) / scale[:, None]
            rows = terms.reshape(-1, terms.shape[-1])
            gram = gram + rows.T @ rows
            moment = moment + rows.T @ missed.ravel()
        gram = np.asarray(gram)
        penalty = RIDGE * np.trace(gram) / len(gram) * np.eye(len(gram))
        return np.asarray(np.linalg.solve(gram + penalty, moment))

    def _terms(self, geometry: JetGeometry, force: Array) -> Array:
        """Wrenches (K, 6, w) of each term with a weight of 1."""
        messages = Messages(geometry)
        lever = lever_of(geometry.position)
        levers = {"pair": lever[messages.receiver], "hull": lever[: messages.counts["hull"]]}
        terms = []
        for kind, packed in messages.rows(force).items():
            features, vectors = unpack_rows(kind, packed)
            waves = (features / self._unit[kind]) @ self._frequency[kind] + self._phase[kind]
            wrench = vectors @ levers[kind]
            flat = wrench.reshape(*wrench.shape[:2], -1)
            products = flat.swapaxes(1, 2) @ np.cos(waves)
            by_axis = products.reshape(len(force), -1, 6, waves.shape[-1]).swapaxes(1, 2)
            terms.append(by_axis.reshape(len(force), 6, -1))
        return np.concatenate(terms, axis=-1)


def _deviations(samples: Sequence[Samples]) -> dict[str, Array]:
    """Standard deviations (f,) of the features of all messages, by kind; 1 of one that stays."""
    found: dict[str, list[Array]] = {kind: [] for kind in ROW_SIZES}
    for one in samples:
        rows = Messages(jet_geometry_of(one.layout)).rows(left_by_laws(one)[0])
        for kind, packed in rows.items():
            features = unpack_rows(kind, packed)[0]
            found[kind].append(features.reshape(-1, features.shape[-1]))
    result = {}
    for kind, parts in found.items():
        deviation = np.concatenate(parts).std(axis=0)
        result[kind] = np.where(deviation > 1e-9, deviation, 1.0)
    return result
