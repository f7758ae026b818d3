"""Fits the constants of the formula of jets to samples of one robot.

The fit is least squares on the logarithms of the constants. Few samples leave some of them open; a
normal prior about the default values, in which a factor of two is one standard deviation, holds
those.
"""

from dataclasses import asdict, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.fit.interaction.samples import Samples, left_by_laws
from finlab.interaction.jets import Jets
from finlab.layout.jet_geometry import jet_geometry_of

FITTED_CONSTANTS = ("length", "width", "spread", "lag", "most", "side", "housing", "hull")
"""Fields of `Jets` that are fitted."""
PRIOR_DEVIATION = float(np.log(2.0))
"""Standard deviation of the logarithm of a constant before anything is measured."""
MIN_SAMPLES = 5
"""Fewest samples of a fit."""
MIN_RATIO = 2e-3
"""Least constant over its default."""
MAX_RATIO = 9.0
"""Largest constant over its default."""
MIN_NOISE = 0.01
"""Least standard deviation of a sample, over the wrench scale."""
MAX_UNCERTAINTY = 10.0
"""Largest `uncertain` of the fitted jets."""


class FittedJets(NamedTuple):
    """The result of a fit."""

    jets: Jets
    """The formula with the fitted constants."""
    laws: float
    """Root mean square error of the laws alone, over the wrench scale."""
    left: float
    """The same with the fitted jets."""


def fit_constants(samples: Samples) -> FittedJets:
    """Returns the constants that fit samples best.

    Raises:
        DataError: there are fewer than five samples.
    """
    if len(samples.wrench) < MIN_SAMPLES:
        raise DataError(f"expected at least {MIN_SAMPLES} samples, got {len(samples.wrench)}")
    force, missed, scale, inflow = left_by_laws(samples)
    geometry = jet_geometry_of(samples.layout)
    start = np.log([getattr(Jets(), name) for name in FITTED_CONSTANTS])

    def jets_at(logarithms: Array) -> Jets:
        values = np.exp(start + np.clip(logarithms - start, *np.log([MIN_RATIO, MAX_RATIO])))
        return Jets(**dict(zip(FITTED_CONSTANTS, values.tolist(), strict=True)))

    def residuals(logarithms: Array) -> Array:
        interaction = jets_at(logarithms).of(geometry)
        return np.asarray(missed - interaction.offset(force, inflow) / scale)

    def with_prior(logarithms: Array) -> Array:
        data = (residuals(logarithms) / noise).ravel()
        return np.concatenate([data, (logarithms - start) / PRIOR_DEVIATION])

    noise = MIN_NOISE
    for _ in range(2):  # the noise of the second fit is the residual of the first
        fit: Any = least_squares(with_prior, start)
        residual = residuals(fit.x)
        noise = max(MIN_NOISE, float(np.sqrt((residual**2).mean())))
    # Deviation of the jets' wrenches per `uncertain`, and the share of it that explains residuals.
    deviation = replace(jets_at(fit.x), uncertain=1.0).of(geometry).deviation(force) / scale
    size = np.sqrt(((samples.wrench / scale) ** 2).mean(axis=0))
    share, floor = parts_of_error(residual, deviation, size)
    # Variance of the wrenches by the uncertainty of the constants: J C J^T, where C is the inverse
    # of the Fisher information J^T V^-1 J and of the prior's.
    jacobian = noise * fit.jac[: residual.size]
    variance = (floor * size) ** 2 + (share * deviation) ** 2 + 1e-12
    prior_information = np.eye(len(start)) / PRIOR_DEVIATION**2
    information = (jacobian / variance.reshape(-1, 1)).T @ jacobian + prior_information
    jet_variance = ((jacobian @ np.linalg.inv(information)) * jacobian).sum()
    uncertain = np.sqrt(share**2 + jet_variance / max((deviation**2).sum(), 1e-12))
    constants = {name: float(f"{value:.4g}") for name, value in asdict(jets_at(fit.x)).items()}
    constants["uncertain"] = float(f"{min(uncertain, MAX_UNCERTAINTY):.3g}")
    return FittedJets(Jets(**constants), _root_mean_square(missed), _root_mean_square(residual))


def parts_of_error(error: Array, deviation: Array, size: Array) -> tuple[float, float]:
    """Splits errors into a share of a known deviation and noise of a known size.

    The errors are normal with the variance (share deviation)^2 + (floor size)^2; both are root mean
    squares over a grid, weighted by the likelihood.

    Args:
        error: errors (N, 6).
        deviation: the known deviation (N, 6).
        size: the size of the noise (6,) or (N, 6).

    Returns:
        Share and floor.
    """
    shares = np.geomspace(3e-3, 10.0, 60)
    floors = np.geomspace(1e-4, 0.3, 40)
    costs = np.empty((len(shares), len(floors)))
    for i, share in enumerate(shares):
        variance = (share * deviation) ** 2 + (floors[:, None, None] * size) ** 2 + 1e-18
        costs[i] = (np.log(variance) + error**2 / variance).sum(axis=(-1, -2))
    likelihood = np.exp(-0.5 * (costs - costs.min()))
    likelihood /= likelihood.sum()
    share = np.sqrt(likelihood.sum(axis=1) @ shares**2)
    floor = np.sqrt(likelihood.sum(axis=0) @ floors**2)
    return float(share), float(floor)


def _root_mean_square(rows: Array) -> float:
    """Root mean square of the norms of rows (N, 6)."""
    return float(np.sqrt((rows**2).sum(axis=1).mean()))
