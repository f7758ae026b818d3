"""What the network proposes for a target: K candidate commands, drawn from its mixture and scored by the surrogate."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from finlab.allocation.prepared import Prepared
from finlab.data.features import fin_frame_features
from finlab.model.allocator_network import AllocatorNetwork

Array = NDArray[np.float64]


class Proposal(NamedTuple):
    """K candidates for each of N targets, inside the limits."""

    command: Array
    """(N, K, n, 3)."""
    component: NDArray[np.int64]
    """Mixture component of each candidate (N, K)."""
    wrench: Array
    """Normalized wrench (N, K, 6) by the surrogate."""
    error: Array
    """Normalized error (N, K) by the surrogate."""
    thrust: Array
    """Planar force of each fin (N, K, n) [N] by the surrogate."""


class MixtureArrays(NamedTuple):
    """A joint mixture in numpy, in normalized coordinates."""

    weight: Array
    """(N, M)."""
    mean: Array
    """(N, n, M, 3)."""
    std: Array
    """(N, n, M, 3)."""


def predict(network: AllocatorNetwork, prepared: Prepared, centred: Array) -> MixtureArrays:
    """The network's mixture for normalized, centred targets (N, 6)."""
    x = fin_frame_features(prepared.geometry, centred).astype(np.float32)
    n = prepared.lower.shape[0]
    with torch.inference_mode():
        target = torch.from_numpy(centred.astype(np.float32))
        lower = torch.from_numpy(prepared.lower.astype(np.float32)).expand(len(centred), n, 3)
        upper = torch.from_numpy(prepared.upper.astype(np.float32)).expand(len(centred), n, 3)
        mixture = network(torch.from_numpy(x), target, lower, upper)
        weight = mixture.logits.softmax(-1)
    return MixtureArrays(weight.numpy(), mixture.mean.numpy(), np.exp(mixture.log_std.numpy()))


def sample(mixture: MixtureArrays, n_samples: int, temperature: float, seed: int) -> tuple[Array, NDArray[np.int64]]:
    """Normalized commands (N, K, n, 3) and their components (N, K).

    The first M candidates are the components' means, the rest are drawn at a temperature: weights to
    the power 1/T (never all on one component: modes are what a user wants to compare), variance times T.
    """
    rows, n, m, _ = mixture.mean.shape
    rng = np.random.default_rng(seed)
    means = np.broadcast_to(np.arange(min(m, n_samples)), (rows, min(m, n_samples)))
    extra = n_samples - means.shape[1]
    if extra > 0:
        cumulative = mixture.weight.cumsum(1)
        draw = rng.random((rows, extra, 1)) * cumulative[:, None, -1:]
        component = np.minimum((draw > cumulative[:, None, :]).sum(-1), m - 1)
        component = np.concatenate([means, component], axis=1)
    else:
        component = means.copy()
    index = component[:, None, :, None]
    x = np.take_along_axis(mixture.mean, index, axis=2)
    if extra > 0:
        std = np.take_along_axis(mixture.std, index[:, :, m:], axis=2)
        noise = rng.standard_normal(std.shape, dtype=np.float32)
        x[:, :, m:] += np.float32(np.sqrt(temperature)) * std * noise
    return np.swapaxes(x, 1, 2), component


def propose(
    network: AllocatorNetwork,
    prepared: Prepared,
    centred: Array,
    target: Array,
    n_candidates: int,
    temperature: float,
    seed: int,
) -> Proposal:
    """Predict, sample, clamp and score.

    Args:
        network: the allocator network.
        prepared: the layout.
        centred: normalized targets minus the mean (N, 6), which the network sees.
        target: normalized targets (N, 6).
        n_candidates: K.
        temperature: T.
        seed: seed of the draw.
    """
    x, component = sample(predict(network, prepared, centred), n_candidates, temperature, seed)
    half = 0.5 * (prepared.upper - prepared.lower)
    problem = prepared.commands
    command = problem.clamp(prepared.lower + half * (1.0 + x.astype(np.float64)))
    rows, k, n, _ = command.shape
    force = problem.fin.force(command)
    wrench = force.reshape(rows, k, 3 * n) @ problem.columns.reshape(3 * n, 6)
    error = np.linalg.norm(wrench - target[:, None], axis=-1)
    thrust = np.sqrt((force[..., 1:] ** 2).sum(-1))
    return Proposal(command, component, wrench, error, thrust)
