"""Learns the weights of an interaction from forward data of many robots, in closed form.

A first mean is ridge regression on all samples. How much robots differ, the covariance of their
weights, and how large the noise is that no weights explain are those that make the samples most
likely (empirical Bayes): first a few numbers, one deviation for each kind of term and the noise of
each kind of message, by steps on each in turn; then the whole covariance by the algorithm EM, held
near the former by as much as some robots would say. Of the covariance the directions that matter
most for wrenches are kept. The mean is then estimated again by generalized least squares: what
robots do not have in common counts less where they differ much. Robots held out say by what factor
intervals are too wide.
"""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import cholesky, eigh, solve_triangular

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.fit.interaction.own_samples import (
    LEAST_NOISE,
    MEASUREMENT_NOISE,
    NORMAL_90,
    RobotTerms,
    terms_of,
    whitened,
)
from finlab.fit.interaction.samples import Samples
from finlab.interaction.linear import (
    FLOW_TERMS,
    FORMULAS,
    MONOMIALS,
    USUAL_WEIGHTS,
    WEIGHT_COUNT,
    Weights,
)
from finlab.interaction.messages import ROW_SIZES

LINEAR_FILE = "interaction_linear.safetensors"
"""File of the weights in the folder of a training."""
LEAST_ROBOTS = 10
"""Fewest robots to learn from."""
RIDGE = 1e-5
"""Penalty of the regression, over the mean square of the terms."""
LEAST_SQUARE = 1e-12
"""Floor of the mean square of a term, by which it is divided."""
LATENTS = 200
"""Latent numbers that are kept."""
ROBOTS_OF_DEVIATIONS = 40
"""Robots by which the few deviations are found."""
ROBOTS_OF_COVARIANCE = 400
"""Robots by which the whole covariance is found."""
EXPECTATIONS = 3
"""Rounds of EM."""
INERTIA = 200.0
"""Robots that the covariance by the few deviations counts as much as."""
HELD_OUT_SHARE = 0.1
"""Share of the robots by which intervals are calibrated."""
FIRST_DEVIATION = 0.02
"""First guess of the part of a wrench that a term is uncertain by, over the wrench scale."""
FIRST_DEVIATION_OF_FORMULAS = 0.3
"""First guess of the deviation of the weights of formulas and of the flow [1]."""
FIRST_NOISE = 0.02
"""First guess of the noise of messages."""
FACTORS = (3.0, 2.0, 1.4)
"""By what the deviations are changed in each round."""
GAIN = 0.2
"""Least gain of the logarithm of the likelihood for which a deviation is changed."""
LEAST_DEVIATION = 1e-5
"""Least deviation."""


def train_weights(samples: Sequence[Samples], seed: int = 0) -> tuple[Weights, float]:
    """Returns the weights that robots have in common, and how they differ.

    Args:
        samples: of each robot.
        seed: which robots are held out.

    Returns:
        The weights, and the root mean square error on robots held out, over the wrench scale, noise
        included.

    Raises:
        DataError: there are fewer than ten robots.
    """
    if len(samples) < LEAST_ROBOTS:
        raise DataError(f"expected samples of at least {LEAST_ROBOTS} robots, got {len(samples)}")
    order = np.random.default_rng(seed).permutation(len(samples))
    held_count = max(1, int(HELD_OUT_SHARE * len(samples)))
    robots = [_single(terms_of(samples[k])) for k in order]
    held = robots[:held_count]
    known = robots[held_count:]
    gram, moment = _normal_equations(known)
    unit = np.sqrt(np.diag(gram) / len(known) + LEAST_SQUARE)
    mean = USUAL_WEIGHTS + _ridge_regression(gram, moment, len(known))

    noise = dict.fromkeys(ROW_SIZES, FIRST_NOISE)
    start = Weights(mean, np.zeros((WEIGHT_COUNT, 0)), noise, 1.0)
    deviations, weights = _fit_deviations(known[:ROBOTS_OF_DEVIATIONS], start, unit)
    covariance = np.diag(deviations**2)
    for _ in range(EXPECTATIONS):
        covariance = _expected(known[:ROBOTS_OF_COVARIANCE], weights, covariance, deviations)
    metric = gram / len(known) + RIDGE * np.diag(unit**2)
    weights = weights._replace(factor=_leading_factor(covariance, metric, LATENTS))
    weights = weights._replace(mean=_generalized_mean(known, weights))
    return _calibrated(held, weights)


def _single(terms: RobotTerms) -> RobotTerms:
    """Terms in single precision: those of all robots have to fit into memory."""
    return terms._replace(by_weight=terms.by_weight.astype(np.float32))


def _normal_equations(robots: Sequence[RobotTerms]) -> tuple[Array, Array]:
    """Gram matrix (w, w) of all terms, and their products (w,) with what the usual weights
    leave."""
    gram = np.zeros((WEIGHT_COUNT, WEIGHT_COUNT))
    moment = np.zeros(WEIGHT_COUNT)
    for robot in robots:
        rows = robot.by_weight.reshape(-1, WEIGHT_COUNT).astype(np.float64)
        gram += rows.T @ rows
        moment += rows.T @ (robot.missed.ravel() - rows @ USUAL_WEIGHTS)
    return gram, moment


def _ridge_regression(gram: Array, moment: Array, robots: int) -> Array:
    """Weights (w,) beside the usual ones, of the normal equations of so many robots: what data do
    not say stays as usual."""
    unit = np.sqrt(np.diag(gram) / robots + LEAST_SQUARE)
    scaled = gram / unit / unit[:, None]
    ridge = RIDGE * robots * np.eye(WEIGHT_COUNT)
    return np.asarray(np.linalg.solve(scaled + ridge, moment / unit) / unit)


def _generalized_mean(robots: Sequence[RobotTerms], weights: Weights) -> Array:
    """The mean (w,) of the weights by generalized least squares: with N the covariance of the noise
    of a robot's samples, their covariance is N + Phi L L^T Phi^T."""
    usual = weights._replace(mean=USUAL_WEIGHTS)
    gram = np.zeros((WEIGHT_COUNT, WEIGHT_COUNT))
    moment = np.zeros(WEIGHT_COUNT)
    for robot in robots:
        rows, left, _ = whitened(robot, usual)
        by_latent = rows @ weights.factor
        root = cholesky(np.eye(len(rows)) + by_latent @ by_latent.T, lower=True)
        rows = solve_triangular(root, rows, lower=True)
        gram += rows.T @ rows
        moment += rows.T @ solve_triangular(root, left, lower=True)
    return np.asarray(USUAL_WEIGHTS + _ridge_regression(gram, moment, len(robots)))


def _groups() -> Array:
    """Which deviation each weight has: of formulas, of the flow, of the hull, and of pairs by
    whether their degree is above 1."""
    groups = [0] * len(FORMULAS) + [1] * len(FLOW_TERMS)
    for kind, size in ROW_SIZES.items():
        for _ in range(size.vectors):
            for monomial in MONOMIALS[kind]:
                if kind == "hull":
                    groups.append(2)
                else:
                    groups.append(3 + (len(monomial) > 1))
    return np.array(groups)


def _fit_deviations(
    robots: Sequence[RobotTerms], start: Weights, unit: Array
) -> tuple[Array, Weights]:
    """Standard deviations (w,) of independent weights, and the noise, of the largest likelihood."""
    groups = _groups()
    group_count = int(groups.max()) + 1
    numbers = np.full(group_count + len(ROW_SIZES), FIRST_NOISE)
    numbers[:2] = FIRST_DEVIATION_OF_FORMULAS
    numbers[2:group_count] = FIRST_DEVIATION
    kinds = list(ROW_SIZES)

    def model(numbers: Array) -> tuple[Array, Weights]:
        deviations = numbers[groups]
        is_message = groups >= 2
        deviations[is_message] /= unit[is_message] + 1e-3 * unit[is_message].max()
        noise = dict(zip(kinds, numbers[group_count:].tolist(), strict=True))
        return deviations, start._replace(noise=noise)

    def likelihood(numbers: Array) -> float:
        deviations, weights = model(numbers)
        total = 0.0
        for robot in robots:
            rows, left, log_root = whitened(robot, weights)
            root = cholesky(np.eye(len(rows)) + (rows * deviations**2) @ rows.T, lower=True)
            explained = solve_triangular(root, left, lower=True)
            total -= 0.5 * explained @ explained + np.log(np.diag(root)).sum() + log_root
        return total

    best = likelihood(numbers)
    for factor in FACTORS:
        for k in range(len(numbers)):
            for change in (factor, 1.0 / factor):
                while numbers[k] * change >= LEAST_DEVIATION:
                    tried = numbers.copy()
                    tried[k] *= change
                    value = likelihood(tried)
                    if value <= best + GAIN:
                        break
                    best = value
                    numbers = tried
    return model(numbers)


def _expected(
    robots: Sequence[RobotTerms], weights: Weights, covariance: Array, deviations: Array
) -> Array:
    """A round of EM: the mean over robots of the covariance of their weights about the mean, given
    their samples, and `INERTIA` times that of independent weights."""
    total = len(robots) * covariance + INERTIA * np.diag(deviations**2)
    for robot in robots:
        rows, left, _ = whitened(robot, weights)
        by_weight = rows @ covariance
        root = cholesky(np.eye(len(rows)) + by_weight @ rows.T, lower=True)
        explained = solve_triangular(root, by_weight, lower=True)
        total -= explained.T @ explained
        change = explained.T @ solve_triangular(root, left, lower=True)
        total += np.outer(change, change)
    total /= len(robots) + INERTIA
    return np.asarray(0.5 * (total + total.T))


def _leading_factor(covariance: Array, metric: Array, count: int) -> Array:
    """The factor (w, count) of a covariance whose product with itself leaves least of the variance
    of wrenches, of which a metric (w, w) is the mean product of terms."""
    root = cholesky(metric, lower=True)
    values, vectors = eigh(root.T @ covariance @ root)
    values = values[::-1][:count]
    vectors = vectors[:, ::-1][:, :count]
    return np.asarray(covariance @ root @ vectors / np.sqrt(np.maximum(values, 1e-300)))


def _calibrated(held: Sequence[RobotTerms], weights: Weights) -> tuple[Weights, float]:
    """Weights with the `spread` by which 90 % of the errors on robots held out lie within 90 %
    intervals, and the root mean square of these errors."""
    errors = []
    variances = []
    noises = []
    for robot in held:
        by_latent = robot.by_weight @ weights.factor
        variance = (by_latent**2).sum(axis=-1)
        for kind, share in weights.noise.items():
            variance += share**2 * np.diagonal(robot.covariance[kind], axis1=1, axis2=2)
        errors.append(robot.missed - robot.by_weight @ weights.mean)
        variances.append(variance)
        noise = (MEASUREMENT_NOISE * robot.size) ** 2 + LEAST_NOISE**2
        noises.append(np.broadcast_to(noise, variance.shape))
    error = np.concatenate(errors)
    variance = np.concatenate(variances)
    noise = np.concatenate(noises)
    spreads = np.geomspace(0.1, 10.0, 200)
    shares = np.array(
        [(np.abs(error) <= NORMAL_90 * np.sqrt(s**2 * variance + noise)).mean() for s in spreads]
    )
    spread = float(spreads[min(int(np.searchsorted(shares, 0.9)), len(spreads) - 1)])
    root_mean_square = float(np.sqrt((error**2).sum(axis=1).mean()))
    return weights._replace(spread=spread), root_mean_square
