"""The filter of finlab/core/src/kalman_filter.c against the textbook's matrices."""

import numpy as np
import pytest

from finlab.arrays import Array
from finlab.core import library
from finlab.core.shared_array import SharedArray


def random_covariance(rng: np.random.Generator, size: int) -> Array:
    """A positive definite matrix (size, size)."""
    root = rng.standard_normal((size, size))
    return np.asarray(root @ root.T + 0.1 * np.eye(size))


@pytest.mark.parametrize("size", [1, 4, 9, 16])
def test_a_prediction_is_that_of_the_matrices(size: int) -> None:
    rng = np.random.default_rng(size)
    before = random_covariance(rng, size)
    F = rng.standard_normal((size, size))
    F[rng.random((size, size)) < 0.5] = 0.0
    Q = rng.uniform(0.0, 1.0, size)
    transition = SharedArray(F)
    noise = SharedArray(Q)
    covariance = SharedArray(before)
    library().fl_kalman_predict(transition.address, noise.address, size, covariance.address)
    np.testing.assert_allclose(covariance.array, F @ before @ F.T + np.diag(Q), atol=1e-11)


@pytest.mark.parametrize(("first", "last"), [(0, 4), (3, 4), (1, 3), (2, 2)])
def test_measurements_one_by_one_are_all_at_once(first: int, last: int) -> None:
    """Against S = H P H^T + R, K = P H^T S^-1, x + K innovation, P - K H P."""
    rng = np.random.default_rng(last)
    size = 9
    before = random_covariance(rng, size)
    R = rng.uniform(0.01, 1.0, 4)
    x = rng.standard_normal(size)
    innovation = rng.standard_normal(4)
    variance = SharedArray(R)
    measured = SharedArray(innovation)
    state = SharedArray(x)
    covariance = SharedArray(before)
    library().fl_kalman_correct(
        variance.address, measured.address, first, last, size, state.address, covariance.address
    )
    H = np.eye(size)[first:last]
    S = H @ before @ H.T + np.diag(R[first:last])
    K = before @ H.T @ np.linalg.inv(S)
    np.testing.assert_allclose(state.array, x + K @ innovation[first:last], atol=1e-11)
    np.testing.assert_allclose(covariance.array, before - K @ H @ before, atol=1e-11)
