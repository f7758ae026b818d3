"""How alike the forces of one fin are at two commands: the covariance of a Gaussian process."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array


class ThrustKernel(NamedTuple):
    """Covariance of a force in the frame that turns with the zero direction.

    k = s s' E (even + uneven D), where s = A f makes the force vanish at rest and grow from there, E falls
    with the distance of amplitudes and of frequencies, and D with the angle between the zero directions, so
    that a fin which is the same all round needs no more data than one direction. E is Matern's with 5/2: a
    smoother one believes that it knows a fin which saturates better than it does. Inputs (n, 3) are amplitude
    and frequency over their largest values, and the zero direction [rad].
    """

    even: float = 1.0
    uneven: float = 0.05
    amplitude: float = 1.0
    """Length scale of amplitudes over the largest one."""
    frequency: float = 1.0
    """Length scale of frequencies over the largest one."""
    turn: float = 1.5
    """Length scale of zero directions [rad]."""

    def covariance(self, inputs: Array, others: Array) -> Array:
        """Returns k (n, m) between inputs (n, 3) and others (m, 3)."""
        return Pairs(inputs, others).covariance(self)[0]

    def variance(self, inputs: Array) -> Array:
        """Returns the variances (n,) at inputs (n, 3)."""
        return np.asarray((inputs[:, 0] * inputs[:, 1]) ** 2 * (self.even + self.uneven))


BOUNDS = ((1e-3, 1e4), (1e-7, 1e2), (0.15, 20.0), (0.15, 20.0), (0.4, 30.0))
"""Ends between which each number of the kernel is fitted."""


class Pairs:
    """Pairs of inputs (n, 3) and others (m, 3), which many kernels are asked about."""

    def __init__(self, inputs: Array, others: Array) -> None:
        self._grown = np.multiply.outer(inputs[:, 0] * inputs[:, 1], others[:, 0] * others[:, 1])
        amplitude, frequency, turn = (inputs[:, None, k] - others[None, :, k] for k in range(3))
        self._apart = amplitude**2, frequency**2, 2.0 * (1.0 - np.cos(turn))

    def covariance(self, kernel: ThrustKernel) -> tuple[Array, Callable[[Array], Array]]:
        """Returns k (n, m), and a function from weights (n, m) to the derivatives (5,) of the sum of weights
        times k by the logarithms of the kernel's numbers."""
        scales = kernel.amplitude, kernel.frequency, kernel.turn
        a, f, phi = (apart / scale**2 for apart, scale in zip(self._apart, scales, strict=True))
        distance = np.sqrt(5.0 * (a + f))
        bare = self._grown * np.exp(-distance)
        near = bare * (1.0 + distance + distance**2 / 3.0)
        uneven = kernel.uneven * np.exp(-0.5 * phi)
        share = kernel.even + uneven

        def gradient(weights: Array) -> Array:
            by_near = weights * near
            by_distance = weights * bare * (1.0 + distance) * (5.0 / 3.0) * share
            by_uneven = by_near * uneven
            sums = by_near.sum() * kernel.even, by_uneven.sum(), np.vdot(by_distance, a)
            return np.array([*sums, np.vdot(by_distance, f), np.vdot(by_uneven, phi)])

        return near * share, gradient
