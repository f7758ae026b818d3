"""Posterior weights of an interaction by samples of one robot, in closed form.

Bayesian linear regression (Bishop, 2006, section 3.3) on the latent numbers z of the robot, whose
weights are `m + L z`. With the terms Phi of its samples over the deviations of their noise, and y
what `m` leaves of them over the same,

    z ~ N(V H^T y, V),  H = Phi L,  V = (I + H^T H)^-1.

The noise of a sample is that of the measurement and that of the messages, which no weights explain.
Samples left out one by one say by what factor the deviations are too small for this robot.
"""

from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.fit.interaction.samples import Samples, left_by_laws
from finlab.interaction.linear import Terms, Weights
from finlab.layout.jet_geometry import jet_geometry_of

MEASUREMENT_NOISE = 0.02
"""Standard deviation of a measured wrench, as a share of the robot's root mean square."""
LEAST_NOISE = 1e-4
"""The same of an axis on which there is next to nothing, over the wrench scale."""

NORMAL_90 = 1.645
"""Half width of a 90 % interval, in standard deviations of a normal number."""
SHARES = np.geomspace(1.0 / 64.0, 64.0, 25)
"""Factors of the variances of latent numbers and of noise, of which a robot has one each [1]."""
SHARE_DEVIATION = 1.5
"""Standard deviation of their logarithms [1]."""


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
    values, vectors = np.linalg.eigh((by_noise @ prior.factor).T @ (by_noise @ prior.factor))
    values = np.maximum(values, 0.0)
    projected = vectors.T @ ((by_noise @ prior.factor).T @ left)
    weight_share, noise_share = _likeliest_shares(values, projected, left)
    # V = (I / alpha + H^T H / beta)^-1, in the basis of the eigenvectors of H^T H.
    variance = 1.0 / (1.0 / weight_share + values / noise_share)
    by_vector = prior.factor @ vectors
    latent = variance * projected / noise_share
    mean = prior.mean + by_vector @ latent
    rows = by_noise @ by_vector
    spread = left_out_spread(rows, variance / noise_share, left - rows @ latent, noise_share)
    root = float(np.sqrt(noise_share))
    noise = {kind: root * share for kind, share in prior.noise.items()}
    return Weights(mean, by_vector * np.sqrt(variance), noise, spread)


def left_out_spread(rows: Array, variance: Array, left: Array, noise_share: float) -> float:
    """Returns the factor, at least 1, by which 90 % of samples lie within their 90 % intervals by
    the others: how much more this robot differs from the model than the model knows.

    Each sample is left out in closed form: with A = H_i V H_i^T / beta and the residuals e_i, its
    error by the others is (I - A)^-1 e_i and the covariance of that beta (I - A)^-1.

    Args:
        rows: H (6 K, r), six rows for each sample.
        variance: diagonal of V / beta (r,).
        left: residuals (6 K,) of all samples, over the deviations of their noise.
        noise_share: beta.
    """
    by_sample = rows.reshape(-1, 6, rows.shape[-1])
    residual = left.reshape(-1, 6)
    hat = (by_sample * variance) @ by_sample.swapaxes(1, 2)
    inverse = np.linalg.inv(np.eye(6) - hat)
    error = (inverse @ residual[..., None])[..., 0]
    deviation = np.sqrt(noise_share * np.diagonal(inverse, axis1=1, axis2=2))
    # Axes that nothing pushes along say nothing.
    ratio = np.abs(error / deviation)[residual != 0.0]
    if len(ratio) == 0:
        return 1.0
    return max(1.0, float(np.quantile(ratio, 0.9)) / NORMAL_90)


def _likeliest_shares(values: Array, projected: Array, left: Array) -> tuple[float, float]:
    """The factors alpha and beta of the variances of latent numbers and of noise that make the
    samples of a robot most likely: robots differ more or less from others, and are explained more
    or less well. Their logarithms are normal with the deviation `SHARE_DEVIATION`.

    Args:
        values: eigenvalues (r,) of H^T H.
        projected: H^T y (r,) in the basis of its eigenvectors.
        left: y (6 K,).
    """
    total = float(left @ left)
    best = -np.inf
    shares = (1.0, 1.0)
    for weight_share in SHARES:
        for noise_share in SHARES:
            # y ~ N(0, beta I + alpha H H^T); the lemmas of Sylvester and Woodbury.
            ratio = weight_share / noise_share
            grown = 1.0 + ratio * values
            explained = float((ratio * projected**2 / grown).sum())
            cost = (total - explained) / noise_share
            cost += len(left) * np.log(noise_share) + np.log(grown).sum()
            cost += (np.log([weight_share, noise_share]) ** 2).sum() / SHARE_DEVIATION**2
            if -cost > best:
                best = -cost
                shares = (float(weight_share), float(noise_share))
    return shares


def _root_mean_square(rows: Array) -> float:
    """Root mean square of the norms of rows (N, 6)."""
    return float(np.sqrt((rows**2).sum(axis=1).mean()))
