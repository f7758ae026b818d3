"""The learned fin physics: geometry is exact whatever the weights, padding counts nothing, gradients flow."""

import math

import pytest
import torch
from torch import Tensor

from finlab.inference.weights import SurrogateConfig
from finlab.physics import body_force
from finlab.training.networks.surrogate import CoefficientSurrogate, MlpSurrogate, make_surrogate

F64 = torch.float64


def make(kind: str) -> CoefficientSurrogate | MlpSurrogate:
    torch.manual_seed(0)
    surrogate = make_surrogate(SurrogateConfig(kind=kind, hidden=(16, 8)))
    if isinstance(surrogate, MlpSurrogate):
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


def test_the_wrench_is_the_sum_of_the_fins_forces_and_torques(robots: dict[str, Tensor]) -> None:
    surrogate = make("coefficient")
    assert isinstance(surrogate, CoefficientSurrogate)
    force = body_force(surrogate.fin_force(robots["command"]), robots["mounting_angle"])
    torque = torch.linalg.cross(robots["position"], force)
    torch.testing.assert_close(surrogate(**robots), torch.cat([force.sum(1), torque.sum(1)], dim=-1))


def test_turning_the_robot_turns_the_wrench(robots: dict[str, Tensor]) -> None:
    surrogate, yaw = make("coefficient"), 0.7
    c, s = math.cos(yaw), math.sin(yaw)
    rotation = torch.tensor([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], dtype=F64)
    turned = robots | {
        "position": robots["position"] @ rotation.T,
        "mounting_angle": robots["mounting_angle"] + yaw,
    }
    before, after = surrogate(**robots), surrogate(**turned)
    torch.testing.assert_close(after[:, :3], before[:, :3] @ rotation.T)
    torch.testing.assert_close(after[:, 3:], before[:, 3:] @ rotation.T)


@pytest.mark.parametrize("kind", ["coefficient", "mlp"])
def test_padding_counts_nothing(kind: str, robots: dict[str, Tensor]) -> None:
    surrogate = make(kind)
    mask = torch.tensor([True, True, True, False]).expand(6, -1)
    without = {key: value[:, :3] for key, value in robots.items()}
    torch.testing.assert_close(surrogate(**robots, mask=mask), surrogate(**without))
    garbage = {key: value.clone() for key, value in robots.items()}
    garbage["command"][:, 3], garbage["position"][:, 3] = 3.0, 9.0
    torch.testing.assert_close(surrogate(**garbage, mask=mask), surrogate(**without))


@pytest.mark.parametrize("kind", ["coefficient", "mlp"])
def test_the_order_of_fins_does_not_matter(kind: str, robots: dict[str, Tensor]) -> None:
    surrogate, order = make(kind), torch.tensor([2, 0, 3, 1])
    shuffled = {key: value[:, order] for key, value in robots.items()}
    torch.testing.assert_close(surrogate(**shuffled), surrogate(**robots))


@pytest.mark.parametrize("kind", ["coefficient", "mlp"])
def test_many_commands_on_one_layout_equal_one_by_one(kind: str, robots: dict[str, Tensor]) -> None:
    surrogate = make(kind)
    layout = {key: value[:1] for key, value in robots.items() if key != "command"}
    together = surrogate(command=robots["command"][:1].repeat(3, 1, 1)[None] * 0.9, **layout)
    alone = surrogate(command=robots["command"][:1] * 0.9, **layout)
    torch.testing.assert_close(together, alone.expand(1, 3, 6))


@pytest.mark.parametrize("kind", ["coefficient", "mlp"])
def test_gradients_by_command_agree_with_differences(kind: str, robots: dict[str, Tensor]) -> None:
    surrogate = make(kind)
    rest = {key: value[:2, :2] for key, value in robots.items() if key != "command"}
    command = robots["command"][:2, :2].clone().requires_grad_(True)
    assert torch.autograd.gradcheck(lambda u: surrogate(u, **rest), command)


def test_a_resting_fin_gives_no_force() -> None:
    surrogate = make("coefficient")
    command = torch.tensor([[0.0, 1.0, 0.3], [0.5, 0.0, 0.3]], dtype=F64)
    assert torch.equal(surrogate.fin_force(command), torch.zeros(2, 3, dtype=F64))  # type: ignore[operator]


def test_zero_direction_has_no_seam() -> None:
    surrogate = make("coefficient")
    ends = torch.tensor([[0.4, 1.5, -math.pi], [0.4, 1.5, math.pi]], dtype=F64)
    low, high = surrogate.fin_force(ends)  # type: ignore[operator]
    assert low.norm() > 0.01
    torch.testing.assert_close(low, high)


def test_an_unknown_kind_is_no_surrogate() -> None:
    with pytest.raises(KeyError, match="magic"):
        make_surrogate(SurrogateConfig(kind="magic"))
