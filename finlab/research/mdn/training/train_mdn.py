"""`finlab train mdn`: a joint mixture over all fins' forces, taught by descents from many starts.

Processes answer random targets on random robots and write files; then the network learns from them
by Adam. The loss is the mixture's negative log-likelihood of the different ways to deliver a
target, weighted by their costs: so components come to stand for ways, and the cheapest way's gets
the largest weight.
"""

import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from finlab.errors import DataError
from finlab.files.checkpoint_config import read_normalization
from finlab.research.executor import cores, map_parts
from finlab.research.mdn.network import ForceMixture, ForceNetworkConfig
from finlab.research.mdn.training.teacher import (
    AnswerSettings,
    TeacherBatch,
    TeacherData,
    write_answers,
)
from finlab.research.networks.checkpoint import (
    read_checkpoint,
    resolve_checkpoint,
    write_checkpoint,
)
from finlab.research.networks.trained import ArraysByName, TrainedWeights, sizes_for_file
from finlab.research.training.device import Workplace
from finlab.research.training.loop import STATE_FILE, LoopSettings, Terms, Training, first_weights
from finlab.whole_file import make_folder, remove_temporary_files


@dataclass(frozen=True)
class MdnTraining(LoopSettings):
    """How the network of method `mdn` is trained: the likelihood of the ways that the teacher has
    found."""

    anneal: int = 2500
    """Steps over which components stop sharing what they stand for; at first all of them learn from
    all."""
    spread: float = 0.02
    """Weight of the entropy of the components' mean weights over a batch, so that none is left
    unused."""


@dataclass(frozen=True)
class MdnRecipe:
    """The network of method `mdn`, and what it learns from."""

    training: MdnTraining
    answers: AnswerSettings = field(default_factory=AnswerSettings)
    network: ForceNetworkConfig = field(default_factory=ForceNetworkConfig)


RECIPES = {
    "default": MdnRecipe(MdnTraining(100_000, 256, 2e-3, warmup=200, ema=0.999, seconds=5400.0)),
    # As many steps as the weights that come with finlab took, and no clock.
    "shipped": MdnRecipe(MdnTraining(16_000, 256, 2e-3, warmup=200, ema=0.999)),
    "smoke": MdnRecipe(
        MdnTraining(30, 16, 2e-3, warmup=5, ema=0.9, seconds=5400.0, anneal=10),
        AnswerSettings(files=2, fins=2, robots=6, targets=8),
        ForceNetworkConfig(width=16, heads=2, layers=1, feedforward=16, n_components=4),
    ),
}
"""Name -> recipe of `finlab train mdn`."""


TRAIN_SEED = 140_000
"""Added to the user's seed."""
JUDGE_EVERY = 200
"""Steps after which the held-out loss is taken."""
HELD_OUT = 16
"""Batches over which the held-out loss is taken."""
ANSWERS_SHARE = 0.5
"""Share of a limited time after which no more answers are waited for."""


def train_mdn(
    preset: str, out: Path, *, seed: int = 0, resume: bool = False, **training: Any
) -> TrainedWeights:
    """Write the answers that are missing in `out/answers`, train a preset's network on them, and
    write a checkpoint, once a minute and at the end; `seed` is that of answers and first weights,
    `resume` goes on from the state in `out`, and fields of `MdnTraining` replace the recipe's where
    they are not None. Raises DataError: an unknown preset, or a file that cannot be written."""
    started = time.monotonic()
    if preset not in RECIPES:
        raise DataError(f"preset: expected one of {', '.join(RECIPES)}, got {preset!r}")
    recipe = RECIPES[preset]
    settings = replace(recipe.training, **{k: v for k, v in training.items() if v is not None})
    # One wrench scale for all that is shipped; the network does not depend on it.
    normalization = read_normalization(resolve_checkpoint("paper"))
    parts: dict[str, Any] = {
        "training": settings,
        "answers": recipe.answers,
        "network": recipe.network,
    }
    identity = {
        "preset": preset,
        "seed": seed,
        **{name: asdict(part) for name, part in parts.items()},
    }

    def save(network: ArraysByName, progress: dict[str, Any]) -> None:
        trained = TrainedWeights(out.name, normalization, sizes_for_file(recipe.network), network)
        write_checkpoint(
            out, replace(trained, preset=preset, training={"mdn": identity | progress})
        )

    folder = make_folder(out / "answers")
    if resume and (out / STATE_FILE).exists():  # the answers of the run that goes on
        answers = sorted(folder.glob("*.npz"))
    else:
        until = math.inf if settings.seconds is None else started + ANSWERS_SHARE * settings.seconds
        answers = answers_in(folder, recipe.answers, seed, until)
    weights = first_weights(recipe.network.shapes(), seed)
    run = Training(weights, settings, out, identity, Workplace(torch.device("cpu")))
    if resume:
        run.resume()
    terms = make_terms(partial(recipe.network, weights), answers, settings, seed)
    run.run(terms, save, spent=time.monotonic() - started)
    return read_checkpoint(out)


def answers_in(
    folder: Path, settings: AnswerSettings, seed: int, until: float = math.inf
) -> list[Path]:
    """The files of answers, in order; those that are missing are written first, on all cores, as
    many as are done at the time `until` of `time.monotonic`, but two at least."""
    remove_temporary_files(folder)
    write = partial(write_answers, folder, settings, seed)
    made = list[Path]()
    for path in map_parts(write, range(settings.files), "answers", jobs=cores()):
        made.append(path)
        if len(made) >= 2 and time.monotonic() > until:
            break
    for path in set(folder.glob("*.npz")) - set(made):
        path.unlink()
    return made


def make_terms(
    net: Callable[..., ForceMixture], files: list[Path], training: MdnTraining, seed: int
) -> Terms:
    """The loss terms of a step, and of the held-out first file: functions of step and seed."""
    held_out = TeacherData(files[:1])
    learned = TeacherData(files[1:])
    rows = [
        held_out.draw(np.random.default_rng([TRAIN_SEED, k]), training.batch_size)
        for k in range(HELD_OUT)
    ]
    judged: Tensor | None = None

    def terms(step: int) -> dict[str, Tensor]:
        nonlocal judged
        if judged is None or step % JUDGE_EVERY == 0:
            with torch.no_grad():
                judged = torch.stack(
                    [losses(net, batch, 1.0, 0.0)["loss"] for batch in rows]
                ).mean()
        batch = learned.draw(np.random.default_rng([TRAIN_SEED + seed, step]), training.batch_size)
        cold = min(1.0, step / max(training.anneal, 1))
        temper = float(batch.nodes.shape[1]) ** (1.0 - cold)
        return {**losses(net, batch, temper, training.spread), "held_out": judged}

    return terms


def losses(
    net: Callable[..., ForceMixture], batch: TeacherBatch, temper: float, spread: float
) -> dict[str, Tensor]:
    """The loss and its parts, means over a batch; per fin, so that robots of many fins count no
    more.

    For `temper` see `ForceMixture.log_prob`; `spread` weighs the entropy of the components' mean
    weights.
    """
    mixture = net(batch.nodes, batch.pairs)
    likelihood = (mixture.log_prob(batch.way, temper) * batch.weight).sum(
        -1
    ).mean() / batch.nodes.shape[1]
    share = mixture.logits.softmax(-1).mean(0)
    entropy = -(share * torch.log(share + 1e-9)).sum()
    # As many components as would have this entropy if all of them were used alike.
    return {"loss": -likelihood - spread * entropy, "imitation": -likelihood, "used": entropy.exp()}
