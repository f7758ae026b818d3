"""`finlab train mdn`: a joint mixture over all fins' forces, taught by descents from many starts.

Processes answer random targets on random robots and write files; then the network learns from them by Adam.
The loss is the mixture's negative log-likelihood of the different ways to deliver a target, weighted by their
costs: so components come to stand for ways, and the cheapest way's gets the largest weight.
"""

import csv
import io
import math
import multiprocessing
import os
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from tqdm import tqdm

from finlab.errors import DataError
from finlab.files.worker import end_with_parent
from finlab.mdn.network import ForceMixture
from finlab.mdn.training.answers import Answers, Batch, write_answers
from finlab.mdn.training.first_weights import first_weights
from finlab.mdn.training.recipes import RECIPES, AnswerSettings, MdnTraining
from finlab.networks.checkpoint import (
    read_checkpoint,
    read_normalization,
    resolve_checkpoint,
    write_checkpoint,
)
from finlab.networks.trained import State, TrainedWeights, sizes_for_file
from finlab.whole_file import make_folder, write_whole

TRAIN_SEED = 140_000
"""Added to the user's seed."""
LOG_EVERY, JUDGE_EVERY = 20, 200
"""Steps after which a row is logged, and after which the held-out loss is taken."""
SAVE_EVERY_S = 60.0
"""Seconds after which the checkpoint is written."""
HELD_OUT = 16
"""Batches over which the held-out loss is taken."""
CLIP = 1.0
"""Longest gradient."""
LOG_FILE = "log.csv"
"""One row per logged step: step, samples, seconds, learning rate and every loss term."""

Terms = Callable[[int], dict[str, Tensor]]
"""Loss terms of a step of training, `loss` among them, as means over the batch."""


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
    weights = first_weights(recipe.network.shapes(), seed)
    learn(weights, make_terms(partial(recipe.network, weights), answers, settings, seed), settings, out, save)
    return read_checkpoint(out)


def answers_in(folder: Path, settings: AnswerSettings, seed: int) -> list[Path]:
    """The files of answers, in order; those that are missing are written first, on all cores."""
    write, silent = partial(write_answers, folder, settings, seed), not sys.stderr.isatty()
    count = min(settings.files, os.cpu_count() or 1)
    with multiprocessing.get_context("spawn").Pool(count, end_with_parent) as pool:
        made = pool.imap(write, range(settings.files))
        return list(tqdm(made, "answers", settings.files, unit="file", disable=silent))


def make_terms(
    net: Callable[..., ForceMixture], files: list[Path], training: MdnTraining, seed: int
) -> Terms:
    """The loss terms of a step."""
    held_out, learned = Answers(files[:1]), Answers(files[1:])
    rows = [
        held_out.draw(np.random.default_rng([TRAIN_SEED, k]), training.batch_size) for k in range(HELD_OUT)
    ]
    judged = torch.zeros(())

    def terms(step: int) -> dict[str, Tensor]:
        nonlocal judged
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


def learn(
    weights: dict[str, Tensor],
    terms_of: Terms,
    settings: MdnTraining,
    folder: Path,
    save: Callable[[State, dict[str, Any]], None],
) -> None:
    """Minimize the term `loss` by Adam.

    Args:
        weights: what is trained; changed in place.
        terms_of: see `Terms`.
        settings: of the training.
        folder: where the log is written.
        save: called once a minute and at the end with the running average of the weights, and with how far
            the run is.
    """
    optimizer = torch.optim.Adam(weights.values(), lr=settings.learning_rate)
    average = {name: value.detach().clone() for name, value in weights.items()}
    rows = list[dict[str, Any]]()
    limit = math.inf if settings.seconds is None else settings.seconds
    started = saved = time.monotonic()
    for step in tqdm(range(settings.steps), unit="step", disable=not sys.stderr.isatty()):
        elapsed, samples = time.monotonic() - started, (step + 1) * settings.batch_size
        last = step == settings.steps - 1 or elapsed >= limit
        optimizer.param_groups[0]["lr"] = rate = learning_rate(settings, step, elapsed / limit)
        optimizer.zero_grad(set_to_none=True)
        terms = terms_of(step)
        terms["loss"].backward()
        nn.utils.clip_grad_norm_(weights.values(), CLIP)
        optimizer.step()
        # The average starts short and grows, so that early weights are soon forgotten.
        decay = min(settings.ema, (1 + step) / (10 + step))
        for name, value in average.items():
            value.lerp_(weights[name].detach(), 1 - decay)
        if step % LOG_EVERY == 0 or last:
            values = {name: float(value.detach()) for name, value in terms.items()}
            about = {"step": step, "samples": samples, "seconds": elapsed, "learning_rate": rate}
            rows.append(about | values)
        if time.monotonic() - saved > SAVE_EVERY_S or last:
            saved = time.monotonic()
            _write_log(folder / LOG_FILE, rows)
            save(
                {name: value.numpy() for name, value in average.items()},
                {"steps_done": step + 1, "samples": samples},
            )
        if last:
            break


def learning_rate(settings: MdnTraining, step: int, share: float) -> float:
    """Learning rate of a step, after a share of the time that the run may take: it rises, then falls."""
    rise = min(1.0, (step + 1) / max(min(settings.warmup, settings.steps), 1))
    done = min(1.0, max(step / settings.steps, share))
    return settings.learning_rate * rise * (0.01 + 0.99 * 0.5 * (1.0 + math.cos(math.pi * done)))


def _write_log(path: Path, rows: list[dict[str, Any]]) -> None:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: f"{value:.8g}" for name, value in row.items()} for row in rows)
    write_whole(path, text.getvalue(), DataError)
