"""The paper's mixtures over each fin's commands, in coordinates where every limit range is [-1, 1]. numpy
only.

Training has the same in PyTorch, `Mixture`; a test holds the two against each other.
"""

import math
from typing import NamedTuple

import numpy as np

from finlab.arrays import AnyArray

LOG_STD_BOUND = 3.0
"""Largest size of the components' log standard deviation (paper, implementation details)."""


class MixtureArrays(NamedTuple):
    """A mixture of M diagonal Gaussians over the commands of each of n fins, for N targets."""

    weight: AnyArray
    """Weights of the components (N, n, M)."""
    mean: AnyArray
    """Means (N, n, M, 3)."""
    std: AnyArray
    """Standard deviations (N, n, M, 3)."""

    def expected(self) -> AnyArray:
        """Mean command (N, n, 3) of the whole mixture."""
        return np.asarray((self.weight[..., None] * self.mean).sum(2))

    def tempered(self, temperature: float, uniform: AnyArray, normal: AnyArray) -> AnyArray:
        """Commands (N, K, n, 3) drawn at a temperature T from 0: the weights are raised to the power 1/T, the
        Gaussians keep their deviations (paper, command generation).

        Uniform numbers in [0, 1) (N, n, K) choose components, standard normal ones (N, n, K, 3) the rest.
        """
        m = self.weight.shape[-1]
        with np.errstate(divide="ignore"):
            sharp = np.log(self.weight) / np.float32(max(temperature, 1e-6))
        cumulative = np.exp(sharp - sharp.max(-1, keepdims=True)).cumsum(-1)
        cumulative /= cumulative[..., -1:]
        choice = np.minimum((uniform[..., None] > cumulative[..., None, :]).sum(-1), m - 1)
        choice = choice[..., None]
        mean, std = (np.take_along_axis(part, choice, axis=2) for part in (self.mean, self.std))
        return np.asarray((mean + std * normal).swapaxes(1, 2))

    def log_likelihood(self, x: AnyArray) -> AnyArray:
        """Log likelihood (N, K) of commands x (N, K, n, 3); zero directions are numbers as in the paper, no
        angles."""
        deviation = x[:, :, :, None] - self.mean[:, None]  # (N, K, n, M, 3)
        deviation /= self.std[:, None]
        log_normal = -(0.5 * deviation * deviation + np.log(self.std)[:, None]).sum(-1)
        log_normal -= np.float32(1.5 * math.log(2.0 * math.pi))
        with np.errstate(divide="ignore"):
            log_weight = np.log(self.weight)[:, None]
        return np.asarray(np.logaddexp.reduce(log_weight + log_normal, axis=-1).sum(2))
