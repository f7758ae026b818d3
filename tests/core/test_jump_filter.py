"""The filter of finlab/core/src/jump_filter.c and the evidence of jump_evidence.c against the
textbook's matrices."""

from typing import NamedTuple

import numpy as np
import pytest

from finlab.arrays import Array
from finlab.core import library
from finlab.core.shared_array import SharedArray

MOVING = 9
"""Numbers of a state that move by themselves."""
MOST = 5
"""Moments that there is memory for."""


class Filter(NamedTuple):
    """A filter of d numbers with jumps of c columns."""

    columns: Array
    state: SharedArray
    covariance: SharedArray
    sensitivity: SharedArray
    information: SharedArray
    score: SharedArray

    def copied(self) -> tuple[Array, ...]:
        """Its numbers."""
        return tuple(each.array.copy() for each in self[1:])


def random_filter(rng: np.random.Generator, d: int, c: int, active: int) -> Filter:
    """Numbers behind the first `active` are known exactly, and have jumped by their own column
    alone."""
    columns = rng.choice(np.arange(MOVING, d), size=c, replace=False).astype(np.int32)
    root = rng.standard_normal((active, active))
    P = np.zeros((d, d))
    P[:active, :active] = root @ root.T + 0.1 * np.eye(active)
    sensitivity = rng.standard_normal((d, MOST, c))
    sensitivity[active:] = 0.0
    for column, number in enumerate(columns.tolist()):
        if number >= active:
            sensitivity[number, :, column] = 1.0
    information = rng.standard_normal((MOST, c, c))
    return Filter(
        columns,
        SharedArray(rng.standard_normal(d)),
        SharedArray(P),
        SharedArray(sensitivity),
        SharedArray(information + information.swapaxes(1, 2)),
        SharedArray(rng.standard_normal((MOST, c))),
    )


@pytest.mark.parametrize(("d", "c", "active", "used"), [(20, 4, 20, 3), (60, 30, 50, 5)])
def test_a_prediction_is_that_of_the_matrices(d: int, c: int, active: int, used: int) -> None:
    """P <- F P F^T + Q and Sigma <- F Sigma, where F is 1 but for its first rows."""
    rng = np.random.default_rng(d)
    made = random_filter(rng, d, c, active)
    _, P, sensitivity, _, _ = made.copied()
    F = np.eye(d)
    F[:MOVING] = rng.standard_normal((MOVING, d))
    transition = SharedArray(F[:MOVING])
    noise = rng.uniform(0.0, 1.0, d)
    noise[active:] = 0.0
    Q = SharedArray(noise)
    limit = SharedArray(np.full(d, np.inf))
    library().fl_jumps_predict(
        transition.address,
        Q.address,
        limit.address,
        made.columns.ctypes.data,
        MOST,
        used,
        d,
        active,
        c,
        made.covariance.address,
        made.sensitivity.address,
    )
    np.testing.assert_allclose(made.covariance.array, F @ P @ F.T + np.diag(noise), atol=1e-11)
    expected = np.einsum("ij,jkl->ikl", F, sensitivity)
    np.testing.assert_allclose(made.sensitivity.array[:, :used], expected[:, :used], atol=1e-11)


def test_a_variance_stays_within_its_limit() -> None:
    """Rows and columns are scaled together: correlations stay."""
    rng = np.random.default_rng(1)
    d = 12
    made = random_filter(rng, d, 2, d)
    _, P, _, _, _ = made.copied()
    limit = np.full(d, np.inf)
    limit[10] = 0.25 * P[10, 10]
    transition = SharedArray(np.eye(d)[:MOVING])
    none = SharedArray(np.zeros(d))
    limits = SharedArray(limit)
    library().fl_jumps_predict(
        transition.address,
        none.address,
        limits.address,
        made.columns.ctypes.data,
        MOST,
        0,
        d,
        d,
        2,
        made.covariance.address,
        made.sensitivity.address,
    )
    scale = np.ones(d)
    scale[10] = 0.5
    np.testing.assert_allclose(made.covariance.array, P * np.outer(scale, scale), rtol=1e-12)


def corrected(made: Filter, rows: Array, innovation: Array, variance: Array, active: int) -> float:
    """Corrects a filter by a measurement; returns the squared innovation."""
    arrays = [SharedArray(each) for each in (rows, innovation, variance)]
    d = len(made.state.array)
    distance: float = library().fl_jumps_update(
        *(each.address for each in arrays),
        len(rows),
        1e6,
        made.columns.ctypes.data,
        MOST,
        MOST,
        d,
        active,
        len(made.columns),
        *(each.address for each in made[1:]),
    )
    return distance


@pytest.mark.parametrize(("d", "c", "active", "m"), [(20, 4, 20, 5), (90, 70, 80, 9)])
def test_a_correction_is_that_of_the_matrices(d: int, c: int, active: int, m: int) -> None:
    """S = H P H^T + R, K = P H^T S^-1; Lambda, eta and Sigma by V = H Sigma. The second case moves
    its moments in several parts."""
    rng = np.random.default_rng(m)
    made = random_filter(rng, d, c, active)
    state, P, sensitivity, information, score = made.copied()
    H = rng.standard_normal((m, d))
    H[0] = 0.0
    H[0, 3] = 1.0
    nu = rng.standard_normal(m)
    R = rng.uniform(0.1, 1.0, m)
    distance = corrected(made, H, nu, R, active)
    S = H @ P @ H.T + np.diag(R)
    K = P @ H.T @ np.linalg.inv(S)
    V = np.einsum("ij,jkl->kil", H, sensitivity)
    over_S = np.linalg.solve(S, V)
    assert distance == pytest.approx(nu @ np.linalg.solve(S, nu))
    after = [
        state + K @ nu,
        P - K @ H @ P,
        sensitivity - np.einsum("ij,kjl->ikl", K, V),
        information + V.swapaxes(1, 2) @ over_S,
        score + nu @ over_S,
    ]
    for got, expected in zip(made.copied(), after, strict=True):
        np.testing.assert_allclose(got, expected, atol=1e-9, rtol=1e-9)
    np.testing.assert_array_equal(made.covariance.array, made.covariance.array.T)


@pytest.mark.parametrize("innovation", [np.nan, 1e9])
def test_a_measurement_that_says_nothing_changes_nothing(innovation: float) -> None:
    made = random_filter(np.random.default_rng(0), 15, 3, 15)
    before = made.copied()
    H = np.eye(15)[3:8]
    assert corrected(made, H, np.full(5, innovation), np.ones(5), 15) == -1.0
    for got, expected in zip(made.copied(), before, strict=True):
        np.testing.assert_array_equal(got, expected)


def test_sums_of_odds_are_those_of_exponentials() -> None:
    """By groups of columns, over all rows; a group without odds has none."""
    values = SharedArray([[0.0, -700.0, 3.0, -np.inf], [1.0, -701.0, 900.0, -np.inf]])
    groups = np.array([0, 1, 0, 2], dtype=np.int32)
    tops = SharedArray(np.zeros(3))
    sums = SharedArray(np.zeros(3))
    library().fl_log_sums(values.address, 2, 4, groups.ctypes.data, 3, tops.address, sums.address)
    expected = [900.0, np.logaddexp(-700.0, -701.0), -np.inf]
    np.testing.assert_allclose(sums.array, expected, rtol=1e-14)
