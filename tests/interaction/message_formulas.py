"""The features and vectors of messages once more, in numpy and for complex numbers: what the core
gives is held against them, and its slopes against imaginary steps (Squire and Trapp, 1998)."""

from collections.abc import Callable
from typing import Any

import numpy as np

from finlab.arrays import AnyArray, Array
from finlab.interaction.interaction import JetGeometry, jets_of

MIN_DIAMETER = 1e-3
SOFTENING = 1e-4
HULL_SOFTENING = 1e-9
GRAZING = 0.2
FAR = 4.0
IMAGINARY_STEP = 1e-30


class JetPairs:
    """All pairs of a source that has a jet, and a receiver, of one robot."""

    def __init__(self, geometry: JetGeometry) -> None:
        """Takes the points and jets of n actuators; p pairs of them have a source with a jet."""
        diameter = np.maximum(geometry.diameter, MIN_DIAMETER)
        has_jet = geometry.diameter > 0.0
        is_other = ~np.eye(len(diameter), dtype=bool)
        self.source, self.receiver = np.nonzero(is_other & has_jet[:, None])
        """Indices (p,) of the two actuators of each pair."""
        self._source_diameter = diameter[self.source]
        self._receiver_diameter = diameter[self.receiver]
        displacement = geometry.position[self.receiver] - geometry.position[self.source]
        self._displacement = displacement / self._source_diameter[:, None]
        """From source to receiver (p, 3), body frame, in diameters of the source [1]."""

    def rows(self, source: AnyArray, receiver: AnyArray) -> Any:
        """Returns packed rows of the pairs, real or complex.

        Args:
            source: forces (..., p, 3) of the sources, body frame [N].
            receiver: forces (..., p, 3) of the receivers, body frame [N].

        Returns:
            Rows (..., p, 11 + 4 * 3).
        """
        thrust, ahead, _ = jets_of(source, self._source_diameter)
        receiver_thrust, facing, _ = jets_of(receiver, self._receiver_diameter)
        # The receiver seen from the source: along the jet, which flows against the force, and off
        # its axis, in diameters of the source.
        along = -(self._displacement * ahead).sum(-1)
        radial = self._displacement + along[..., None] * ahead
        squared_radius = (radial * radial).sum(-1)
        radius = np.sqrt(squared_radius + SOFTENING)
        outward = radial / radius[..., None]
        distance = np.sqrt(FAR * FAR + along * along)
        squared_width = 1.0 + 0.05 * along * along  # of a jet that spreads
        diameter_ratio = self._receiver_diameter / self._source_diameter
        features = [
            along / distance,
            FAR / distance,
            np.tanh(2.0 * along),
            radius / np.sqrt(1.0 + squared_radius),
            np.exp(-squared_radius / squared_width),
            np.exp(-4.0 * squared_radius / squared_width),
            (ahead * facing).sum(-1),
            (outward * facing).sum(-1),
            (receiver_thrust - thrust) / (receiver_thrust + thrust),
            np.sqrt(thrust / (receiver_thrust + thrust)),
            np.log(diameter_ratio),
        ]
        # Messages fade out before the source, and away from the axis, whatever the networks give.
        onset = 0.5 * (1.0 + np.tanh(2.0 * along + 1.0))
        window = onset * np.exp(-squared_radius / (3.0 + 0.15 * along * along))
        strength = np.sqrt(thrust * (receiver_thrust + thrust)) * window * diameter_ratio
        return _pack_rows(features, [ahead, facing, outward, _cross(ahead, outward)], strength)


def pack_hull_rows(geometry: JetGeometry, force: AnyArray) -> Any:
    """Returns packed rows of actuators and the hull, real or complex.

    Args:
        geometry: points and jets of n actuators, and the hull.
        force: forces (..., n, 3), body frame [N].

    Returns:
        Rows (..., n, 7 + 3 * 3).
    """
    center = geometry.hull[0]
    half_axes = np.maximum(geometry.hull[1], MIN_DIAMETER)
    thrust, ahead, _ = jets_of(force, np.maximum(geometry.diameter, MIN_DIAMETER))
    # Coordinates in which the ellipsoid is the unit sphere.
    position = (geometry.position - center) / half_axes
    direction = -ahead / half_axes
    length = np.sqrt((direction * direction).sum(-1) + HULL_SOFTENING)
    towards = -(position * direction).sum(-1) / length
    squared_radius = (position * position).sum(-1)
    squared_offset = squared_radius - towards * towards  # of the jet's axis from the centre
    gradient = position / half_axes
    normal = gradient / np.sqrt((gradient**2).sum(-1, keepdims=True) + HULL_SOFTENING)
    # Where the jet meets the hull, or passes nearest: the depth below the surface is smoothed.
    below = 1.0 - squared_offset
    depth = np.sqrt(0.5 * (below + np.sqrt(below * below + GRAZING * GRAZING)))
    way = (towards - depth) / length
    gradient_met = (position + way[..., None] * direction) / half_axes
    size = np.sqrt((gradient_met * gradient_met).sum(-1) + HULL_SOFTENING)
    met = gradient_met / size[..., None]
    features = [
        np.tanh(2.0 * (squared_offset - 1.0)),
        np.exp(-squared_offset),
        np.tanh(3.0 * towards),
        np.tanh(squared_radius - 1.0),
        (normal * ahead).sum(-1),
        np.tanh(2.0 * geometry.diameter / half_axes.mean()),
        (met * ahead).sum(-1),
    ]
    return _pack_rows(features, [ahead, normal, met], thrust)


def _pack_rows(features: list[Any], vectors: list[Any], strength: Any) -> Any:
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


def complex_slope(function: Callable[[AnyArray], Any], values: Array) -> tuple[Array, Array]:
    """Returns the values of a smooth function and its derivatives, by imaginary steps.

    f'(x) = Im f(x + i h) / h, exact to rounding for a tiny h (Squire and Trapp, 1998).

    Args:
        function: from vectors (..., n, k) to an array (..., n, m), each row of which depends on one
            of them; it takes complex numbers.
        values: vectors (..., n, k).

    Returns:
        Values (..., n, m) and derivatives (..., n, k, m).
    """
    k = values.shape[-1]
    steps = np.eye(k).reshape(k, *(1,) * (values.ndim - 1), k) * (1j * IMAGINARY_STEP)
    result = function(values + steps)
    return result[0].real, np.moveaxis(result.imag, 0, -2) / IMAGINARY_STEP
