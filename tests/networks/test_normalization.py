"""Wrench statistics, and the error measure that stands on them."""

import numpy as np
import pytest

from finlab.networks.normalization import STD_FLOOR, Normalization


def test_statistics_are_per_axis() -> None:
    rng = np.random.default_rng(0)
    spread, centre = np.array([1.0, 2, 3, 0.1, 0.2, 0.3]), np.array([5.0, 0, -1, 0, 2, 0])
    normalization = Normalization.of(rng.normal(size=(50_000, 6)) * spread + centre)
    np.testing.assert_allclose(normalization.mean, centre, atol=0.05)
    np.testing.assert_allclose(normalization.std, spread, rtol=0.02)


def test_single_precision_wrenches_are_counted_in_double() -> None:
    wrench = (1e4 + np.random.default_rng(1).normal(size=(10_000, 6))).astype(np.float32)
    normalization = Normalization.of(wrench)
    assert normalization.std.dtype == np.float64
    np.testing.assert_allclose(normalization.std, wrench.astype(np.float64).std(0), rtol=1e-12)


def test_an_axis_that_never_moves_is_not_divided_by_zero() -> None:
    wrenches = np.zeros((100, 6))
    wrenches[:, 0] = np.arange(100)
    normalization = Normalization.of(wrenches)
    assert (normalization.std[1:] == STD_FLOOR).all()
    assert np.isfinite(normalization.error(wrenches[3], wrenches[4]))


def test_error_is_the_norm_of_the_scaled_difference() -> None:
    normalization = Normalization(np.full(6, 9.0), np.array([1.0, 2, 1, 0.5, 1, 1]))
    target = np.array([1.0, 2, 3, 4, 5, 6])
    assert normalization.error(target + [3, 0, 0, 2, 0, 0], target) == pytest.approx(5.0)
    assert normalization.error(target, target) == 0.0
    many = np.stack([target, target + [0, 4, 0, 0, 0, 0]])
    np.testing.assert_allclose(normalization.error(many[None], target), [[0.0, 2.0]])
