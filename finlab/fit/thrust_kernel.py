"""How alike the forces of one fin are at two commands: the covariance of a Gaussian process."""

from typing import Any

import numpy as np
from sklearn.gaussian_process.kernels import Hyperparameter, Kernel

from finlab.arrays import Array

BOUNDS = {
    "even": (1e-3, 1e4),
    "uneven": (1e-7, 1e2),
    "amplitude": (0.15, 20.0),
    "frequency": (0.15, 20.0),
    "turn": (0.4, 30.0),
}
"""Ends between which each number of the kernel is fitted."""


class ThrustKernel(Kernel):  # type: ignore[misc]
    """Covariance of a force in the frame that turns with the zero direction.

    k = s s' E (even + uneven D), where s = A f makes the force vanish at rest and grow from there, E falls
    with the distance of amplitudes and of frequencies, and D with the angle between the zero directions, so
    that a fin which is the same all round needs no more data than one direction. E is Matern's with 5/2: a
    smoother one believes that it knows a fin which saturates better than it does. Inputs (n, 3) are amplitude
    and frequency over their largest values, and the zero direction [rad].
    """

    def __init__(
        self,
        even: float = 1.0,
        uneven: float = 0.05,
        amplitude: float = 1.0,
        frequency: float = 1.0,
        turn: float = 1.5,
    ) -> None:
        """Takes the variances of what is the same all round and of what is not, and three length scales."""
        self.even, self.uneven = even, uneven
        self.amplitude, self.frequency, self.turn = amplitude, frequency, turn

    # scikit-learn finds a kernel's numbers by these names and sorts them.
    hyperparameter_amplitude = property(lambda self: self._number("amplitude"))
    hyperparameter_even = property(lambda self: self._number("even"))
    hyperparameter_frequency = property(lambda self: self._number("frequency"))
    hyperparameter_turn = property(lambda self: self._number("turn"))
    hyperparameter_uneven = property(lambda self: self._number("uneven"))

    @staticmethod
    def _number(name: str) -> Hyperparameter:
        return Hyperparameter(name, "numeric", BOUNDS[name])

    def __call__(self, X: Array, Y: Array | None = None, eval_gradient: bool = False) -> Any:
        """Returns k (n, m), and with `eval_gradient` its derivatives (n, m, 5) by the logarithms."""
        other = X if Y is None else Y
        by_amplitude = ((X[:, None, 0] - other[None, :, 0]) / self.amplitude) ** 2
        by_frequency = ((X[:, None, 1] - other[None, :, 1]) / self.frequency) ** 2
        by_turn = 2.0 * (1.0 - np.cos(X[:, None, 2] - other[None, :, 2])) / self.turn**2
        distance = np.sqrt(5.0 * (by_amplitude + by_frequency))
        bare = np.multiply.outer(X[:, 0] * X[:, 1], other[:, 0] * other[:, 1]) * np.exp(-distance)
        near = bare * (1.0 + distance + distance**2 / 3.0)
        even, uneven = self.even * near, self.uneven * near * np.exp(-0.5 * by_turn)
        if not eval_gradient:
            return even + uneven
        by_scale = bare * (1.0 + distance) * (5.0 / 3.0) * (self.even + self.uneven * np.exp(-0.5 * by_turn))
        slopes = [by_scale * by_amplitude, even, by_scale * by_frequency, uneven * by_turn, uneven]
        return even + uneven, np.stack(slopes, axis=-1)

    def diag(self, X: Array) -> Array:
        """Returns the variances (n,) alone."""
        variance: Array = (X[:, 0] * X[:, 1]) ** 2 * (self.even + self.uneven)
        return variance

    def is_stationary(self) -> bool:
        """The variance grows with amplitude and frequency."""
        return False
