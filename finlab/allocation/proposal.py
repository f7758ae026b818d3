"""What the network proposes: K candidate commands, drawn from its mixture and scored by the surrogate."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.energy import command_energy
from finlab.allocation.numpy_network import MixtureArrays, NumpyNetwork
from finlab.allocation.prepared import Prepared
from finlab.data.features import fin_frame_features

Array = NDArray[Any]


class Proposal(NamedTuple):
    """K candidates for each of N targets, inside the limits, in single precision."""

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
    energy: Array
    """Energy proxy (N, K)."""


def predict(network: NumpyNetwork, prepared: Prepared, centred: Array) -> MixtureArrays:
    """The network's mixture for normalized, centred targets (N, 6)."""
    x = fin_frame_features(prepared.geometry, centred).astype(np.float32)
    return network(x, centred.astype(np.float32), prepared.lower, prepared.upper)


def sample(
    mixture: MixtureArrays, n_samples: int, temperature: float, seed: int
) -> tuple[Array, NDArray[np.int64]]:
    """Normalized commands (N, K, n, 3) and their components (N, K).

    The first M candidates are the components' means. The rest are drawn by the mixture's weights, with
    the variance of each Gaussian times T. Weights are not sharpened by T: the best component is there
    anyway, and other modes are what a user wants to compare.
    """
    rows, n, m, _ = mixture.mean.shape
    kept = min(m, n_samples)
    means = np.swapaxes(mixture.mean, 1, 2)  # (N, M, n, 3)
    component = np.broadcast_to(np.arange(kept), (rows, kept))
    extra = n_samples - kept
    if extra <= 0:
        return means[:, :kept], component
    raw, normal = draws_of_one(seed, extra, n) if rows == 1 else _draws(seed, rows, extra, n)
    cumulative = mixture.weight.cumsum(1)
    draw = raw * cumulative[:, None, -1:]
    drawn = np.minimum((draw > cumulative[:, None, :]).sum(-1), m - 1)
    row = np.arange(rows)[:, None]
    noise = normal * np.swapaxes(mixture.std, 1, 2)[row, drawn]
    noise *= np.float32(np.sqrt(temperature))
    noise += means[row, drawn]
    return np.concatenate([means, noise], axis=1), np.concatenate([component, drawn], axis=1)


def _draws(seed: int, rows: int, extra: int, n: int) -> tuple[Array, Array]:
    """Uniform (rows, extra, 1) and normal (rows, extra, n, 3) random numbers of a seed."""
    rng = np.random.default_rng(seed)
    uniform = rng.random((rows, extra, 1), dtype=np.float32)
    return uniform, rng.standard_normal((rows, extra, n, 3), dtype=np.float32)


@lru_cache(maxsize=64)
def draws_of_one(seed: int, extra: int, n: int) -> tuple[Array, Array]:
    """The same for a single target, kept: a robot asks with one seed, tick after tick."""
    uniform, normal = _draws(seed, 1, extra, n)
    uniform.setflags(write=False)
    normal.setflags(write=False)
    return uniform, normal


def propose(
    network: NumpyNetwork,
    prepared: Prepared,
    centred: Array,
    target: Array,
    n_candidates: int,
    temperature: float,
    seed: int,
) -> Proposal:
    """Predict, sample, clamp and score.

    Args:
        network: the allocator network; one that has a method `propose` of its own does it all by itself, as
            engines on board do.
        prepared: the layout.
        centred: normalized targets minus the mean (N, 6), which the network sees.
        target: normalized targets (N, 6).
        n_candidates: K.
        temperature: T.
        seed: seed of the draw.
    """
    engine = getattr(network, "propose", None)
    if engine is not None:
        answer: Proposal = engine(prepared, centred, target, n_candidates, temperature, seed)
        return answer
    return propose_by_steps(network, prepared, centred, target, n_candidates, temperature, seed)


def propose_by_steps(
    network: NumpyNetwork,
    prepared: Prepared,
    centred: Array,
    target: Array,
    n_candidates: int,
    temperature: float,
    seed: int,
) -> Proposal:
    """`propose` in numpy, with whatever runs the network."""
    x, component = sample(predict(network, prepared, centred), n_candidates, temperature, seed)
    lower, upper = prepared.lower.astype(np.float32), prepared.upper.astype(np.float32)
    problem = prepared.commands
    x = x + np.float32(1.0)
    x *= np.float32(0.5) * (upper - lower)
    x += lower
    command = problem.clamp(x)
    rows, k, n, _ = command.shape
    force = problem.fin.force(command)
    columns = problem.columns.reshape(3 * n, 6).astype(np.float32)
    wrench = (force.reshape(rows * k, 3 * n) @ columns).reshape(rows, k, 6)
    missing = wrench - target[:, None]
    error = np.sqrt(np.einsum("rki,rki->rk", missing, missing))
    thrust = np.sqrt(force[..., 1] ** 2 + force[..., 2] ** 2)
    return Proposal(command, component, wrench, error, thrust, command_energy(command, upper))
