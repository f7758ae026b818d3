"""The kernel of a fin's forces, the Gaussian process beside its textbook formulas, and singular
matrices."""

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from finlab.fit.gaussian_process import GaussianProcess, ThrustKernel
from tests.fit.load_cell import commands

KERNEL = ThrustKernel(isotropic=0.7, directional=0.2, amplitude=0.5, frequency=0.8, turn=1.3)
"""The kernel, with another length in each direction."""
FEW_INPUTS = commands(12) / [0.6, 2.1, 1.0]
"""Inputs (12, 3), each of about unit size."""
INPUTS = commands(30) / [0.6, 2.1, 1.0]
"""Inputs (30, 3), each of about unit size."""
RNG = np.random.default_rng(0)
"""Of the values below."""
VALUES = RNG.standard_normal(30)
"""Observed values (30,)."""
VARIANCE = RNG.uniform(0.01, 0.1, 30)
"""Variances (30,) of their noise."""


def test_predictions_are_those_of_a_conditioned_normal_distribution() -> None:
    process = GaussianProcess(KERNEL, INPUTS, VALUES, VARIANCE)
    test = commands(8, seed=1) / [0.6, 2.1, 1.0]
    noisy = KERNEL.covariance(INPUTS, INPUTS) + np.diag(VARIANCE)
    gain = KERNEL.covariance(test, INPUTS) @ np.linalg.inv(noisy)
    left = KERNEL.covariance(test, test) - gain @ KERNEL.covariance(INPUTS, test)
    mean, deviation = process.predict(test)
    np.testing.assert_allclose(mean, gain @ VALUES, rtol=1e-6)
    np.testing.assert_allclose(process.expect(test), mean)
    np.testing.assert_allclose(deviation**2, np.diag(left), atol=1e-8)


def test_a_value_left_out_is_predicted_by_a_process_without_it() -> None:
    error, deviation = GaussianProcess(KERNEL, INPUTS, VALUES, VARIANCE).left_out()
    others = np.arange(30) != 7
    mean, own = GaussianProcess(KERNEL, INPUTS[others], VALUES[others], VARIANCE[others]).predict(
        INPUTS[7:8]
    )
    np.testing.assert_allclose(error[7], VALUES[7] - mean[0], rtol=1e-6)
    np.testing.assert_allclose(deviation[7] ** 2, own[0] ** 2 + VARIANCE[7], rtol=1e-6)


def test_repeated_commands_without_noise_are_bearable() -> None:
    twice = np.repeat(INPUTS, 40, axis=0)
    values = np.repeat(VALUES, 40)
    strong = KERNEL._replace(isotropic=1e4)
    mean, deviation = GaussianProcess(strong, twice, values, np.zeros(1200)).predict(INPUTS)
    assert np.isfinite(mean).all() and np.isfinite(deviation).all()


def test_the_gradient_is_that_of_the_covariance() -> None:
    weights = np.random.default_rng(0).standard_normal((12, 12))
    k, gradient = KERNEL.with_gradient(FEW_INPUTS, FEW_INPUTS)
    np.testing.assert_allclose(np.diag(k), KERNEL.variance(FEW_INPUTS))
    differences = approx_fprime(
        np.log(KERNEL),
        lambda logs: float(
            np.vdot(weights, ThrustKernel(*np.exp(logs)).covariance(FEW_INPUTS, FEW_INPUTS))
        ),
    )
    np.testing.assert_allclose(gradient(weights), differences, atol=1e-6)


def test_nothing_is_unknown_at_rest() -> None:
    rest = np.array([[0.0, 0.5, 0.3], [0.7, 0.0, 1.0]])
    assert not KERNEL.covariance(rest, FEW_INPUTS).any()


def test_only_the_directional_part_fades_with_the_turn() -> None:
    one = np.array([[0.5, 0.5, 0.0]])
    other = np.array([[0.5, 0.5, np.pi]])
    share = np.exp(-2.0 / KERNEL.turn**2)
    assert KERNEL.covariance(one, other)[0, 0] == pytest.approx((0.7 + 0.2 * share) / 16.0)
