"""The paper's surrogate on a layout against the trained module."""

import numpy as np
import pytest
import torch

from finlab.errors import CheckpointError
from finlab.inference.checkpoint import read_checkpoint, resolve_checkpoint
from finlab.inference.surrogate import surrogate_on
from finlab.layout import random_layout
from finlab.training.saving import surrogate_of


@pytest.mark.parametrize("seed", range(3))
def test_wrenches_are_those_of_the_trained_one(seed: int) -> None:
    weights = read_checkpoint(resolve_checkpoint("paper"))
    rng = np.random.default_rng(seed)
    robot = random_layout(rng, limits="varied")
    share = rng.random((4, 5, robot.n_fins, 3))
    command = (robot.lower + share * (robot.upper - robot.lower)).astype(np.float32)
    layout = (robot.position, robot.mounting_angle, robot.lower, robot.upper)
    tensors = [torch.tensor(part, dtype=torch.float32) for part in layout]
    expected = surrogate_of(weights)(torch.from_numpy(command), *tensors).numpy()
    surrogate = surrogate_on(robot, weights)
    np.testing.assert_allclose(surrogate.wrench(command[0]), expected[0], atol=2e-5)
    force, slopes = surrogate.fins.force_and_slopes(command[1])
    assert slopes.shape == (5, robot.n_fins, 3, 3)
    np.testing.assert_allclose(force, surrogate.fins.force(command[1]), atol=2e-5)


def test_a_checkpoint_without_one_says_so() -> None:
    weights = read_checkpoint(resolve_checkpoint("default"))
    with pytest.raises(CheckpointError, match="'default' holds no surrogate; train one with"):
        surrogate_on(random_layout(np.random.default_rng(0)), weights)
