"""Mixtures of Gaussians over fin commands, in coordinates where every limit range is [-1, 1]. numpy only.

Training has the same in PyTorch, `Mixture`; a test holds the two against each other.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

LOG_STD_BOUND = 3.0
"""Largest size of the components' log standard deviation (paper, implementation details)."""


class MixtureArrays(NamedTuple):
    """A mixture of M diagonal Gaussians over the commands of n fins, for N targets."""

    weight: Array
    """Weights of the components: (N, M) of a joint mixture, (N, n, M) where each fin has its own."""
    mean: Array
    """Means (N, n, M, 3)."""
    std: Array
    """Standard deviations (N, n, M, 3)."""

    @property
    def joint(self) -> bool:
        """Whether one component is chosen for all fins together."""
        return self.weight.ndim == 2

    def expected(self) -> Array:
        """Mean command (N, n, 3) of the whole mixture."""
        weight = self.weight[:, None] if self.joint else self.weight
        return np.asarray((weight[..., None] * self.mean).sum(2))

    def tempered(self, temperature: float, uniform: Array, normal: Array) -> Array:
        """Commands (N, K, n, 3) drawn at a temperature T: weights to the power 1/T, variances times T.

        Args:
            temperature: T, from 0; 1 draws from the mixture itself.
            uniform: numbers in [0, 1), (N, K) for a joint mixture, else (N, n, K); they choose components.
            normal: standard normal numbers (N, n, K, 3).
        """
        m = self.weight.shape[-1]
        with np.errstate(divide="ignore"):
            sharp = np.log(self.weight) / np.float32(max(temperature, 1e-6))
        cumulative = np.exp(sharp - sharp.max(-1, keepdims=True)).cumsum(-1)
        cumulative /= cumulative[..., -1:]
        choice = np.minimum((uniform[..., None] > cumulative[..., None, :]).sum(-1), m - 1)
        choice = np.broadcast_to(choice[:, None] if self.joint else choice, normal.shape[:-1])[..., None]
        mean, std = (np.take_along_axis(part, choice, axis=2) for part in (self.mean, self.std))
        return np.asarray((mean + np.float32(math.sqrt(temperature)) * std * normal).swapaxes(1, 2))

    def log_likelihood(self, x: Array, turns_fully: NDArray[np.bool_]) -> Array:
        """Log likelihood (N, K) of commands x (N, K, n, 3).

        A joint mixture takes the zero direction of fins that turn fully (n,) for an angle; in the paper each
        fin's own mixture knows no angles.
        """
        deviation = x[:, :, :, None] - self.mean[:, None]  # (N, K, n, M, 3)
        if self.joint:
            direction = deviation[..., 2]
            turned = np.mod(direction + np.float32(1.0), np.float32(2.0)) - np.float32(1.0)
            deviation[..., 2] = np.where(turns_fully[:, None], turned, direction)
        deviation /= self.std[:, None]
        log_normal = -(0.5 * deviation * deviation + np.log(self.std)[:, None]).sum(-1)
        log_normal -= np.float32(1.5 * math.log(2.0 * math.pi))
        with np.errstate(divide="ignore"):
            log_weight = np.log(self.weight)[:, None]
        if self.joint:
            return _log_sum_exp(log_weight + log_normal.sum(2))
        return np.asarray(_log_sum_exp(log_weight + log_normal).sum(2))


def _log_sum_exp(x: Array) -> Array:
    """log sum exp over the last axis."""
    top = x.max(-1, keepdims=True)
    return np.asarray(top[..., 0] + np.log(np.exp(x - top).sum(-1)))
