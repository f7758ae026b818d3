"""Normalized coordinates, for arrays and for tensors."""

import math

import numpy as np
import torch

from finlab.networks.trained import to_command, to_normalized

LOWER = torch.tensor([[0.05, 0.1, -math.pi], [0.1, 0.2, 0.5], [0.3, 0.7, -2.5]], dtype=torch.float64)
UPPER = torch.tensor([[0.6, 2.1, math.pi], [0.5, 1.0, 2.0], [0.3, 0.7, -2.0]], dtype=torch.float64)


def test_normalized_coordinates_go_from_minus_one_to_one_and_back() -> None:
    torch.testing.assert_close(to_normalized(LOWER, LOWER, UPPER)[:2], -torch.ones(2, 3).double())
    torch.testing.assert_close(to_normalized(UPPER, LOWER, UPPER)[:2], torch.ones(2, 3).double())
    command = LOWER + 0.3 * (UPPER - LOWER)
    torch.testing.assert_close(to_command(to_normalized(command, LOWER, UPPER), LOWER, UPPER), command)


def test_a_range_of_no_width_normalizes_to_zero() -> None:
    assert to_normalized(LOWER, LOWER, UPPER)[2, :2].tolist() == [0.0, 0.0]


def test_arrays_are_answered_as_tensors() -> None:
    command = np.random.default_rng(0).normal(size=(50, 3, 3)) * 5
    lower, upper = LOWER.numpy(), UPPER.numpy()
    for function in (to_normalized, to_command):
        expected = function(torch.from_numpy(command), LOWER, UPPER).numpy()
        np.testing.assert_allclose(function(command, lower, upper), expected, rtol=1e-12)
        single = function(*(part.astype(np.float32) for part in (command, lower, upper)))
        assert single.dtype == np.float32
