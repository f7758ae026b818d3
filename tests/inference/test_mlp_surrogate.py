"""The paper's surrogate in numpy against the trained one: wrench and slopes."""

import numpy as np
import pytest
import torch

from finlab.inference.surrogate import BLOCK, MlpFins
from finlab.inference.weights import SurrogateConfig
from finlab.layout import Layout, Limits, random_layout
from finlab.training.networks.surrogate import Surrogate

Array = np.ndarray


@pytest.fixture
def robot() -> Layout:
    """A robot with a fin confined to an arc and one that cannot move at all."""
    layout = random_layout(np.random.default_rng(1), n_fins=4)
    arc, stiff = Limits(zero_direction=(0.3, 1.7)), Limits((0.3, 0.3), (1.1, 1.1), (0.7, 0.7))
    return layout.replace_fin(layout.names[0], limits=arc).replace_fin(layout.names[1], limits=stiff)


def trained(*hidden: int) -> Surrogate:
    """A surrogate with random weights, none of which is without effect."""
    with torch.random.fork_rng():
        torch.manual_seed(3)
        surrogate = Surrogate(SurrogateConfig(hidden))
        torch.nn.init.normal_(surrogate.affine.weight, std=0.1)
        torch.nn.init.normal_(surrogate.affine.bias, std=0.1)
    return surrogate.requires_grad_(False)


def copy_of(surrogate: Surrogate, robot: Layout) -> MlpFins:
    state = {key: value.numpy() for key, value in surrogate.state_dict().items()}
    return MlpFins(state, robot.position, robot.mounting_angle, robot.lower, robot.upper)


def wrench_of(fins: MlpFins, robot: Layout, force: Array) -> Array:
    """Wrench (..., 6) of body forces (..., n, 3) with the surrogate's correction."""
    torque = np.cross(robot.position, force)
    return np.concatenate([force.sum(-2), torque.sum(-2)], axis=-1) * (1.0 + fins.scale) + fins.bias


def commands(robot: Layout, rows: int) -> Array:
    unit = np.random.default_rng(0).random((rows, robot.n_fins, 3))
    return (robot.lower + unit * (robot.upper - robot.lower)).astype(np.float32)


@pytest.mark.parametrize("hidden", [(32,), (48, 16), (16, 8, 8)])
@pytest.mark.parametrize("rows", [1, 7, 2 * BLOCK + 3])
def test_wrench_and_slopes_are_those_of_the_trained_one(
    hidden: tuple[int, ...], rows: int, robot: Layout
) -> None:
    surrogate, command = trained(*hidden), commands(robot, rows)
    fins, tensor = copy_of(surrogate, robot), torch.tensor(command, requires_grad=True)
    layout = (robot.position, robot.mounting_angle, robot.lower, robot.upper)
    expected = surrogate(tensor, *(torch.tensor(part, dtype=torch.float32) for part in layout))
    force, slopes = fins.force_and_slopes(command)
    np.testing.assert_allclose(force, fins.force(command), atol=1e-6)
    np.testing.assert_allclose(wrench_of(fins, robot, force), expected.detach().numpy(), atol=1e-5)
    moves = robot.upper > robot.lower  # a command that cannot move has slopes without meaning
    for axis in range(6):
        (by_command,) = torch.autograd.grad(expected[:, axis].sum(), tensor, retain_graph=True)
        # One fin at a time, so that what a slope does to the wrench is asked alone.
        for fin in range(robot.n_fins):
            moved = np.zeros((rows, 3, robot.n_fins, 3))
            moved[:, :, fin] = slopes[:, fin]
            got = wrench_of(fins, robot, moved)[..., axis] - fins.bias[axis]
            free = moves[fin]
            np.testing.assert_allclose(got[:, free], by_command[:, fin].numpy()[:, free], atol=1e-5)


def test_single_precision_whatever_the_commands_are_in(robot: Layout) -> None:
    fins, command = copy_of(trained(48, 16), robot), commands(robot, 5)
    assert fins.force(command).dtype == fins.force(command.astype(np.float64)).dtype == np.float32
    np.testing.assert_allclose(fins.force(command.astype(np.float64)), fins.force(command), atol=1e-6)
