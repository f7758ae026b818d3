"""Gaussian processes over a fin's commands: the kernel, and one component of a force as a process.

See C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning, 2006: the
predictions are their equations 2.25 and 2.26, the likelihood 2.30 and 5.9, the errors of samples
left out 5.12.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.optimize import minimize

from finlab.arrays import Array

MAX_TUNING_SAMPLES = 250
"""Most samples on which the hyperparameters are fitted; the time grows with their cube."""
NOISE_BOUNDS = (1e-8, 1.0)
"""Bounds of the fitted variance of the noise, over the largest force squared."""
NOISE_START = 1e-3
"""The variance of the noise at which the fit begins, over the largest force squared."""
JITTER = 1e-10
"""Added to every variance, so that samples at the same command leave the covariance regular."""
NOISE_ROUNDS = 2
"""Times that the noise is estimated from the errors of the fit before."""
DEGREES_OF_FREEDOM = 5.0
"""Degrees of freedom of Student's t, the distribution of the noise while outliers are sought."""
BOUNDS = ((1e-3, 1e4), (1e-7, 1e2), (0.15, 20.0), (0.15, 20.0), (0.4, 30.0))
"""Bounds of the fitted hyperparameters, in the order of `ThrustKernel`."""
MEDIAN_OF_CHI_SQUARED = 0.455
"""Median of the square of a standard normal variable."""


class ThrustKernel(NamedTuple):
    """Covariance of a force in the frame that turns with the zero direction.

    k = s s' E (isotropic + directional D), where s = A f makes the force vanish at rest and grow
    from there, E falls with the distance of amplitudes and of frequencies, and D with the angle
    between the zero directions, so that a fin which is the same all round needs no more data than
    one direction. E is Matern's with 5/2: a smoother one underestimates the uncertainty of a fin
    that saturates. Inputs (n, 3) are amplitude and frequency over their largest values, and the
    zero direction [rad]. The fields are the hyperparameters.
    """

    isotropic: float = 1.0
    """Variance of what is the same in all zero directions, at s = 1."""
    directional: float = 0.05
    """Variance of what depends on the zero direction, at s = 1."""
    amplitude: float = 1.0
    """Length scale of amplitudes over the largest one."""
    frequency: float = 1.0
    """Length scale of frequencies over the largest one."""
    turn: float = 1.5
    """Length scale of zero directions [rad]."""

    def covariance(self, inputs: Array, inputs_2: Array) -> Array:
        """Returns k (n, m) between inputs (n, 3) and inputs (m, 3)."""
        return self.with_gradient(inputs, inputs_2)[0]

    def with_gradient(
        self, inputs: Array, inputs_2: Array
    ) -> tuple[Array, Callable[[Array], Array]]:
        """Returns the covariance and its derivatives.

        Args:
            inputs: (n, 3).
            inputs_2: (m, 3).

        Returns:
            k (n, m), and a function from weights W (n, m) to the derivatives (5,) of the sum of
            W k by the logarithms of the hyperparameters.
        """
        # Squared distances (n, m) over the length scales; that of directions is along the chord.
        a = (np.subtract.outer(inputs[:, 0], inputs_2[:, 0]) / self.amplitude) ** 2
        f = (np.subtract.outer(inputs[:, 1], inputs_2[:, 1]) / self.frequency) ** 2
        angle = np.subtract.outer(inputs[:, 2], inputs_2[:, 2])
        phi = 2.0 * (1.0 - np.cos(angle)) / self.turn**2
        s = inputs[:, 0] * inputs[:, 1]
        s_2 = inputs_2[:, 0] * inputs_2[:, 1]
        # Matern's kernel with 5/2: (1 + d + d^2 / 3) exp(-d), d = sqrt(5) times the distance.
        distance = np.sqrt(5.0 * (a + f))
        decayed = np.multiply.outer(s, s_2) * np.exp(-distance)
        matern = decayed * (1.0 + distance + distance**2 / 3.0)
        by_direction = self.directional * np.exp(-0.5 * phi)
        variance = self.isotropic + by_direction

        def gradient(weights: Array) -> Array:
            weighted = weights * matern
            by_distance = weights * decayed * (1.0 + distance) * (5.0 / 3.0) * variance
            weighted_direction = weighted * by_direction
            return np.array(
                [
                    weighted.sum() * self.isotropic,
                    weighted_direction.sum(),
                    np.vdot(by_distance, a),
                    np.vdot(by_distance, f),
                    np.vdot(weighted_direction, phi),
                ]
            )

        return matern * variance, gradient

    def variance(self, inputs: Array) -> Array:
        """Returns the variances (n,) at inputs (n, 3)."""
        return np.asarray((inputs[:, 0] * inputs[:, 1]) ** 2 * (self.isotropic + self.directional))


class GaussianProcess:
    """A Gaussian process conditioned on values at inputs."""

    def __init__(self, kernel: ThrustKernel, inputs: Array, values: Array, variance: Array) -> None:
        """Conditions the process.

        Args:
            kernel: the covariance.
            inputs: inputs (n, 3) of the kernel.
            values: values (n,) there.
            variance: variance (n,) of their noise.
        """
        self._kernel = kernel
        self._inputs = inputs
        self._lower = _factor(kernel.covariance(inputs, inputs), variance)
        self._weights = cho_solve((self._lower, True), values)

    def expect(self, inputs: Array) -> Array:
        """Returns the mean (m,) at inputs (m, 3); its deviation takes a hundred times as long."""
        return np.asarray(self._kernel.covariance(inputs, self._inputs) @ self._weights)

    def predict(self, inputs: Array) -> tuple[Array, Array]:
        """Returns the mean (m,) and its standard deviation (m,) at inputs (m, 3), without noise."""
        between = self._kernel.covariance(self._inputs, inputs)
        explained = solve_triangular(self._lower, between, lower=True)
        variance = self._kernel.variance(inputs) - np.einsum("nm,nm->m", explained, explained)
        return np.asarray(self._weights @ between), np.sqrt(np.maximum(variance, 0.0))

    def left_out(self) -> tuple[Array, Array]:
        """Returns the leave-one-out error (n,) of each value, and its standard deviation (n,)."""
        precision = np.diag(_inverse(self._lower))
        return np.asarray(self._weights / precision), np.asarray(1.0 / np.sqrt(precision))


class Component:
    """A Gaussian process of one component of a force, or of power, with the noise of its samples.

    Attributes:
        variance: variance of the noise of each value (n,).
        left_out: leave-one-out error of each value (n,).
        left_out_deviation: its standard deviation (n,), noise included.
        mean: each value (n,) as all others predict it.
        standardized_error: leave-one-out error over its standard deviation under normal noise (n,).
        predict: as `GaussianProcess.predict`.
        expect: as `GaussianProcess.expect`.
    """

    def __init__(
        self, inputs: Array, values: Array, size: Array | None = None, is_heavy_tailed: bool = False
    ) -> None:
        """Fits the process.

        The noise's variance is estimated from the errors of a first fit with the same noise
        everywhere, and again from those of the second, which is nearer to small forces. It is
        a + b size^2.

        Args:
            inputs: inputs (n, 3) of `ThrustKernel`.
            values: values (n,) over their scale.
            size: size of the whole force (n,) with which the noise grows; that of the value when
                None.
            is_heavy_tailed: whether the noise follows Student's t, so that values far off count for
                less (O'Hagan 1979).
        """
        self._process = _maximize_likelihood(inputs, values, None)
        for _ in range(NOISE_ROUNDS):
            error, _ = self._process.left_out()
            force = np.asarray(values - error) if size is None else size
            constant, proportional = _noise_of(error, force, is_heavy_tailed)
            normal_variance = constant + proportional * force**2
            self.variance = normal_variance
            if is_heavy_tailed:
                # The weight of a value under Student's t with nu degrees of freedom.
                nu = DEGREES_OF_FREEDOM
                self.variance = normal_variance * (nu + error**2 / normal_variance) / (nu + 1.0)
            self._process = _maximize_likelihood(inputs, values, self.variance)
        self.left_out, self.left_out_deviation = self._process.left_out()
        self.mean = np.asarray(values - self.left_out)
        normal_deviation = np.sqrt(self.left_out_deviation**2 - self.variance + normal_variance)
        self.standardized_error = np.abs(self.left_out) / normal_deviation
        self.predict = self._process.predict
        self.expect = self._process.expect


def _maximize_likelihood(inputs: Array, values: Array, variance: Array | None) -> GaussianProcess:
    """The process with the hyperparameters of greatest likelihood, by up to `MAX_TUNING_SAMPLES` of
    the values (n,) at inputs (n, 3).

    Where the variance of the noise (n,) is None, it is one of the hyperparameters, and the same for
    all values.
    """
    chosen_rows = np.linspace(0, len(values) - 1, min(len(values), MAX_TUNING_SAMPLES)).astype(int)
    chosen_inputs = inputs[chosen_rows]
    chosen_values = values[chosen_rows]
    chosen_variance = None if variance is None else variance[chosen_rows]

    def negative_log_likelihood(logs: Array) -> tuple[float, Array]:
        covariance, gradient = ThrustKernel(*np.exp(logs[:5])).with_gradient(
            chosen_inputs, chosen_inputs
        )
        noise = (
            np.full(len(chosen_rows), np.exp(logs[5]))
            if chosen_variance is None
            else chosen_variance
        )
        lower = _factor(covariance, noise)
        weights = cho_solve((lower, True), chosen_values)
        derivative = _inverse(lower) - np.multiply.outer(weights, weights)
        derivatives = gradient(derivative)
        if chosen_variance is None:
            derivatives = np.append(derivatives, noise[0] * np.trace(derivative))
        misfit = 0.5 * chosen_values @ weights
        half_log_determinant = np.log(np.diag(lower)).sum()
        return float(misfit + half_log_determinant), 0.5 * derivatives

    start = list(ThrustKernel())
    bounds = list(BOUNDS)
    if chosen_variance is None:
        start = [*start, NOISE_START]
        bounds = [*bounds, NOISE_BOUNDS]
    logs = minimize(
        negative_log_likelihood,
        np.log(start),
        jac=True,
        method="L-BFGS-B",
        bounds=np.log(bounds).tolist(),
    ).x
    noise = np.full(len(values), np.exp(logs[5])) if variance is None else variance
    return GaussianProcess(ThrustKernel(*np.exp(logs[:5])), inputs, values, noise)


def _factor(covariance: Array, variance: Array) -> Array:
    """The lower Cholesky factor (n, n) of a covariance with noise; where rounding errors have made
    it indefinite, with as much more noise as it takes."""
    extra = JITTER
    while True:
        noisy = covariance + np.diag(variance + extra)
        try:
            return np.asarray(cholesky(noisy, lower=True, overwrite_a=True, check_finite=False))
        except np.linalg.LinAlgError:
            extra *= 100.0


def _inverse(lower: Array) -> Array:
    """The inverse (n, n) of the matrix that has a lower Cholesky factor (n, n)."""
    return np.asarray(cho_solve((lower, True), np.eye(len(lower)), check_finite=False))


def _noise_of(error: Array, size: Array, is_heavy_tailed: bool) -> tuple[float, float]:
    """The a and b of the noise's variance a + b size^2 under which errors (n,) are most likely.

    Errors are normal, or follow Student's t with `DEGREES_OF_FREEDOM` where `is_heavy_tailed`.
    """
    typical = float(np.median(error**2)) / MEDIAN_OF_CHI_SQUARED + 1e-12  # robust variance
    log_floor = np.log(1e-3 * typical)

    def terms(logs: Array) -> Array:
        # Neither part vanishes: where an axis has no force at all, errors are exactly 0.
        return np.asarray(np.exp(np.maximum(logs, log_floor)))

    def negative_log_likelihood(logs: Array) -> float:
        constant, proportional = terms(logs)
        variance = constant + proportional * size**2
        ratio = error**2 / variance
        if is_heavy_tailed:
            nu = DEGREES_OF_FREEDOM
            ratio = (nu + 1.0) * np.log1p(ratio / nu)
        return float(np.sum(np.log(variance) + ratio))

    start = np.log([0.5 * typical, 0.5 * typical / (float(np.mean(size**2)) + 1e-12)])
    constant, proportional = terms(minimize(negative_log_likelihood, start, method="Nelder-Mead").x)
    return float(constant), float(proportional)
