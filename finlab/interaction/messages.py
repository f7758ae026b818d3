"""Features and vectors of the messages between actuators, and between an actuator and the hull; the
networks of `finlab.interaction.learned` read them.

The choice of frame matters: features are invariants in the frame of a source's jet (distances along
and across it in diameters, cosines, ratios), and a message is a sum of vectors along the pair's own
directions. So one network serves robots of any number of actuators. Rows are packed: the features,
then the vectors.
"""

from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import AnyArray
from finlab.interaction.interaction import JetGeometry, jets_of

LEAST = 1e-3
"""Diameter [m] and half axis [m] below which nothing is divided by them."""


class Form(NamedTuple):
    """How many numbers a packed row holds."""

    features: int
    vectors: int


FORMS = {"pair": Form(11, 4), "hull": Form(6, 2)}


class Pairs:
    """Pairs of a source with a jet and a receiver."""

    def __init__(self, geometry: JetGeometry) -> None:
        size = np.maximum(geometry.diameter, LEAST)
        self.source, self.receiver = np.nonzero(
            ~np.eye(len(size), dtype=bool) & (geometry.diameter > 0.0)[:, None]
        )
        """Indices (p,) of the two."""
        self._size = size[self.source]
        self._own = size[self.receiver]
        self._way = (
            geometry.position[self.receiver] - geometry.position[self.source]
        ) / self._size[:, None]

    def rows(self, source: AnyArray, receiver: AnyArray) -> Any:
        """Returns rows (..., p, 11 + 4 * 3) of forces (..., p, 3) [N] of the sources and of the
        receivers."""
        thrust, ahead, _ = jets_of(source, self._size)
        own, facing, _ = jets_of(receiver, self._own)
        along = -(self._way * ahead).sum(-1)
        aside = self._way + along[..., None] * ahead
        squared = (aside * aside).sum(-1)
        beside = np.sqrt(squared + 1e-4)
        outward = aside / beside[..., None]
        far = np.sqrt(16.0 + along * along)
        features = [
            along / far,
            4.0 / far,
            np.tanh(2.0 * along),
            beside / np.sqrt(1.0 + squared),
            np.exp(-squared / (1.0 + 0.05 * along * along)),
            np.exp(-4.0 * squared / (1.0 + 0.05 * along * along)),
            (ahead * facing).sum(-1),
            (outward * facing).sum(-1),
            (own - thrust) / (own + thrust),
            np.sqrt(thrust / (own + thrust)),
            np.log(self._own / self._size),
        ]
        window = (
            0.5
            * (1.0 + np.tanh(2.0 * along + 1.0))
            * np.exp(-squared / (3.0 + 0.15 * along * along))
        )
        strength = np.sqrt(thrust * (own + thrust)) * window * (self._own / self._size)
        return _packed(features, [ahead, facing, outward, _cross(ahead, outward)], strength)


def hull_rows(geometry: JetGeometry, force: AnyArray) -> Any:
    """Returns rows (..., n, 6 + 2 * 3) of actuators with forces (..., n, 3) [N] and the hull."""
    center = geometry.hull[0]
    half = np.maximum(geometry.hull[1], LEAST)
    thrust, ahead, _ = jets_of(force, np.maximum(geometry.diameter, LEAST))
    place = (geometry.position - center) / half
    course = -ahead / half
    towards = -(place * course).sum(-1) / np.sqrt((course * course).sum(-1) + 1e-9)
    squared = (place * place).sum(-1)
    beside = squared - towards * towards
    normal = place / half / np.sqrt(((place / half) ** 2).sum(-1, keepdims=True) + 1e-9)
    features = [
        np.tanh(2.0 * (beside - 1.0)),
        np.exp(-beside),
        np.tanh(3.0 * towards),
        np.tanh(squared - 1.0),
        (normal * ahead).sum(-1),
        np.tanh(2.0 * geometry.diameter / half.mean()),
    ]
    return _packed(features, [ahead, normal], thrust)


def unpacked(name: str, rows: AnyArray) -> tuple[AnyArray, AnyArray]:
    """Returns features (..., m) and vectors (..., k, 3) [N] of packed rows."""
    m, k = FORMS[name]
    return rows[..., :m], rows[..., m:].reshape(*rows.shape[:-1], k, 3)


def _packed(features: list[Any], vectors: list[Any], strength: Any) -> Any:
    vectors = [vector * strength[..., None] for vector in vectors]
    alike = np.broadcast_arrays(*features, strength)[:-1]
    return np.concatenate([np.stack(alike, axis=-1), *vectors], axis=-1)


def _cross(a: AnyArray, b: AnyArray) -> Any:
    one = [1, 2, 0]
    two = [2, 0, 1]
    return a[..., one] * b[..., two] - a[..., two] * b[..., one]
