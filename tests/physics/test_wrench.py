"""Assembling wrenches: symmetries, padding, and the effectiveness matrix against differences."""

import math

import pytest
import torch

from finlab.physics import Drag, Lighthill, assemble_wrench, body_force, effectiveness_matrix

F64 = torch.float64


@pytest.fixture
def robots():
    """A batch of 6 random robots with 5 fins: command, position, mounting angle."""
    generator = torch.Generator().manual_seed(0)
    unit = torch.rand(6, 5, 7, generator=generator, dtype=F64)
    command = torch.tensor([0.05, 0.1, -math.pi]) + unit[..., :3] * torch.tensor(
        [0.7, 2.5, 2 * math.pi], dtype=F64
    )
    return command, unit[..., 3:6] - 0.5, (2 * unit[..., 6] - 1) * math.pi


def test_fin_axes_in_the_body_frame():
    angle = torch.tensor([0.0, math.pi / 2, -2.0], dtype=F64)
    for i, axis in enumerate([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]):
        got = body_force(torch.tensor([axis] * 3, dtype=F64), angle)
        sin, cos = torch.sin(angle), torch.cos(angle)
        zero, one = torch.zeros_like(sin), torch.ones_like(sin)
        expected = [(cos, sin, zero), (-sin, cos, zero), (zero, zero, one)][i]
        torch.testing.assert_close(got, torch.stack(expected, -1))


def test_the_order_of_fins_does_not_matter(robots):
    command, position, angle = robots
    order = torch.tensor([3, 0, 4, 1, 2])
    torch.testing.assert_close(
        assemble_wrench(Drag(), command, position, angle),
        assemble_wrench(Drag(), command[:, order], position[:, order], angle[:, order]),
    )


def test_turning_the_whole_robot_turns_the_wrench(robots):
    command, position, angle = robots
    turn = 0.8
    c, s = math.cos(turn), math.sin(turn)
    rotation = torch.tensor([[c, -s, 0], [s, c, 0], [0, 0, 1]], dtype=F64)
    wrench = assemble_wrench(Drag(), command, position, angle)
    turned = assemble_wrench(Drag(), command, position @ rotation.T, angle + turn)
    torch.testing.assert_close(turned[:, :3], wrench[:, :3] @ rotation.T)
    torch.testing.assert_close(turned[:, 3:], wrench[:, 3:] @ rotation.T)


def test_mirroring_left_and_right_mirrors_the_wrench(robots):
    """y -> -y: the azimuth of the shaft changes sign, so e_h is reversed, and cos(zero direction) with it."""
    command, position, angle = robots
    mirrored = command.clone()
    mirrored[..., 2] = math.pi - command[..., 2]
    flip = torch.tensor([1.0, -1.0, 1.0], dtype=F64)
    wrench = assemble_wrench(Drag(), command, position, angle)
    other = assemble_wrench(Drag(), mirrored, position * flip, -angle)
    torch.testing.assert_close(other[:, :3], wrench[:, :3] * flip)
    torch.testing.assert_close(other[:, 3:], -wrench[:, 3:] * flip)  # a torque is an axial vector


def test_turning_a_shaft_half_a_turn_and_reversing_the_fin_changes_nothing(robots):
    command, position, angle = robots
    other = command.clone()
    other[..., 2] = math.pi - command[..., 2]
    torch.testing.assert_close(
        assemble_wrench(Drag(), command, position, angle),
        assemble_wrench(Drag(), other, position, angle + math.pi),
    )


@pytest.mark.parametrize("rubbish", [1e6, float("inf"), float("nan")])
def test_padding_never_leaks_into_wrench_or_gradient(robots, rubbish):
    command, position, angle = robots
    mask = torch.tensor([True, True, False, True, False]).expand(6, 5)
    clean = assemble_wrench(Drag(), command[:, [0, 1, 3]], position[:, [0, 1, 3]], angle[:, [0, 1, 3]])
    dirty = command.masked_fill(~mask.unsqueeze(-1), rubbish).requires_grad_()
    wrench = assemble_wrench(Drag(), dirty, position, angle, mask)
    torch.testing.assert_close(wrench, clean)
    (gradient,) = torch.autograd.grad(wrench.square().sum(), dirty)
    assert torch.isfinite(gradient).all() and not gradient[~mask].any()


@pytest.mark.parametrize("model", [Drag(), Lighthill()], ids=lambda m: m.name)
def test_effectiveness_agrees_with_central_differences(robots, model):
    command, position, angle = robots
    mask = torch.tensor([True, True, False, True, True]).expand(6, 5)
    matrix = effectiveness_matrix(model, command, position, angle, mask)
    assert matrix.shape == (6, 6, 5, 3)
    step = 1e-6
    for fin in range(5):
        for entry in range(3):
            offset = torch.zeros_like(command)
            offset[:, fin, entry] = step
            ahead = assemble_wrench(model, command + offset, position, angle, mask)
            behind = assemble_wrench(model, command - offset, position, angle, mask)
            torch.testing.assert_close(
                matrix[:, :, fin, entry], (ahead - behind) / (2 * step), rtol=1e-6, atol=1e-7
            )
    assert not matrix[:, :, 2].any()


def test_effectiveness_works_without_gradients_and_in_float32(robots):
    command, position, angle = robots
    exact = effectiveness_matrix(Drag(), command, position, angle)
    with torch.no_grad():
        single = effectiveness_matrix(Drag(), command.float(), position.float(), angle.float())
    assert single.dtype == torch.float32 and not single.requires_grad
    torch.testing.assert_close(single.double(), exact, rtol=1e-4, atol=1e-4)


def test_the_wrench_is_differentiable_by_command_and_geometry(robots):
    inputs = tuple(part[:1, :2].clone().requires_grad_() for part in robots)
    assert torch.autograd.gradcheck(lambda u, r, a: assemble_wrench(Drag(), u, r, a), inputs)
