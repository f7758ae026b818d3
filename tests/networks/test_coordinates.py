"""Normalized coordinates and clamps, for arrays and for tensors."""

import math

import numpy as np
import pytest
import torch

from finlab.allocation.levenberg_marquardt import CommandProblem
from finlab.networks.normalization import to_command, to_normalized

LOWER = torch.tensor([[0.05, 0.1, -math.pi], [0.1, 0.2, 0.5], [0.3, 0.7, -2.5]], dtype=torch.float64)
UPPER = torch.tensor([[0.6, 2.1, math.pi], [0.5, 1.0, 2.0], [0.3, 0.7, -2.0]], dtype=torch.float64)


def feasible(command: np.ndarray, lower: torch.Tensor, upper: torch.Tensor) -> np.ndarray:
    """Commands inside limits, as the refinement of commands puts them there."""
    low, high = lower.numpy(), upper.numpy()
    turns = high[:, 2] - low[:, 2] >= 2.0 * math.pi - 1e-9
    return CommandProblem(None, np.zeros((len(low), 3, 6)), low, high, turns).feasible(command)  # type: ignore[arg-type]


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
    clamped = feasible(np.array([[0.3, 0.7, direction]]), LOWER[fin : fin + 1], UPPER[fin : fin + 1])
    assert clamped[0, 2] == pytest.approx(expected)


def test_clamped_commands_keep_their_limits_and_inner_ones_stay() -> None:
    rng, lower, upper = np.random.default_rng(0), LOWER.numpy(), UPPER.numpy()
    clamped = feasible(5.0 * rng.standard_normal((500, 3, 3)), LOWER, UPPER)
    assert (clamped >= lower).all() and (clamped <= upper).all()
    inner = lower + rng.random((500, 3, 3)) * (upper - lower)
    np.testing.assert_allclose(feasible(inner, LOWER, UPPER), inner, atol=1e-12)


def test_arrays_are_answered_as_tensors() -> None:
    command = np.random.default_rng(0).normal(size=(50, 3, 3)) * 5
    lower, upper = LOWER.numpy(), UPPER.numpy()
    for function in (to_normalized, to_command):
        expected = function(torch.from_numpy(command), LOWER, UPPER).numpy()
        np.testing.assert_allclose(function(command, lower, upper), expected, rtol=1e-12)
        single = function(*(part.astype(np.float32) for part in (command, lower, upper)))
        assert single.dtype == np.float32
