"""Answers of method `dual` in torch, with their derivatives by the wrench: what trains through an
allocation, such as a controller, needs them.

The multipliers of an answer are where the residual is 0 (Eq. 6), r(lambda, w) = 0. So whatever
Newton's method began at, by the theorem of implicit functions, with G of Eq. 7,

    d lambda / dw = G^-1,    dy_i / dw = (dy_i / ds) B_i' G^-1,    dP / dw = lambda'

The last one is the meaning of a multiplier: what one more unit of an axis costs. Where limits leave
nothing that moves along some direction, G is singular, and its pseudo-inverse stands for the
inverse: a wrench that wants more there gets none, and its derivative is 0.
"""

from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from finlab.arrays import Array
from finlab.errors import AllocationError
from finlab.research.distilled.actuator_tokens import RobotTokens
from finlab.research.distilled.starts import Start

MOST_STEPS = 200
"""Of Newton's method."""
SINGULAR = 1e-12
"""Eigenvalues of G in scaled axes, over the largest one, that count as 0."""


class DifferentiableAnswers(NamedTuple):
    """Answers to N wrenches, as tensors with derivatives by the wrenches."""

    force: Tensor
    """(N, n, 2) [N] along the rows of each actuator."""
    power: Tensor
    """Least power (N,) [W], g of Eq. 3."""
    multipliers: Tensor
    """lambda (N, 6) [W/N, W/(N m)]."""


def allocate(
    robot: RobotTokens, wrench: Tensor, start: Start | None = None
) -> DifferentiableAnswers:
    """Answers wrenches within reach.

    Args:
        robot: in its state of losses.
        wrench: desired (N, 6) [N, N m], of any floating type.
        start: gives the multipliers to begin with; None for Newton's own.

    Returns:
        Forces of least power, in double precision, with their derivatives.

    Raises:
        AllocationError: a wrench is beyond reach, where forces have no derivative of this kind.
    """
    answers = _Answer.apply(wrench.double(), robot, start)  # type: ignore[no-untyped-call]
    return DifferentiableAnswers(*answers)


class _Answer(torch.autograd.Function):
    """The answers, and their derivatives by the theorem of implicit functions."""

    @staticmethod
    def forward(
        ctx: Any, wrench: Tensor, robot: RobotTokens, start: Start | None
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Finds forces (N, n, 2), powers (N,) and multipliers (N, 6)."""
        wanted = wrench.detach().cpu().numpy()
        first = None if start is None else start.multipliers(wanted)
        compiled = robot.compiled
        points = compiled.core.dual_points(wanted, first, MOST_STEPS, robot.conditions)
        left = np.abs(points.residual / compiled.axis_scale).max(axis=1, initial=0.0)
        outside = wanted - points.residual - _given(robot, points.force)
        left += np.abs(outside / compiled.axis_scale).max(axis=1, initial=0.0)
        if (left > 1e-9).any():
            worst = int(left.argmax())
            raise AllocationError(
                f"wrench {worst} of {len(wanted)} is beyond reach: the forces miss it by "
                f"{left[worst]:.2g} of what the robot can push; scale it down, or allocate with a "
                "policy and without derivatives"
            )
        by_price = np.empty((*points.slope.shape[:2], 2, 2))  # dy/ds
        by_price[..., 0, 0] = points.slope[..., 0]
        by_price[..., 0, 1] = by_price[..., 1, 0] = points.slope[..., 1]
        by_price[..., 1, 1] = points.slope[..., 2]
        multipliers = torch.from_numpy(points.multipliers)
        ctx.robot = robot
        ctx.save_for_backward(torch.from_numpy(by_price), multipliers)
        return torch.from_numpy(points.force), torch.from_numpy(points.dual_value), multipliers

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None, None]:
        """The gradient by the wrench, of those by forces, powers and multipliers."""
        by_price, multipliers = ctx.saved_tensors
        by_force, by_power, by_multipliers = gradients
        B = torch.from_numpy(_working(ctx.robot))  # (n, 2, 6)
        scale = torch.from_numpy(ctx.robot.compiled.axis_scale)
        scaled = B / scale
        G = torch.einsum("iaj,tiab,ibk->tjk", scaled, by_price, scaled)  # Eq. 7
        inverse = torch.linalg.pinv(G, rtol=SINGULAR, hermitian=True)
        by_lambda = torch.einsum("tia,tiab,ibk->tk", by_force, by_price, scaled)
        by_lambda = by_lambda + by_multipliers / scale
        through = torch.einsum("tk,tkj->tj", by_lambda, inverse) / scale
        return through + by_power[:, None] * multipliers, None, None


def _working(robot: RobotTokens) -> Array:
    """Effectiveness (n, 2, 6) of the actuators, 0 of lost ones."""
    effectiveness = np.zeros_like(robot.compiled.effectiveness)
    effectiveness[robot.works] = robot.compiled.effectiveness[robot.works]
    return effectiveness


def _given(robot: RobotTokens, force: Array) -> Array:
    """Wrenches (N, 6) [N, N m] of forces, with the wrench beside them."""
    given: Array = np.einsum("tia,iak->tk", force, _working(robot))
    return given + robot.compiled.wrench_offset
