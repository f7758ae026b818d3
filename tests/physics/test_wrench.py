"""Wrenches of forces: symmetries, derivatives, numpy against tensors."""

import math

import numpy as np
import pytest
import torch

from finlab.layout import FinModelSpec
from finlab.layout.effectiveness import body_force, force_effectiveness, wrench_of_forces
from finlab.physics import make_law

F64 = torch.float64
"""Double precision of torch."""
DRAG = make_law(FinModelSpec())
"""The law of the fins."""


def drag_wrench(command, position, angle):
    """Wrenches of fins that obey this law."""
    return wrench_of_forces(DRAG.force(command), force_effectiveness(position, angle))


@pytest.fixture
def robots():
    """A batch of 6 random robots with 5 fins: command, position, mounting angle."""
    generator = torch.Generator().manual_seed(0)
    unit = torch.rand(6, 5, 7, generator=generator, dtype=F64)
    command = torch.tensor([0.05, 0.1, -math.pi]) + unit[..., :3] * torch.tensor(
        [0.7, 2.5, 2 * math.pi], dtype=F64
    )
    return command, unit[..., 3:6] - 0.5, (2 * unit[..., 6] - 1) * math.pi


def frames(angle):
    """Axes of fins with horizontal shafts, (..., 3, 3)."""
    sin = torch.sin(angle)
    cos = torch.cos(angle)
    zero = torch.zeros_like(angle)
    one = torch.ones_like(angle)
    rows = [(cos, sin, zero), (-sin, cos, zero), (zero, zero, one)]
    return torch.stack([torch.stack(row, -1) for row in rows], -2)


def test_fin_axes_in_the_body_frame():
    angle = torch.tensor([0.0, math.pi / 2, -2.0], dtype=F64)
    for i, axis in enumerate([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]):
        got = body_force(torch.tensor([axis] * 3, dtype=F64), frames(angle))
        sin = torch.sin(angle)
        cos = torch.cos(angle)
        zero = torch.zeros_like(sin)
        one = torch.ones_like(sin)
        expected = [(cos, sin, zero), (-sin, cos, zero), (zero, zero, one)][i]
        torch.testing.assert_close(got, torch.stack(expected, -1))


def test_turning_the_whole_robot_turns_the_wrench(robots):
    command, position, angle = robots
    turn = 0.8
    c = math.cos(turn)
    s = math.sin(turn)
    rotation = torch.tensor([[c, -s, 0], [s, c, 0], [0, 0, 1]], dtype=F64)
    wrench = drag_wrench(command, position, angle)
    turned = drag_wrench(command, position @ rotation.T, angle + turn)
    torch.testing.assert_close(turned[:, :3], wrench[:, :3] @ rotation.T)
    torch.testing.assert_close(turned[:, 3:], wrench[:, 3:] @ rotation.T)


def test_the_wrench_is_differentiable_by_command_and_geometry(robots):
    inputs = tuple(part[:1, :2].clone().requires_grad_() for part in robots)
    assert torch.autograd.gradcheck(lambda u, r, a: drag_wrench(u, r, a), inputs)


def test_arrays_and_tensors_give_the_same_wrench(robots):
    tensors = drag_wrench(*robots).numpy()
    command, position, angle = (part.numpy() for part in robots)
    arrays = drag_wrench(command, position, angle)
    np.testing.assert_allclose(arrays, tensors, rtol=1e-13, atol=1e-14)
    # By hand: forces in the body frame, and their moments.
    force = body_force(DRAG.force(command), frames(torch.from_numpy(angle)).numpy())
    np.testing.assert_allclose(arrays[:, :3], force.sum(1), atol=1e-14)
    np.testing.assert_allclose(arrays[:, 3:], np.cross(position, force).sum(1), atol=1e-14)
