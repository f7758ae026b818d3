"""The covariance of a fin's forces: its slopes, its rest, its unevenness."""

import numpy as np
import pytest

from finlab.fit.thrust_kernel import ThrustKernel
from tests.fit.cell import commands

INPUTS = commands(12) / [0.6, 2.1, 1.0]
NUMBERS = {"even": 0.7, "uneven": 0.2, "amplitude": 0.5, "frequency": 0.8, "turn": 1.3}


def test_slopes_are_those_of_the_covariance() -> None:
    kernel = ThrustKernel(**NUMBERS)
    k, slopes = kernel(INPUTS, eval_gradient=True)
    np.testing.assert_allclose(k, kernel(INPUTS, INPUTS))
    np.testing.assert_allclose(np.diag(k), kernel.diag(INPUTS))
    step = 1e-6
    for i in range(len(NUMBERS)):  # scikit-learn sorts a kernel's numbers by name, and takes logarithms
        up, down = (kernel.clone_with_theta(kernel.theta + s * step * np.eye(5)[i]) for s in (1, -1))
        np.testing.assert_allclose(slopes[..., i], (up(INPUTS) - down(INPUTS)) / (2 * step), atol=1e-7)


def test_nothing_is_unknown_at_rest() -> None:
    rest = np.array([[0.0, 0.5, 0.3], [0.7, 0.0, 1.0]])
    assert not ThrustKernel(**NUMBERS)(rest, INPUTS).any()


def test_only_the_uneven_part_fades_with_the_turn() -> None:
    one, other = np.array([[0.5, 0.5, 0.0]]), np.array([[0.5, 0.5, np.pi]])
    share = np.exp(-2.0 / NUMBERS["turn"] ** 2)
    assert ThrustKernel(**NUMBERS)(one, other)[0, 0] == pytest.approx((0.7 + 0.2 * share) / 16.0)
