"""Constants of the formula of jets, fitted to samples of one robot by least squares on their
logarithms.

Few samples leave some of the constants open; a normal prior about the usual values, in which a
factor of two is one standard deviation, holds those.
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

FITTED = ("length", "width", "spread", "lag", "most", "side", "housing", "hull")
PRIOR = float(np.log(2.0))
"""Standard deviation of the logarithm of a constant before anything is measured."""
LEAST_SAMPLES = 5
LEAST, MOST = 2e-3, 9.0
"""Smallest and largest constant, over the usual one."""
NOISE = 0.01
"""Error of a sample, on the yardstick, that least counts as noise."""


class FittedJets(NamedTuple):
    """What samples say."""

    jets: Jets
    laws: float
    """Root mean square of what the laws alone miss of the samples, on the yardstick."""
    left: float
    """The same of what the fitted jets miss."""


def fit_constants(samples: Samples) -> FittedJets:
    """Returns the constants that fit samples best. Raises DataError: there are fewer than five."""
    if len(samples.wrench) < LEAST_SAMPLES:
        raise DataError(f"expected at least {LEAST_SAMPLES} samples, got {len(samples.wrench)}")
    force, missed, scale = left_by_laws(samples)
    geometry = jet_geometry_of(samples.layout)
    start = np.log([getattr(Jets(), name) for name in FITTED])

    def jets_at(logarithms: Array) -> Jets:
        values = np.exp(start + np.clip(logarithms - start, *np.log([LEAST, MOST])))
        return Jets(**dict(zip(FITTED, values.tolist(), strict=True)))

    def left(logarithms: Array) -> Array:
        known = jets_at(logarithms).of(geometry)
        return np.asarray(missed - known.offset(force) / scale)

    def with_prior(logarithms: Array) -> Array:
        return np.concatenate([(left(logarithms) / noise).ravel(), (logarithms - start) / PRIOR])

    noise = NOISE
    for _ in range(2):  # the noise is what the first fit leaves
        fit: Any = least_squares(with_prior, start)
        rest = left(fit.x)
        noise = max(NOISE, float(np.sqrt((rest**2).mean())))
    each = replace(jets_at(fit.x), uncertain=1.0).of(geometry).deviation(force) / scale
    size = np.sqrt(((samples.wrench / scale) ** 2).mean(axis=0))
    share, floor = parts_of_error(rest, each, size)
    by_constants = noise * fit.jac[: rest.size]
    measured = (floor * size) ** 2 + (share * each) ** 2 + 1e-12
    known = (by_constants / measured.reshape(-1, 1)).T @ by_constants + np.eye(
        len(start)
    ) / PRIOR**2
    spread = ((by_constants @ np.linalg.inv(known)) * by_constants).sum()
    uncertain = np.sqrt(share**2 + spread / max((each**2).sum(), 1e-12))
    jets = {name: float(f"{value:.4g}") for name, value in asdict(jets_at(fit.x)).items()}
    made = Jets(**{**jets, "uncertain": float(f"{min(uncertain, 10.0):.3g}")})
    return FittedJets(made, _size(missed), _size(rest))


def parts_of_error(rest: Array, each: Array, size: Array) -> tuple[float, float]:
    """Returns the share of a known deviation (N, 6), and of a size (6,) or (N, 6), whose squares
    together are the variances of normal errors (N, 6), what a model lacks and noise: root mean
    squares over all shares, each as likely as it makes the errors."""
    shares = np.geomspace(3e-3, 10.0, 60)
    floors = np.geomspace(1e-4, 0.3, 40)
    costs = np.empty((len(shares), len(floors)))
    for i, share in enumerate(shares):
        variance = (share * each) ** 2 + (floors[:, None, None] * size) ** 2 + 1e-18
        costs[i] = (np.log(variance) + rest**2 / variance).sum(axis=(-1, -2))
    likely = np.exp(-0.5 * (costs - costs.min()))
    likely /= likely.sum()
    return float(np.sqrt(likely.sum(axis=1) @ shares**2)), float(
        np.sqrt(likely.sum(axis=0) @ floors**2)
    )


def _size(rows: Array) -> float:
    return float(np.sqrt((rows**2).sum(axis=1).mean()))
