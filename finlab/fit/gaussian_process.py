"""A Gaussian process over a fin's commands, its kernel, and one component of a force as such a
process.

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

TUNED_ON = 250
"""Most samples on which the kernel's numbers are fitted; the time grows with their cube."""
NOISE, FIRST_NOISE = (1e-8, 1.0), 1e-3
"""Ends of the fitted variance of the noise, over the largest force squared, and where the fit
begins."""
LEAST_NOISE = 1e-10
"""Added to every variance, so that samples at the same command leave the covariance regular."""
NOISE_ROUNDS = 2
"""Times that the noise is found from the errors of the fit before."""
TAILS = 5.0
"""Degrees of freedom of the noise while wild values are looked for."""
BOUNDS = ((1e-3, 1e4), (1e-7, 1e2), (0.15, 20.0), (0.15, 20.0), (0.4, 30.0))
"""Ends between which each number of the kernel is fitted."""


class ThrustKernel(NamedTuple):
    """Covariance of a force in the frame that turns with the zero direction.

    k = s s' E (even + uneven D), where s = A f makes the force vanish at rest and grow from there,
    E falls with the distance of amplitudes and of frequencies, and D with the angle between the
    zero directions, so that a fin which is the same all round needs no more data than one
    direction. E is Matern's with 5/2: a smoother one believes that it knows a fin which saturates
    better than it does. Inputs (n, 3) are amplitude and frequency over their largest values, and
    the zero direction [rad].
    """

    even: float = 1.0
    uneven: float = 0.05
    amplitude: float = 1.0
    """Length scale of amplitudes over the largest one."""
    frequency: float = 1.0
    """Length scale of frequencies over the largest one."""
    turn: float = 1.5
    """Length scale of zero directions [rad]."""

    def covariance(self, inputs: Array, others: Array) -> Array:
        """Returns k (n, m) between inputs (n, 3) and others (m, 3)."""
        return self.with_gradient(inputs, others)[0]

    def with_gradient(self, inputs: Array, others: Array) -> tuple[Array, Callable[[Array], Array]]:
        """Returns k (n, m), and a function from weights (n, m) to the derivatives (5,) of the sum
        of weights times k by the logarithms of the kernel's numbers."""
        apart = [np.subtract.outer(inputs[:, k], others[:, k]) for k in range(3)]
        a = (apart[0] / self.amplitude) ** 2
        f = (apart[1] / self.frequency) ** 2
        phi = 2.0 * (1.0 - np.cos(apart[2])) / self.turn**2
        distance = np.sqrt(5.0 * (a + f))
        bare = np.multiply.outer(inputs[:, 0] * inputs[:, 1], others[:, 0] * others[:, 1]) * np.exp(
            -distance
        )
        near = bare * (1.0 + distance + distance**2 / 3.0)
        uneven = self.uneven * np.exp(-0.5 * phi)
        share = self.even + uneven

        def gradient(weights: Array) -> Array:
            by_near = weights * near
            by_distance = weights * bare * (1.0 + distance) * (5.0 / 3.0) * share
            by_uneven = by_near * uneven
            sums = by_near.sum() * self.even, by_uneven.sum(), np.vdot(by_distance, a)
            return np.array([*sums, np.vdot(by_distance, f), np.vdot(by_uneven, phi)])

        return near * share, gradient

    def variance(self, inputs: Array) -> Array:
        """Returns the variances (n,) at inputs (n, 3)."""
        return np.asarray((inputs[:, 0] * inputs[:, 1]) ** 2 * (self.even + self.uneven))


class GaussianProcess:
    """Values at inputs, and what they tell of the values elsewhere."""

    def __init__(self, kernel: ThrustKernel, inputs: Array, values: Array, variance: Array) -> None:
        """Takes inputs (n, 3) as `ThrustKernel` does, values (n,) and the variance (n,) of their
        noise."""
        self._kernel = kernel
        self._inputs = inputs
        self._lower = _factor(kernel.covariance(inputs, inputs), variance)
        self._weights = cho_solve((self._lower, True), values)

    def expect(self, inputs: Array) -> Array:
        """Returns the mean (m,) at inputs (m, 3); its deviation takes a hundred times as long."""
        return np.asarray(self._kernel.covariance(inputs, self._inputs) @ self._weights)

    def predict(self, inputs: Array) -> tuple[Array, Array]:
        """Returns the mean and its standard deviation (m,) at inputs (m, 3), the noise not
        counted."""
        between = self._kernel.covariance(self._inputs, inputs)
        known = solve_triangular(self._lower, between, lower=True)
        left = self._kernel.variance(inputs) - np.einsum("nm,nm->m", known, known)
        return np.asarray(self._weights @ between), np.sqrt(np.maximum(left, 0.0))

    def left_out(self) -> tuple[Array, Array]:
        """Returns the error (n,) of each value under the process of all others, and the standard
        deviation that it should have."""
        own = np.diag(_inverse(self._lower))
        return np.asarray(self._weights / own), np.asarray(1.0 / np.sqrt(own))


class Component:
    """Force along one axis, or power, over its scale: mean, standard deviation and what it cannot
    explain."""

    def __init__(
        self, inputs: Array, values: Array, size: Array | None = None, wild: bool = False
    ) -> None:
        """Takes scaled inputs (n, 3) as `ThrustKernel` does, and values (n,).

        The noise's variance is found from the errors of a first fit, made as if the noise were the
        same everywhere, and again from those of the second, which is nearer to small forces: it has
        a part that is the same, and a part that grows with the `size` (n,) of the whole force, by
        default that of the value. With `wild`, the noise follows Student's t: values that are far
        off count for less (O'Hagan 1979).
        """
        self._process = _tuned(inputs, values, None)
        for _ in range(NOISE_ROUNDS):
            error, _ = self._process.left_out()
            force = np.asarray(values - error) if size is None else size
            even, grown = _noise_of(error, force, wild)
            usual = even + grown * force**2
            self.variance = usual * (TAILS + error**2 / usual) / (TAILS + 1.0) if wild else usual
            """Of the noise of each value (n,)."""
            self._process = _tuned(inputs, values, self.variance)
        self.left_out, self.left_out_deviation = self._process.left_out()
        """Error of each value (n,) under the fit to all others, and what its standard deviation
        should be, noise included."""
        self.mean = np.asarray(values - self.left_out)
        """Each value (n,) as all others predict it."""
        self.strange = np.abs(self.left_out) / np.sqrt(
            self.left_out_deviation**2 - self.variance + usual
        )
        """Error of each value (n,) over what it should be."""
        self.predict = self._process.predict
        self.expect = self._process.expect


def _tuned(inputs: Array, values: Array, variance: Array | None) -> GaussianProcess:
    """The process whose numbers make up to `TUNED_ON` of the values most likely; where the variance
    of the noise is not known, it is one of them, and the same for all values."""
    few = np.linspace(0, len(values) - 1, min(len(values), TUNED_ON)).astype(int)
    places = inputs[few]
    chosen = values[few]
    known = None if variance is None else variance[few]

    def unlikely(logs: Array) -> tuple[float, Array]:
        covariance, gradient = ThrustKernel(*np.exp(logs[:5])).with_gradient(places, places)
        noise = np.full(len(few), np.exp(logs[5])) if known is None else known
        lower = _factor(covariance, noise)
        weights = cho_solve((lower, True), chosen)
        curve = _inverse(lower) - np.multiply.outer(weights, weights)
        slopes = gradient(curve)
        if known is None:
            slopes = np.append(slopes, noise[0] * np.trace(curve))
        return float(0.5 * chosen @ weights + np.log(np.diag(lower)).sum()), 0.5 * slopes

    start = list(ThrustKernel())
    bounds = list(BOUNDS)
    if known is None:
        start = [*start, FIRST_NOISE]
        bounds = [*bounds, NOISE]
    logs = minimize(
        unlikely, np.log(start), jac=True, method="L-BFGS-B", bounds=np.log(bounds).tolist()
    ).x
    noise = np.full(len(values), np.exp(logs[5])) if variance is None else variance
    return GaussianProcess(ThrustKernel(*np.exp(logs[:5])), inputs, values, noise)


def _factor(covariance: Array, variance: Array) -> Array:
    """The lower Cholesky factor (n, n) of a covariance with noise; where rounding errors have made
    it indefinite, with as much more noise as it takes."""
    extra = LEAST_NOISE
    while True:
        noisy = covariance + np.diag(variance + extra)
        try:
            return np.asarray(cholesky(noisy, lower=True, overwrite_a=True, check_finite=False))
        except np.linalg.LinAlgError:
            extra *= 100.0


def _inverse(lower: Array) -> Array:
    return np.asarray(cho_solve((lower, True), np.eye(len(lower)), check_finite=False))


def _noise_of(error: Array, size: Array, wild: bool) -> tuple[float, float]:
    """The a and b of the noise's variance a + b size^2 under which errors are most likely: they are
    normal, or with `wild` follow Student's t with `TAILS` degrees of freedom."""
    usual = float(np.median(error**2)) / 0.455 + 1e-12
    least = np.log(1e-3 * usual)

    def noise(logs: Array) -> Array:
        # Neither part vanishes: where an axis has no force at all, errors are exactly 0.
        return np.asarray(np.exp(np.maximum(logs, least)))

    def unlikely(logs: Array) -> float:
        even, grown = noise(logs)
        variance = even + grown * size**2
        share = error**2 / variance
        tails = (TAILS + 1.0) * np.log1p(share / TAILS) if wild else share
        return float(np.sum(np.log(variance) + tails))

    start = np.log([0.5 * usual, 0.5 * usual / (float(np.mean(size**2)) + 1e-12)])
    even, grown = noise(minimize(unlikely, start, method="Nelder-Mead").x)
    return float(even), float(grown)
