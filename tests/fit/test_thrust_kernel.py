"""The covariance of a fin's forces: its gradient, its rest, its unevenness."""

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from finlab.fit.gaussian_process import Pairs, ThrustKernel
from tests.fit.cell import commands

INPUTS = commands(12) / [0.6, 2.1, 1.0]
KERNEL = ThrustKernel(even=0.7, uneven=0.2, amplitude=0.5, frequency=0.8, turn=1.3)


def test_the_gradient_is_that_of_the_covariance() -> None:
    pairs, weights = Pairs(INPUTS, INPUTS), np.random.default_rng(0).standard_normal((12, 12))
    k, gradient = pairs.covariance(KERNEL)
    np.testing.assert_allclose(np.diag(k), KERNEL.variance(INPUTS))
    differences = approx_fprime(
        np.log(KERNEL), lambda logs: float(np.vdot(weights, pairs.covariance(ThrustKernel(*np.exp(logs)))[0]))
    )
    np.testing.assert_allclose(gradient(weights), differences, atol=1e-6)


def test_nothing_is_unknown_at_rest() -> None:
    rest = np.array([[0.0, 0.5, 0.3], [0.7, 0.0, 1.0]])
    assert not KERNEL.covariance(rest, INPUTS).any()


def test_only_the_uneven_part_fades_with_the_turn() -> None:
    one, other = np.array([[0.5, 0.5, 0.0]]), np.array([[0.5, 0.5, np.pi]])
    share = np.exp(-2.0 / KERNEL.turn**2)
    assert KERNEL.covariance(one, other)[0, 0] == pytest.approx((0.7 + 0.2 * share) / 16.0)
