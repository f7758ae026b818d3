"""Training of policies: the gradient of its loss, a state from which it goes on to the same bytes,
and the loss of robots that were not learned from."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from finlab.cli import main
from finlab.errors import CommandError
from finlab.research.distilled.exact_answers import answers_of, robots_with_answers
from finlab.research.distilled.network import HeadConfig
from finlab.research.distilled.train import PRESETS, DualGap, PolicyData, head_loss, train_policy
from finlab.research.distilled.trained_policy import read_policy
from finlab.research.training import loop
from finlab.research.training.loop import Training, first_weights
from tests.research.distilled.robots import mixed_robot


def test_the_slope_of_the_dual_gap_is_the_residual() -> None:
    answers = answers_of(mixed_robot(0), None, 8, np.random.default_rng(0))
    whitened = np.linalg.solve(answers.robot.unwhiten_multipliers, answers.multipliers.T).T
    rng = np.random.default_rng(1)
    off = torch.tensor(whitened + 0.1 * rng.normal(size=whitened.shape), dtype=torch.float32)
    index = torch.arange(8)[None]

    def gap(multipliers: torch.Tensor) -> torch.Tensor:
        value: torch.Tensor = DualGap.apply(multipliers[None], [answers], index)  # type: ignore[no-untyped-call]
        return value[0]

    assert (gap(off) > 0.0).all()
    assert gap(torch.tensor(whitened, dtype=torch.float32)).abs().max() < 1e-5
    at = off.clone().requires_grad_()
    (slope,) = torch.autograd.grad(gap(at).sum(), at)
    for k in range(6):
        move = torch.zeros(6)
        move[k] = 0.01
        difference = (gap(off + move) - gap(off - move)) / 0.02
        torch.testing.assert_close(
            slope[:, k], difference, rtol=0.02, atol=0.02 * slope.abs().max().item()
        )


def test_robots_that_are_judged_are_others_than_those_learned_from() -> None:
    learned = next(iter(robots_with_answers("training", 1, 4, 0)))
    judged = next(iter(robots_with_answers("judging", 1, 4, 0)))
    again = next(iter(robots_with_answers("judging", 1, 4, 0)))
    assert learned.robot.layout != judged.robot.layout
    np.testing.assert_array_equal(judged.multipliers, again.multipliers)


def test_a_training_lowers_its_loss_and_goes_on_to_the_same_bytes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    train_policy(tmp_path / "whole", "head", "smoke")
    trained = read_policy(tmp_path / "whole", "head")
    recipe = PRESETS["smoke"]["head"]
    learned = list(robots_with_answers("training", recipe.robots, recipe.wrenches, 0))[1:]
    data = PolicyData.of(learned)
    every = torch.arange(recipe.wrenches).expand(len(learned), -1)
    config = HeadConfig()
    weights = {name: torch.from_numpy(array) for name, array in trained.weights.items()}
    losses = [
        float(head_loss(of, config, data, torch.arange(len(learned)), every).detach())
        for of in (first_weights(config.shapes(), 0), weights)
    ]
    assert losses[1] < 0.9 * losses[0]

    command = ["train", "policy", "-o", str(tmp_path / "parts"), "--network", "head"]
    command += ["--preset", "smoke"]
    # A run that is stopped half-way: its state is that of step 20 of 40.
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Training, "step", stopping_at(20, Training.step))
        patch.setattr(loop, "SAVE_EVERY_S", 0.0)
        with pytest.raises(KeyboardInterrupt):
            train_policy(tmp_path / "parts", "head", "smoke")
    assert main([*command, "--resume"]) == 0
    assert "held out" in capsys.readouterr().out
    one = (tmp_path / "whole/head.safetensors").read_bytes()
    assert one == (tmp_path / "parts/head.safetensors").read_bytes()


def stopping_at(step: int, take: Any) -> Any:
    """A step of a training that is interrupted when it comes to a number."""

    def step_or_stop(run: Training, terms_of: Any, number: int, rate: float) -> Any:
        if number == step:
            raise KeyboardInterrupt
        return take(run, terms_of, number, rate)

    return step_or_stop


def test_an_unknown_preset_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CommandError, match="expected one of smoke, default, long"):
        train_policy(tmp_path, "head", "huge")
