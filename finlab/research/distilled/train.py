"""Training of both networks on exact answers of many robots, and their file.

The head is trained on the optimality conditions themselves: its loss is how far the dual at its
multipliers lies below the least power,

    sqrt((g* - g(lambda)) / g*)

whose gradient is the residual of the KKT conditions, r = grad g (Eq. 6), by the core. The root
makes it as large as the multipliers' relative error. The network of forces is trained on exact
forces, and on what its own leave of the wrench.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from finlab.arrays import Array
from finlab.errors import CommandError
from finlab.research.distilled.exact_answers import ACTUATORS, ExactAnswers, robots_with_answers
from finlab.research.distilled.network import ForceConfig, HeadConfig, RobotBatch
from finlab.research.distilled.trained_policy import NetworkName, write_policy
from finlab.research.networks.trained import ArraysByName
from finlab.research.training.device import workplace
from finlab.research.training.loop import (
    LoopSettings,
    Training,
    Weights,
    first_weights,
    seeded_generator,
)

LEAST_POWER = 1e-4
"""Added to the least power of an answer where it is divided by, over that of all actuators."""
LEAST_GAP = 1e-6
"""Added to the relative gap under the root, which has no derivative at 0."""


@dataclass(frozen=True)
class PolicyRecipe:
    """What one network learns from, and how."""

    loop: LoopSettings
    robots: int
    """Random robots that are learned from."""
    wrenches: int
    """Exact answers of each."""
    robots_of_step: int = 16
    """Robots of a step; `loop.batch_size` are its wrenches."""


PRESETS: dict[str, dict[NetworkName, PolicyRecipe]] = {
    "smoke": {
        "head": PolicyRecipe(LoopSettings(40, 64, 3e-3, warmup=10), 12, 16, 4),
        "forces": PolicyRecipe(LoopSettings(20, 32, 1e-3, warmup=10), 12, 16, 4),
    },
    "default": {
        "head": PolicyRecipe(LoopSettings(2000, 256, 2e-3, warmup=100, ema=0.995), 250, 64),
        "forces": PolicyRecipe(LoopSettings(800, 128, 1e-3, warmup=100, ema=0.995), 250, 64),
    },
    "long": {
        "head": PolicyRecipe(LoopSettings(12_000, 512, 2e-3, warmup=200, ema=0.999), 1500, 128),
        "forces": PolicyRecipe(LoopSettings(4000, 256, 1e-3, warmup=200, ema=0.999), 1500, 128),
    },
}
"""Recipe by preset and network: `smoke` takes seconds, `default` half a minute of a core, `long`
five minutes."""


@dataclass(frozen=True)
class PolicyData:
    """Robots and answers, as they are learned from."""

    answers: Sequence[ExactAnswers]
    token: Tensor
    """(R, m, TOKEN_SIZE), as all below in single precision."""
    column: Tensor
    """(R, m, 2, 6)."""
    root_stiffness: Tensor
    """(R, m)."""
    mask: Tensor
    """(R, m)."""
    wrench: Tensor
    """Whitened (R, T, 6)."""
    share: Tensor
    """Exact forces over the largest ones (R, T, m, 2)."""

    @classmethod
    def of(cls, answers: Sequence[ExactAnswers]) -> "PolicyData":
        """Pads robots to as many actuators as the largest one may have."""
        robots = [each.robot for each in answers]
        most = max(ACTUATORS[1], *(len(robot.works) for robot in robots))
        shares = []
        for each in answers:
            force = each.force[:, each.robot.works] / each.robot.force_max
            shares.append(force.swapaxes(0, 1))
        return cls(
            answers=answers,
            token=_padded([robot.token for robot in robots], most),
            column=_padded([robot.column for robot in robots], most),
            root_stiffness=_padded([robot.root_stiffness for robot in robots], most, 1.0),
            mask=_padded([np.ones(len(robot.works)) for robot in robots], most) > 0.0,
            wrench=_tensor(
                np.stack([each.wrench @ each.robot.whiten_wrench.T for each in answers])
            ),
            share=_padded(shares, most).swapaxes(1, 2),
        )

    def batch(self, robots: Tensor, wrenches: Tensor) -> RobotBatch:
        """Returns some robots (r,), each with some of its wrenches (r, t)."""
        return RobotBatch(
            self.token[robots],
            self.column[robots],
            self.root_stiffness[robots],
            self.mask[robots],
            self.wrench[robots[:, None], wrenches],
        )


class DualGap(torch.autograd.Function):
    """How far the dual lies below its maximum, and the gradient of that: the core's residual."""

    @staticmethod
    def forward(
        ctx: Any, multipliers: Tensor, answers: Sequence[ExactAnswers], wrenches: Tensor
    ) -> Tensor:
        """Evaluates whitened multipliers (R, T, 6) of robots at some of their wrenches (R, T).

        Returns:
            Gaps (R, T) over the least power.
        """
        gaps = []
        slopes = []
        for own, each, index in zip(multipliers.detach(), answers, wrenches, strict=True):
            robot = each.robot
            chosen = index.numpy()
            lambda_ = own.double().numpy() @ robot.unwhiten_multipliers.T
            points = robot.compiled.core.dual_points(
                each.wrench[chosen], lambda_, 0, robot.conditions
            )
            least = each.dual_value[chosen] + LEAST_POWER * robot.power_max
            gaps.append((each.dual_value[chosen] - points.dual_value) / least)
            # d(g* - g) / dl' = -(d lambda / d l')' r
            slopes.append(-(points.residual @ robot.unwhiten_multipliers) / least[:, None])
        ctx.save_for_backward(_tensor(np.stack(slopes)))
        return _tensor(np.stack(gaps))

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None, None]:
        """The gradient by the multipliers."""
        (slope,) = ctx.saved_tensors
        return gradient[..., None] * slope, None, None


def head_loss(
    weights: Weights, config: HeadConfig, data: PolicyData, robots: Tensor, wrenches: Tensor
) -> Tensor:
    """Mean root of the relative dual gap of a network's multipliers."""
    batch = data.batch(robots, wrenches)
    multipliers = config.head(weights, batch).multipliers(batch.wrench)
    answers = [data.answers[k] for k in robots.tolist()]
    gap: Tensor = DualGap.apply(multipliers, answers, wrenches)  # type: ignore[no-untyped-call]
    return (gap.clamp(min=0.0) + LEAST_GAP).sqrt().mean()


def force_loss(
    weights: Weights, config: ForceConfig, data: PolicyData, robots: Tensor, wrenches: Tensor
) -> Tensor:
    """Mean squared error of a network's forces over the largest ones, and of what they leave of the
    whitened wrench."""
    batch = data.batch(robots, wrenches)
    share = config.shares(weights, batch)
    error = (share - data.share[robots[:, None], wrenches]) * batch.mask[:, None, :, None]
    columns = batch.column / batch.root_stiffness[..., None, None]
    # The exact forces give the wrench: what is left is what the error of the forces gives.
    missed = torch.einsum("rtma,rmak->rtk", error, columns)
    loss: Tensor = error.square().sum((2, 3)).mean() + missed.square().sum(-1).mean()
    return loss


def train_policy(
    folder: Path,
    network: NetworkName,
    preset: str = "default",
    seed: int = 0,
    steps: int | None = None,
    resume: bool = False,
) -> dict[str, float]:
    """Trains a network, and writes its file into a folder, log, curves and state into one below.

    Args:
        folder: where to; made if need be.
        network: `head` or `forces`.
        preset: a key of `PRESETS`.
        seed: of robots, wrenches and first weights.
        steps: instead of the recipe's.
        resume: whether to go on from the state in the folder.

    Returns:
        The last loss, as `loss`, and that on robots that were not learned from, as `held_out`.

    Raises:
        CommandError: an unknown preset.
        DataError: a file cannot be written, or the state is of another run.
    """
    if preset not in PRESETS:
        raise CommandError(f"preset: expected one of {', '.join(PRESETS)}, got {preset!r}")
    recipe = PRESETS[preset][network]
    if steps is not None:
        recipe = replace(recipe, loop=replace(recipe.loop, steps=steps))
    answers = list(robots_with_answers("training", recipe.robots, recipe.wrenches, seed))
    held = max(recipe.robots // 20, 1)
    data = PolicyData.of(answers[held:])
    config = HeadConfig() if network == "head" else ForceConfig()
    loss_of: Any = head_loss if network == "head" else force_loss
    weights = first_weights(config.shapes(), seed)
    identity = {"recipe": json.dumps(asdict(recipe)), "seed": seed, "network": network}

    def terms_of(step: int) -> dict[str, Tensor]:
        draw = seeded_generator(seed, step, torch.device("cpu"))
        robots = torch.randint(len(data.answers), (recipe.robots_of_step,), generator=draw)
        each = recipe.loop.batch_size // recipe.robots_of_step
        wrenches = torch.randint(recipe.wrenches, (recipe.robots_of_step, each), generator=draw)
        return {"loss": loss_of(weights, config, data, robots, wrenches)}

    def save(shipped: ArraysByName, made: dict[str, Any]) -> None:
        write_policy(folder, network, vars(config), shipped, {**identity, **made, "preset": preset})

    with workplace("cpu", recipe.loop.batch_size) as place:
        run = Training(weights, recipe.loop, folder / network, identity, place)
        if resume:
            run.resume()
        run.run(terms_of, save)
    unseen = PolicyData.of(answers[:held])
    shipped = {name: torch.from_numpy(np.asarray(value)) for name, value in run.shipped.items()}
    every = torch.arange(recipe.wrenches).expand(held, -1)
    with torch.no_grad():
        held_out = float(loss_of(shipped, config, unseen, torch.arange(held), every))
    return {"loss": run.rows[-1]["loss"], "held_out": held_out}


def _padded(parts: Sequence[Array], most: int, value: float = 0.0) -> Tensor:
    """Arrays (m, ...) of robots as one (R, most, ...)."""
    padded = np.full((len(parts), most, *parts[0].shape[1:]), value)
    for k, part in enumerate(parts):
        padded[k, : len(part)] = part
    return _tensor(padded)


def _tensor(values: Array) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(values, np.float32))
