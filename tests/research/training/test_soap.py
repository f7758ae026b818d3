"""SOAP: on a problem whose answer is known, beside Adam; its state goes on."""

import copy
from typing import Any

import torch
from torch import Tensor

from finlab.research.training.soap import Soap

SHAPES = (torch.Size((6, 4)), torch.Size((6,)))
"""A weight matrix and a bias."""
COUNT = sum(shape.numel() for shape in SHAPES)


def problem() -> tuple[Tensor, Tensor]:
    """Inputs (256, 4) of very different sizes, turned, and the outputs (256, 6) of a linear map."""
    generator = torch.Generator().manual_seed(3)
    sizes = torch.tensor([10.0, 1.0, 0.1, 0.03])
    turn, _ = torch.linalg.qr(torch.randn(4, 4, generator=generator))
    x = (torch.randn(256, 4, generator=generator) * sizes) @ turn
    return x, x @ torch.randn(4, 6, generator=generator) + torch.randn(6, generator=generator)


def loss_of(vector: Tensor) -> Tensor:
    """Mean squared error of a linear layer with these weights."""
    x, y = problem()
    weight = vector[:24].view(6, 4)
    return (x @ weight.T + vector[24:] - y).square().mean()


def descended(optimizer: Any, vector: Tensor, steps: int, rate: float = 0.1) -> float:
    """The loss after some steps whose rate falls to zero."""
    for step in range(steps):
        optimizer.param_groups[0]["lr"] = rate * (1.0 - step / steps)
        free = vector.clone().requires_grad_()
        (vector.grad,) = torch.autograd.grad(loss_of(free), free)
        optimizer.step()
    return float(loss_of(vector))


def test_it_comes_nearer_than_adam_where_inputs_are_turned_and_of_many_sizes() -> None:
    first = torch.zeros(COUNT)
    second = torch.zeros(COUNT)
    by_soap = descended(Soap(first, SHAPES, 0.1), first, 1000)
    by_adam = descended(torch.optim.Adam([second], lr=0.1), second, 1000)
    assert by_soap < 1e-5
    assert by_soap < 0.01 * by_adam


def test_a_state_that_is_taken_over_goes_on_as_if_nothing_had_happened() -> None:
    whole = torch.zeros(COUNT)
    optimizer = Soap(whole, SHAPES, 0.1)
    descended(optimizer, whole, 25)
    state = copy.deepcopy(optimizer.state_dict())
    other = whole.clone()
    resumed = Soap(other, SHAPES, 0.1)
    resumed.load_state_dict(state)
    assert descended(optimizer, whole, 30) == descended(resumed, other, 30)
    torch.testing.assert_close(whole, other, rtol=0.0, atol=0.0)


def test_the_basis_is_orthogonal_and_ordered() -> None:
    vector = torch.zeros(COUNT)
    optimizer = Soap(vector, SHAPES, 0.1)
    descended(optimizer, vector, 200)
    factors = optimizer.state[vector]["factors"]
    assert factors[1] == {}
    for side, size in (("left", 6), ("right", 4)):
        basis = factors[0][f"{side}_basis"]
        torch.testing.assert_close(basis.T @ basis, torch.eye(size), atol=1e-5, rtol=0.0)
