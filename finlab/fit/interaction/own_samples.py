"""What samples of one robot say of the weights of its interaction, in closed form.

Bayesian linear regression (Bishop, 2006, section 3.3) on the latent numbers z of the robot, whose
weights are `m + L z`. With the terms Phi of its samples over the deviations of their noise, and y
what `m` leaves of them over the same,

    z ~ N(V H^T y, V),  H = Phi L,  V = (I + H^T H)^-1.

The noise of a sample is that of the measurement and that of the messages, which no weights explain.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.fit.interaction.samples import Samples, left_by_laws
from finlab.interaction.linear import Terms, Weights
from finlab.layout.jet_geometry import jet_geometry_of

MEASUREMENT_NOISE = 0.02
"""Standard deviation of a measured wrench, as a share of the robot's root mean square."""
LEAST_NOISE = 1e-4
"""The same of an axis on which there is next to nothing, over the wrench scale."""


class RobotTerms(NamedTuple):
    """Samples of a robot as the model sees them, over the wrench scale."""

    by_weight: Array
    """Terms (K, 6, w)."""
    covariance: dict[str, Array]
    """As in `TermRows` (K, 6, 6)."""
    missed: Array
    """What the laws leave of the wrenches (K, 6)."""
    size: Array
    """Root mean square (6,) of the wrenches."""


class FittedWeights(NamedTuple):
    """The result of a fit."""

    weights: Weights
    """Of this robot."""
    laws: float
    """Root mean square error of the laws alone, over the wrench scale."""
    before: float
    """The same with the weights before."""
    after: float
    """The same with the fitted weights."""


def terms_of(samples: Samples) -> RobotTerms:
    """Returns the terms of samples of a robot."""
    force, missed, scale, inflow = left_by_laws(samples)
    rows = Terms(jet_geometry_of(samples.layout)).rows(force, inflow)
    by_scale = scale[:, None] * scale
    return RobotTerms(
        rows.by_weight / scale[:, None],
        {kind: covariance / by_scale for kind, covariance in rows.covariance.items()},
        missed,
        np.sqrt(((samples.wrench / scale) ** 2).mean(axis=0)),
    )


def whitened(
    terms: RobotTerms, weights: Weights, measurement: float = MEASUREMENT_NOISE
) -> tuple[Array, Array, float]:
    """Returns terms over the deviations of their noise.

    Args:
        terms: of K samples.
        weights: whose mean and noise count.
        measurement: noise of measured wrenches, as a share of their root mean square.

    Returns:
        Terms (6 K, w), what the mean leaves (6 K,), and the logarithm of the noise's determinant's
        root.
    """
    variance = (measurement * terms.size) ** 2 + LEAST_NOISE**2
    noise = np.broadcast_to(np.diag(variance), (len(terms.missed), 6, 6)).copy()
    for kind, covariance in terms.covariance.items():
        noise += weights.noise[kind] ** 2 * covariance
    root = np.linalg.cholesky(noise)
    inverse = np.linalg.inv(root)
    count = terms.by_weight.shape[-1]
    left = terms.missed - terms.by_weight @ weights.mean
    log_root = float(np.log(np.diagonal(root, axis1=1, axis2=2)).sum())
    by_noise = (inverse @ terms.by_weight).reshape(-1, count)
    return by_noise, (inverse @ left[..., None]).ravel(), log_root


def fit_weights(samples: Samples, prior: Weights) -> FittedWeights:
    """Returns the weights of a robot by its samples.

    Args:
        samples: of the robot; any number of them.
        prior: what was known before.

    Raises:
        DataError: there is no sample.
    """
    if len(samples.wrench) == 0:
        raise DataError("expected at least one sample, got none")
    terms = terms_of(samples)
    weights = posterior(terms, prior)
    return FittedWeights(
        weights,
        _root_mean_square(terms.missed),
        _root_mean_square(terms.missed - terms.by_weight @ prior.mean),
        _root_mean_square(terms.missed - terms.by_weight @ weights.mean),
    )


def posterior(terms: RobotTerms, prior: Weights) -> Weights:
    """Returns the weights after samples of a robot, whose terms are given."""
    by_noise, left, _ = whitened(terms, prior)
    by_latent = by_noise @ prior.factor
    information = np.eye(by_latent.shape[1]) + by_latent.T @ by_latent
    root = cholesky(information, lower=True)
    projected = solve_triangular(root, by_latent.T @ left, lower=True)
    # With the information R R^T, V = R^-T R^-1: L R^-T is a factor of the weights' covariance.
    factor = solve_triangular(root, prior.factor.T, lower=True).T
    mean = prior.mean + factor @ projected
    return Weights(mean, factor, prior.noise, 1.0)


def _root_mean_square(rows: Array) -> float:
    """Root mean square of the norms of rows (N, 6)."""
    return float(np.sqrt((rows**2).sum(axis=1).mean()))
