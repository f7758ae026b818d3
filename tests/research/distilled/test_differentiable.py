"""Derivatives of answers by the wrench, judged by finite differences of answers; begun anywhere."""

import numpy as np
import pytest
import torch
from torch import Tensor

from finlab.allocation import Allocator
from finlab.errors import AllocationError
from finlab.research.distilled.actuator_tokens import RobotTokens
from finlab.research.distilled.differentiable import allocate
from finlab.research.distilled.exact_answers import answers_of
from finlab.research.distilled.starts import NearestStart
from tests.research.distilled.robots import mixed_robot, six_thrusters

STEP = 1e-5
"""Of finite differences, over what the robot can push along an axis."""


def numerical_jacobian(robot: RobotTokens, wrench: Tensor, part: int) -> Tensor:
    """Derivatives (N, ..., 6) of a part of the answers by the wrench."""
    slopes = []
    for k in range(6):
        move = torch.zeros(6, dtype=torch.float64)
        move[k] = STEP * robot.compiled.axis_scale[k]
        difference = allocate(robot, wrench + move)[part] - allocate(robot, wrench - move)[part]
        slopes.append(difference / (2.0 * move[k]))
    return torch.stack(slopes, dim=-1)


@pytest.mark.parametrize("number", range(3))
def test_slopes_are_those_of_finite_differences(number: int) -> None:
    layout = mixed_robot(number)
    lost = np.arange(layout.n) == 1 if number == 2 else None
    stored = answers_of(layout, lost, 12, np.random.default_rng(number))
    robot = stored.robot
    wrench = torch.from_numpy(0.6 * stored.wrench).requires_grad_()
    answers = allocate(robot, wrench, NearestStart(stored))
    rng = np.random.default_rng(5)
    for part, values in enumerate(answers):
        weight = torch.from_numpy(rng.normal(size=values.shape))
        (slope,) = torch.autograd.grad((weight * values).sum(), wrench, retain_graph=True)
        jacobian = numerical_jacobian(robot, wrench.detach(), part)
        dims = tuple(range(1, values.dim()))
        expected = (weight[..., None] * jacobian).sum(dims) if dims else weight[:, None] * jacobian
        size = expected.norm(dim=1).median()
        # Where a limit begins between both points the difference is that of neither side.
        error = (slope - expected).norm(dim=1) / size
        assert error.median() < 1e-5
        assert (error < 1e-3).sum() >= len(error) - 2


def test_a_multiplier_is_what_one_more_unit_costs() -> None:
    layout = six_thrusters()
    stored = answers_of(layout, None, 6, np.random.default_rng(0))
    wrench = torch.from_numpy(stored.wrench).requires_grad_()
    answers = allocate(stored.robot, wrench)
    (slope,) = torch.autograd.grad(answers.power.sum(), wrench)
    torch.testing.assert_close(slope, answers.multipliers.detach(), rtol=1e-9, atol=1e-12)
    power = Allocator(layout).allocate_batch(stored.wrench).power
    np.testing.assert_allclose(answers.power.detach().numpy(), power, 1e-6)


def test_a_wrench_beyond_reach_is_refused_in_a_sentence() -> None:
    stored = answers_of(six_thrusters(), None, 2, np.random.default_rng(0))
    with pytest.raises(AllocationError, match="wrench 1 of 2 is beyond reach"):
        allocate(stored.robot, torch.from_numpy(stored.wrench * [[0.5], [100.0]]))
