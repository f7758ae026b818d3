"""The learned fin physics: geometry is exact whatever the weights, padding counts nothing, gradients flow."""

import math

import pytest
import torch
from torch import Tensor

from finlab.inference.weights import SurrogateConfig
from finlab.training.networks.surrogate import Surrogate

F64 = torch.float64


def make() -> Surrogate:
    torch.manual_seed(0)
    surrogate = Surrogate(SurrogateConfig(hidden=(16, 8)))
    # Its correction starts as the identity, which would hide a mistake in it.
    torch.nn.init.normal_(surrogate.affine.weight, std=0.1)
    torch.nn.init.normal_(surrogate.affine.bias, std=0.1)
    return surrogate.double().requires_grad_(False)


@pytest.fixture
def robots() -> dict[str, Tensor]:
    """Six robots of four fins, with a command each."""
    unit = torch.rand(6, 4, 7, generator=torch.Generator().manual_seed(0), dtype=F64)
    lower = torch.tensor([0.05, 0.1, -math.pi], dtype=F64).expand(6, 4, 3)
    upper = torch.tensor([0.6, 2.1, math.pi], dtype=F64).expand(6, 4, 3)
    return {
        "command": lower + unit[..., :3] * (upper - lower),
        "position": 0.6 * unit[..., 3:6] - 0.3,
        "mounting_angle": (2 * unit[..., 6] - 1) * math.pi,
        "lower": lower,
        "upper": upper,
    }


def test_padding_counts_nothing(robots: dict[str, Tensor]) -> None:
    surrogate = make()
    mask = torch.tensor([True, True, True, False]).expand(6, -1)
    without = {key: value[:, :3] for key, value in robots.items()}
    torch.testing.assert_close(surrogate(**robots, mask=mask), surrogate(**without))
    garbage = {key: value.clone() for key, value in robots.items()}
    garbage["command"][:, 3], garbage["position"][:, 3] = 3.0, 9.0
    torch.testing.assert_close(surrogate(**garbage, mask=mask), surrogate(**without))


def test_the_order_of_fins_does_not_matter(robots: dict[str, Tensor]) -> None:
    surrogate, order = make(), torch.tensor([2, 0, 3, 1])
    shuffled = {key: value[:, order] for key, value in robots.items()}
    torch.testing.assert_close(surrogate(**shuffled), surrogate(**robots))


def test_many_commands_on_one_layout_equal_one_by_one(robots: dict[str, Tensor]) -> None:
    surrogate = make()
    layout = {key: value[:1] for key, value in robots.items() if key != "command"}
    together = surrogate(command=robots["command"][:1].repeat(3, 1, 1)[None] * 0.9, **layout)
    alone = surrogate(command=robots["command"][:1] * 0.9, **layout)
    torch.testing.assert_close(together, alone.expand(1, 3, 6))


def test_gradients_by_command_agree_with_differences(robots: dict[str, Tensor]) -> None:
    surrogate = make()
    rest = {key: value[:2, :2] for key, value in robots.items() if key != "command"}
    command = robots["command"][:2, :2].clone().requires_grad_(True)
    assert torch.autograd.gradcheck(lambda u: surrogate(u, **rest), command)
