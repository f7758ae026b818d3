"""`finlab train mdn`: a joint mixture over all fins' forces, taught by descents from many starts.

Processes answer random targets on random robots and write files; then the network learns from them. The loss
is the mixture's negative log-likelihood of the different ways to deliver a target, weighted by their costs:
so components come to stand for ways, and the cheapest way's gets the largest weight.
"""

import multiprocessing
import os
import sys
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from finlab.errors import DataError
from finlab.mdn.network import ForceMixture, ForceNetworkConfig
from finlab.mdn.training.answers import Answers, Batch, write_answers
from finlab.mdn.training.recipes import RECIPES, AnswerSettings, MdnTraining
from finlab.networks.checkpoint import (
    read_checkpoint,
    read_normalization,
    resolve_checkpoint,
    write_checkpoint,
)
from finlab.networks.trained import State, TrainedWeights, sizes_for_file
from finlab.training.first_weights import first_weights
from finlab.training.loop import LOG_EVERY, Tensors, Terms, train
from finlab.whole_file import make_folder

TRAIN_SEED = 140_000
"""Added to the user's seed."""
JUDGE_EVERY = 10 * LOG_EVERY
"""Steps after which the held-out loss is taken."""
HELD_OUT = 16
"""Batches over which that is taken."""


def train_mdn(preset: str, out: Path, *, seed: int = 0, **training: Any) -> TrainedWeights:
    """Write the answers that are missing in `out/answers`, train a preset's network on them, and write a
    checkpoint, once a minute and at the end.

    Args:
        preset: one of `RECIPES`.
        out: folder for checkpoint, answers and log, made if need be.
        seed: of the answers and of the first weights.
        training: fields of `MdnTraining`, in place of the recipe's where they are not None.

    Raises:
        DataError: an unknown preset, or a file that cannot be written.
    """
    if preset not in RECIPES:
        raise DataError(f"preset: expected one of {', '.join(RECIPES)}, got {preset!r}")
    recipe = RECIPES[preset]
    settings = replace(recipe.training, **{k: v for k, v in training.items() if v is not None})
    # One yardstick of errors for all that is shipped; the network does not depend on it.
    normalization = read_normalization(resolve_checkpoint("paper"))
    identity: dict[str, Any] = {
        "preset": preset,
        "seed": seed,
        "training": asdict(settings),
        "answers": asdict(recipe.answers),
        "network": asdict(recipe.network),
    }

    def save(network: State, progress: dict[str, Any]) -> None:
        trained = TrainedWeights(out.name, normalization, sizes_for_file(recipe.network), network)
        write_checkpoint(out, replace(trained, preset=preset, training={"mdn": identity | progress}))

    answers = answers_in(make_folder(out / "answers"), recipe.answers, seed)
    terms = make_terms(recipe.network, answers, settings, seed)
    train(first_weights(recipe.network.shapes(), seed), terms, settings, out, save)
    return read_checkpoint(out)


def answers_in(folder: Path, settings: AnswerSettings, seed: int) -> list[Path]:
    """The files of answers, in order; those that are missing are written first, on all cores."""
    write, silent = partial(write_answers, folder, settings, seed), not sys.stderr.isatty()
    with multiprocessing.get_context("spawn").Pool(min(settings.files, os.cpu_count() or 1)) as pool:
        made = pool.imap(write, range(settings.files))
        return list(tqdm(made, "answers", settings.files, unit="file", disable=silent))


def make_terms(network: ForceNetworkConfig, files: list[Path], training: MdnTraining, seed: int) -> Terms:
    """The loss terms of a step."""
    held_out, learned = Answers(files[:1]), Answers(files[1:])
    rows = [
        held_out.draw(np.random.default_rng([TRAIN_SEED, k]), training.batch_size) for k in range(HELD_OUT)
    ]
    judged = torch.zeros(())

    def terms(w: Tensors, step: int) -> dict[str, Tensor]:
        nonlocal judged
        net: Callable[..., ForceMixture] = partial(network, w)
        if step % JUDGE_EVERY == 0:
            with torch.no_grad():
                judged = torch.stack([losses(net, batch, 1.0, 0.0)["loss"] for batch in rows]).mean()
        batch = learned.draw(np.random.default_rng([TRAIN_SEED + seed, step]), training.batch_size)
        cold = min(1.0, step / max(training.anneal, 1))
        temper = float(batch.nodes.shape[1]) ** (1.0 - cold)
        return {**losses(net, batch, temper, training.spread), "held_out": judged}

    return terms


def losses(net: Callable[..., ForceMixture], batch: Batch, temper: float, spread: float) -> dict[str, Tensor]:
    """The loss and its parts, means over a batch; per fin, so that robots of many fins count no more.

    For `temper` see `ForceMixture.log_prob`; `spread` weighs the entropy of the components' mean weights.
    """
    mixture = net(batch.nodes, batch.pairs)
    likelihood = (mixture.log_prob(batch.way, temper) * batch.weight).sum(-1).mean() / batch.nodes.shape[1]
    share = mixture.logits.softmax(-1).mean(0)
    entropy = -(share * torch.log(share + 1e-9)).sum()
    # As many components as would have this entropy if all of them were used alike.
    return {"loss": -likelihood - spread * entropy, "imitation": -likelihood, "used": entropy.exp()}
