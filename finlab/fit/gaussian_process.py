"""One component of a fin's force as a Gaussian process over its commands; scikit-learn does the work."""

import warnings

import numpy as np
from scipy.linalg import cho_solve, solve_triangular
from scipy.optimize import minimize
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import WhiteKernel

from finlab.arrays import Array
from finlab.fit.thrust_kernel import ThrustKernel

TUNED_ON = 250
"""Most samples on which the kernel's numbers are fitted; the time grows with their cube."""
NOISE = (1e-8, 1.0)
"""Ends of the fitted variance of the noise, over the largest force squared."""

TAILS = 5.0
"""Degrees of freedom of the noise while wild values are looked for."""


class Component:
    """Force along one axis, or power, over its scale: mean, standard deviation and what it cannot explain."""

    def __init__(
        self,
        inputs: Array,
        values: Array,
        variance: Array | None = None,
        size: Array | None = None,
        wild: bool = False,
    ) -> None:
        """Takes scaled inputs (n, 3) as `ThrustKernel` does, values (n,), and their noise's variance (n,).

        Where the variance is not known, it is found from the errors of a first fit, made as if the noise were
        the same everywhere: it has a part that is, and a part that grows with the `size` (n,) of the whole
        force, by default that of the value. With `wild`, a few values may be far off without making the
        others' noise larger.
        """
        self._noise = 0.0, 0.0
        if variance is None:
            error, _ = _left_out(_tuned(inputs, values, None), values)
            size = np.asarray(values - error) if size is None else size
            self._noise = _noise_of(error, size, wild)
            variance = self._noise_at(size)
        self._process = _tuned(inputs, values, variance)
        self._inputs, self.variance = inputs, variance
        self.left_out, self.left_out_deviation = _left_out(self._process, values)
        """Error of each value (n,) under the fit to all others, and what its standard deviation should be,
        noise included."""
        self.mean = np.asarray(values - self.left_out)
        """Each value (n,) as all others predict it."""

    def predict(self, inputs: Array) -> tuple[Array, Array]:
        """Returns the mean and its standard deviation (m,) at inputs (m, 3), the noise not counted."""
        mean, deviation = self._process.predict(inputs, return_std=True)
        return np.asarray(mean), np.asarray(deviation)

    def expect(self, inputs: Array) -> Array:
        """Returns the mean (m,) alone at inputs (m, 3); its deviation takes a hundred times as long."""
        return np.asarray(self._process.predict(inputs))

    def unseen(self, inputs: Array, values: Array, size: Array | None = None) -> tuple[Array, Array]:
        """Returns the errors (m,) of values that the process has not seen, and what their standard deviation
        should be with noise of the same kind; `size` (m,) as above, by default that of the prediction."""
        mean, deviation = self.predict(inputs)
        noise = self._noise_at(mean if size is None else size)
        return np.asarray(values - mean), np.sqrt(deviation**2 + noise)

    def _noise_at(self, size: Array) -> Array:
        even, grown = self._noise
        return np.asarray(even + grown * size**2)

    def covariance(self, inputs: Array) -> Array:
        """Returns the covariance (m, m) that is left after the measurements."""
        kernel = self._process.kernel_
        known = solve_triangular(self._process.L_, kernel(self._inputs, inputs), lower=True)
        left: Array = kernel(inputs) - known.T @ known
        return left


def _tuned(inputs: Array, values: Array, variance: Array | None) -> GaussianProcessRegressor:
    """The process with the numbers that make the values most likely, by up to `TUNED_ON` of them."""
    few = np.linspace(0, len(values) - 1, min(len(values), TUNED_ON)).astype(int)
    kernel = ThrustKernel() if variance is not None else ThrustKernel() + WhiteKernel(1e-3, NOISE)
    alpha = np.full(len(values), 1e-10) if variance is None else variance
    with warnings.catch_warnings():
        # A number at the end of its range means: this fin does not vary that way.
        warnings.simplefilter("ignore", ConvergenceWarning)
        process = GaussianProcessRegressor(kernel, alpha=alpha[few])
        process.fit(inputs[few], values[few])
        if len(few) < len(values):
            process = GaussianProcessRegressor(process.kernel_, alpha=alpha, optimizer=None)
            process.fit(inputs, values)
    return process


def _left_out(process: GaussianProcessRegressor, values: Array) -> tuple[Array, Array]:
    """Errors (n,) of values under the process of all others, and the standard deviations they should have."""
    inverse = cho_solve((process.L_, True), np.eye(len(values)))
    own = np.diag(inverse)
    return np.asarray(inverse @ values / own), np.asarray(1.0 / np.sqrt(own))


def _noise_of(error: Array, size: Array, wild: bool) -> tuple[float, float]:
    """The a and b of the noise's variance a + b size^2 under which errors are most likely: they are normal,
    or with `wild` follow Student's t with `TAILS` degrees of freedom."""
    usual = float(np.median(error**2)) / 0.455 + 1e-12

    def unlikely(logs: Array) -> float:
        variance = np.exp(logs[0]) + np.exp(logs[1]) * size**2
        share = error**2 / variance
        tails = (TAILS + 1.0) * np.log1p(share / TAILS) if wild else share
        return float(np.sum(np.log(variance) + tails))

    start = np.log([0.5 * usual, 0.5 * usual / (float(np.mean(size**2)) + 1e-12)])
    found = minimize(unlikely, start, method="Nelder-Mead").x
    even, grown = np.exp(np.maximum(found, np.log(1e-3 * usual)))
    return float(even), float(grown)
