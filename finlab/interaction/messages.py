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

MIN_DIAMETER = 1e-3
"""Floor of the diameters and half axes by which is divided [m]."""


class Form(NamedTuple):
    """Contents of a packed row."""

    features: int
    """Number of features."""
    vectors: int
    """Number of vectors, of three components each."""


FORMS = {"pair": Form(11, 4), "hull": Form(6, 2)}
"""Rows of pairs of actuators, and of an actuator and the hull."""


class Pairs:
    """Pairs of a source with a jet and a receiver."""

    def __init__(self, geometry: JetGeometry) -> None:
        size = np.maximum(geometry.diameter, MIN_DIAMETER)
        self.source, self.receiver = np.nonzero(
            ~np.eye(len(size), dtype=bool) & (geometry.diameter > 0.0)[:, None]
        )
        """Indices (p,) of the two."""
        self._source_diameter = size[self.source]
        self._receiver_diameter = size[self.receiver]
        self._displacement = (
            geometry.position[self.receiver] - geometry.position[self.source]
        ) / self._source_diameter[:, None]

    def rows(self, source: AnyArray, receiver: AnyArray) -> Any:
        """Returns rows (..., p, 11 + 4 * 3) of forces (..., p, 3) [N] of the sources and of the
        receivers."""
        thrust, ahead, _ = jets_of(source, self._source_diameter)
        receiver_thrust, facing, _ = jets_of(receiver, self._receiver_diameter)
        along = -(self._displacement * ahead).sum(-1)
        radial = self._displacement + along[..., None] * ahead
        squared_radius = (radial * radial).sum(-1)
        radius = np.sqrt(squared_radius + 1e-4)
        outward = radial / radius[..., None]
        far_distance = np.sqrt(16.0 + along * along)
        features = [
            along / far_distance,
            4.0 / far_distance,
            np.tanh(2.0 * along),
            radius / np.sqrt(1.0 + squared_radius),
            np.exp(-squared_radius / (1.0 + 0.05 * along * along)),
            np.exp(-4.0 * squared_radius / (1.0 + 0.05 * along * along)),
            (ahead * facing).sum(-1),
            (outward * facing).sum(-1),
            (receiver_thrust - thrust) / (receiver_thrust + thrust),
            np.sqrt(thrust / (receiver_thrust + thrust)),
            np.log(self._receiver_diameter / self._source_diameter),
        ]
        window = (
            0.5
            * (1.0 + np.tanh(2.0 * along + 1.0))
            * np.exp(-squared_radius / (3.0 + 0.15 * along * along))
        )
        strength = (
            np.sqrt(thrust * (receiver_thrust + thrust))
            * window
            * (self._receiver_diameter / self._source_diameter)
        )
        return _packed(features, [ahead, facing, outward, _cross(ahead, outward)], strength)


def hull_rows(geometry: JetGeometry, force: AnyArray) -> Any:
    """Returns rows (..., n, 6 + 2 * 3) of actuators with forces (..., n, 3) [N] and the hull."""
    center = geometry.hull[0]
    half_axes = np.maximum(geometry.hull[1], MIN_DIAMETER)
    thrust, ahead, _ = jets_of(force, np.maximum(geometry.diameter, MIN_DIAMETER))
    position_scaled = (geometry.position - center) / half_axes
    direction_scaled = -ahead / half_axes
    towards = -(position_scaled * direction_scaled).sum(-1) / np.sqrt(
        (direction_scaled * direction_scaled).sum(-1) + 1e-9
    )
    squared_radius = (position_scaled * position_scaled).sum(-1)
    squared_offset = squared_radius - towards * towards  # of the axis from the centre
    normal = (
        position_scaled
        / half_axes
        / np.sqrt(((position_scaled / half_axes) ** 2).sum(-1, keepdims=True) + 1e-9)
    )
    features = [
        np.tanh(2.0 * (squared_offset - 1.0)),
        np.exp(-squared_offset),
        np.tanh(3.0 * towards),
        np.tanh(squared_radius - 1.0),
        (normal * ahead).sum(-1),
        np.tanh(2.0 * geometry.diameter / half_axes.mean()),
    ]
    return _packed(features, [ahead, normal], thrust)


def unpacked(name: str, rows: AnyArray) -> tuple[AnyArray, AnyArray]:
    """Returns features (..., m) and vectors (..., k, 3) [N] of packed rows."""
    m, k = FORMS[name]
    return rows[..., :m], rows[..., m:].reshape(*rows.shape[:-1], k, 3)


def _packed(features: list[Any], vectors: list[Any], strength: Any) -> Any:
    """Rows (..., m + 3 k) of m features (...,) and k vectors (..., 3), times a strength (...,)
    [N]."""
    vectors = [vector * strength[..., None] for vector in vectors]
    alike = np.broadcast_arrays(*features, strength)[:-1]
    return np.concatenate([np.stack(alike, axis=-1), *vectors], axis=-1)


def _cross(a: AnyArray, b: AnyArray) -> Any:
    """Cross products (..., 3), also of complex vectors."""
    next_axis = [1, 2, 0]
    after_next = [2, 0, 1]
    return a[..., next_axis] * b[..., after_next] - a[..., after_next] * b[..., next_axis]
