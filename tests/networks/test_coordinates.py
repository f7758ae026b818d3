"""Normalized coordinates and clamps, for arrays and for tensors."""

import math

import numpy as np
import pytest
import torch

from finlab.networks.normalization import clamp_to_limits, to_command, to_normalized

LOWER = torch.tensor([[0.05, 0.1, -math.pi], [0.1, 0.2, 0.5], [0.3, 0.7, -2.5]], dtype=torch.float64)
UPPER = torch.tensor([[0.6, 2.1, math.pi], [0.5, 1.0, 2.0], [0.3, 0.7, -2.0]], dtype=torch.float64)


def test_normalized_coordinates_go_from_minus_one_to_one_and_back() -> None:
    torch.testing.assert_close(to_normalized(LOWER, LOWER, UPPER)[:2], -torch.ones(2, 3).double())
    torch.testing.assert_close(to_normalized(UPPER, LOWER, UPPER)[:2], torch.ones(2, 3).double())
    command = LOWER + 0.3 * (UPPER - LOWER)
    torch.testing.assert_close(to_command(to_normalized(command, LOWER, UPPER), LOWER, UPPER), command)


def test_a_range_of_no_width_normalizes_to_zero() -> None:
    assert to_normalized(LOWER, LOWER, UPPER)[2, :2].tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("fin", "direction", "expected"),
    [
        (0, 3.5, 3.5 - 2 * math.pi),  # a full circle: only the turn changes
        (0, -10.0, -10.0 + 4 * math.pi),
        (1, 1.2, 1.2),
        (1, 1.2 - 2 * math.pi, 1.2),
        (1, 2.4, 2.0),
        (1, 0.1, 0.5),
        (1, -2.0, 2.0),  # 2.5 before the start of the arc, but 2.28 after its end
        (1, -1.0, 0.5),
        (1, -math.pi + 0.1, 2.0),
        (2, math.pi, -2.5),  # across the seam, -2.5 is the nearer end of the arc
        (2, 0.0, -2.0),
    ],
)
def test_directions_are_clamped_as_angles(fin: int, direction: float, expected: float) -> None:
    command = torch.tensor([0.3, 0.7, direction], dtype=torch.float64)
    clamped = clamp_to_limits(command, LOWER[fin], UPPER[fin])
    assert clamped[2].item() == pytest.approx(expected)


def test_clamped_commands_keep_their_limits_and_inner_ones_stay() -> None:
    draw = torch.Generator().manual_seed(0)
    command = torch.randn(500, 3, 3, generator=draw, dtype=torch.float64) * 5
    clamped = clamp_to_limits(command, LOWER, UPPER)
    assert (clamped >= LOWER).all() and (clamped <= UPPER).all()
    inner = LOWER + torch.rand(500, 3, 3, generator=draw, dtype=torch.float64) * (UPPER - LOWER)
    torch.testing.assert_close(clamp_to_limits(inner, LOWER, UPPER), inner)


def test_arrays_are_answered_as_tensors() -> None:
    command = np.random.default_rng(0).normal(size=(50, 3, 3)) * 5
    lower, upper = LOWER.numpy(), UPPER.numpy()
    for function in (to_normalized, to_command, clamp_to_limits):
        expected = function(torch.from_numpy(command), LOWER, UPPER).numpy()
        np.testing.assert_allclose(function(command, lower, upper), expected, rtol=1e-12)
        single = function(*(part.astype(np.float32) for part in (command, lower, upper)))
        assert single.dtype == np.float32
