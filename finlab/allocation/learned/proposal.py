"""What the network proposes: K candidate commands, drawn from its mixture, scored by the fins' own laws."""

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.search.prepared import Prepared
from finlab.inference.features import Geometry, fin_frame_features
from finlab.inference.mixture import MixtureArrays
from finlab.inference.network import NumpyNetwork

Array = NDArray[Any]


class Proposal(NamedTuple):
    """K candidates for each of N targets, inside the limits."""

    command: Array
    """(N, K, n, 3)."""
    component: NDArray[np.int64]
    """Mixture component of each candidate (N, K)."""
    wrench: Array
    """Normalized wrench (N, K, 6)."""
    error: Array
    """Normalized error (N, K)."""
    size: Array
    """Planar force of each fin (N, K, n) [N]."""
    cost: Array
    """(N, K)."""


def predict(network: NumpyNetwork, place: Geometry, prepared: Prepared, centred: Array) -> MixtureArrays:
    """The network's mixture for normalized, centred targets (N, 6)."""
    x = fin_frame_features(place, centred).astype(np.float32)
    return network(x, centred.astype(np.float32), prepared.plant.lower, prepared.plant.upper)


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
    means = mixture.mean.swapaxes(1, 2)  # (N, M, n, 3)
    components = np.empty((rows, n_samples), dtype=np.int64)
    commands = np.empty((rows, n_samples, n, 3), dtype=np.float32)
    components[:, :kept] = np.arange(kept)
    commands[:, :kept] = means[:, :kept]
    extra = n_samples - kept
    if extra <= 0:
        return commands, components
    raw, normal = draws_of_one(seed, extra, n) if rows == 1 else _draws(seed, rows, extra, n)
    cumulative = mixture.weight.cumsum(1)
    draw = raw * cumulative[:, None, -1:]
    drawn = np.add.reduce(draw > cumulative[:, None, :-1], axis=-1, out=components[:, kept:])
    place = drawn + np.arange(0, rows * m, m)[:, None]
    noise = commands[:, kept:]
    np.multiply(normal, mixture.std.swapaxes(1, 2).reshape(rows * m, n, 3).take(place, axis=0), out=noise)
    noise *= np.float32(math.sqrt(temperature))
    noise += means.reshape(rows * m, n, 3).take(place, axis=0)
    return commands, components


def _draws(seed: int, rows: int, extra: int, n: int) -> tuple[Array, Array]:
    """Uniform (rows, extra, 1) and normal (rows, extra, n, 3) random numbers of a seed."""
    rng = np.random.default_rng(seed)
    uniform = rng.random((rows, extra, 1), dtype=np.float32)
    return uniform, rng.standard_normal((rows, extra, n, 3), dtype=np.float32)


@lru_cache(maxsize=64)
def draws_of_one(seed: int, extra: int, n: int) -> tuple[Array, Array]:
    """The same for a single target, cached: a control loop uses one seed for every tick."""
    uniform, normal = _draws(seed, 1, extra, n)
    uniform.setflags(write=False)
    normal.setflags(write=False)
    return uniform, normal


def propose(
    mixture: MixtureArrays, prepared: Prepared, target: Array, drawn: tuple[int, float, int]
) -> Proposal:
    """Sample, clamp and score.

    Args:
        mixture: what the network predicts for N targets.
        prepared: the layout.
        target: normalized targets (N, 6).
        drawn: number K of candidates, temperature, seed of the draw.
    """
    x, component = sample(mixture, *drawn)
    plant, problem = prepared.plant, prepared.commands
    command = problem.clamp_in_place(plant.lower + 0.5 * (x + 1.0) * plant.width)
    rows, k, n, _ = command.shape
    force = plant.force(command)
    wrench = force.reshape(rows * k, 3 * n).dot(problem.columns.reshape(3 * n, 6)).reshape(rows, k, 6)
    missing = wrench - target[:, None]
    error = np.sqrt(np.einsum("rki,rki->rk", missing, missing))
    size = np.hypot(force[..., 1], force[..., 2])
    cost = prepared.cost(command.reshape(rows * k, n, 3)).reshape(rows, k)
    return Proposal(command, component, wrench, error, size, cost)
