"""What the network of method `mdn` proposes: K ways to share a target among the fins, as planar forces."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray
from finlab.mdn.features import RobotView, Seen
from finlab.mdn.network import ForceMixture


class Proposal(NamedTuple):
    """K proposals for each of N targets, none of them exact yet."""

    force: AnyArray
    """Planar forces (N, K, n) [N], complex: horizontal, and 1j times vertical."""
    component: NDArray[np.intp]
    """Mixture component of each (N, K)."""


def propose(
    mixture: ForceMixture, view: RobotView, seen: Seen, n_candidates: int, temperature: float, seed: int
) -> Proposal:
    """K proposals for N targets on one robot, from the network's mixture for what it sees of them.

    The components' means come first, by falling weight. Where K exceeds their number M, the rest are drawn by
    the components' weights, with variances times the temperature.
    """
    weight, mean, std = mixture.complex_parts()
    rows, m, n = mean.shape
    place = np.arange(rows)[:, None]
    component = np.argsort(-weight, axis=1)[:, :n_candidates]
    root = mean[place, component]
    if n_candidates > m:
        rng, more = np.random.default_rng(seed), n_candidates - m
        uniform = rng.random((rows, more, 1), dtype=np.float32)
        parts = rng.standard_normal((rows, more, n, 2), dtype=np.float32)
        cumulative = weight.cumsum(1)
        others = (uniform * cumulative[:, None, -1:] > cumulative[:, None, :-1]).sum(-1)
        spread = math.sqrt(temperature) * std[place, others]
        drawn = mean[place, others] + spread * (parts[..., 0] + 1j * parts[..., 1])
        component, root = (np.hstack(both) for both in ((component, others), (root, drawn)))
    return Proposal(shares(root) * (seen.frame * view.largest)[:, None], component)


def shares(root: AnyArray) -> AnyArray:
    """Shares of the largest forces, none above one, from what the mixture gives: their roots."""
    size = np.abs(root)
    return np.asarray(root * np.minimum(size, 1.0 / np.maximum(size, 1e-9)))
