"""The paper's surrogate: geometry whatever the weights, and its gradient against torch's."""

import numpy as np
import pytest
import torch

from finlab.errors import CheckpointError
from finlab.files.checkpoint_config import WrenchNormalization
from finlab.layout import Layout, Limits
from finlab.research.networks.checkpoint import read_checkpoint, resolve_checkpoint
from finlab.research.networks.trained import TrainedWeights
from finlab.research.paper.surrogate import BLOCK, LayoutSurrogate, SurrogateConfig
from finlab.research.random_layouts import random_layout
from tests.research.paper.surrogate_in_torch import wrench_in_torch


@pytest.fixture
def robot() -> Layout:
    """A robot with a fin confined to an arc and one that cannot move at all."""
    layout = random_layout(np.random.default_rng(1), n_fins=4)
    arc = Limits(zero_direction=(0.3, 1.7))
    stiff = Limits((0.3, 0.3), (1.1, 1.1), (0.7, 0.7))
    return layout.replace_actuator(layout.names[0], limits=arc).replace_actuator(
        layout.names[1], limits=stiff
    )


def untrained(*hidden: int) -> TrainedWeights:
    """A surrogate with random weights, none of which is without effect."""
    rng = np.random.default_rng(3)
    config = SurrogateConfig(hidden)
    state = {name: rng.normal(0.0, 0.2, shape) for name, shape in config.shapes().items()}
    state = {name: values.astype(np.float32) for name, values in state.items()}
    normalization = WrenchNormalization(np.zeros(6), np.ones(6))
    return TrainedWeights(
        "random",
        normalization,
        surrogate_sizes={"kind": "mlp", "hidden": list(config.hidden)},
        surrogate=state,
        fin_model={"type": "drag"},
    )


def random_commands(robot: Layout, rows: int) -> np.ndarray:
    """Commands (rows, n, 3) within the limits of a robot."""
    unit = np.random.default_rng(0).random((rows, robot.n_fins, 3))
    return robot.lower + unit * (robot.upper - robot.lower)


@pytest.mark.parametrize("hidden", [(32,), (16, 8, 8)])
@pytest.mark.parametrize("rows", [1, 2 * BLOCK + 3])
def test_wrench_and_gradient_are_those_of_torch(
    hidden: tuple[int, ...], rows: int, robot: Layout
) -> None:
    weights = untrained(*hidden)
    command = random_commands(robot, rows)
    surrogate = LayoutSurrogate(robot, weights)
    tensor = torch.tensor(command, requires_grad=True)
    expected = wrench_in_torch(weights, robot, tensor)
    np.testing.assert_allclose(surrogate.wrench(command), expected.detach().numpy(), atol=2e-4)
    force, pull = surrogate.force_and_pullback(command)
    assert force.dtype == np.float32
    np.testing.assert_allclose(force, surrogate.force(command), atol=1e-5)
    moves = robot.upper > robot.lower  # a command that cannot move has slopes without meaning
    for axis in range(6):
        by_command = pull(np.broadcast_to(surrogate.effectiveness[..., axis], force.shape))
        (gradient,) = torch.autograd.grad(expected[:, axis].sum(), tensor, retain_graph=True)
        np.testing.assert_allclose(by_command[:, moves], gradient.numpy()[:, moves], atol=2e-4)


def test_order_does_not_matter(robot: Layout) -> None:
    weights = untrained(16, 8)
    command = torch.tensor(random_commands(robot, 6))
    order = [2, 0, 3, 1]
    shuffled = Layout("shuffled", tuple(robot.fins[i] for i in order))
    whole = wrench_in_torch(weights, robot, command)
    torch.testing.assert_close(wrench_in_torch(weights, shuffled, command[:, order]), whole)


def test_a_checkpoint_without_one_says_so(robot: Layout) -> None:
    with pytest.raises(CheckpointError, match="'default' holds no surrogate"):
        LayoutSurrogate(robot, read_checkpoint(resolve_checkpoint("default")))
