"""`finlab train mdn`: a joint mixture over all fins' forces, taught by descents from many starts.

One process answers random targets on random robots and writes shards; this one learns from
what there is. The loss is the mixture's negative log-likelihood of the different ways to deliver a target,
weighted by their costs: so components come to stand for ways, and the cheapest way's gets the largest weight.
"""

import multiprocessing
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from finlab.arrays import Array
from finlab.errors import DataError, FinlabError
from finlab.mdn.network import ForceMixture, ForceNetworkConfig
from finlab.mdn.training.batches import Answers, Batch
from finlab.mdn.training.recipes import RECIPES, AnswerSettings, MdnTraining
from finlab.mdn.training.shards import write_shard
from finlab.networks.checkpoint import read_checkpoint, read_normalization, resolve_checkpoint
from finlab.networks.trained import State, TrainedWeights, sizes_for_file
from finlab.training.first_weights import first_weights
from finlab.training.loop import LOG_EVERY, Terms, train
from finlab.training.recipes import get_recipe
from finlab.training.saving import Tensors, make_folder, save_checkpoint

TRAIN_SEED = 140_000
"""Added to the user's seed."""
LOOK_EVERY = 10 * LOG_EVERY
"""Steps after which new answers are looked for, and the held-out loss is taken."""
HELD_OUT = 16
"""Batches over which that is taken."""


def train_mdn(
    preset: str,
    out: Path,
    *,
    seed: int = 0,
    stop_after: int | None = None,
    **training: Any,
) -> TrainedWeights:
    """Train a preset's network, while another process writes answers to `out/answers`, and write a
    checkpoint.

    A run that was stopped goes on where it was when called again with the same arguments. What it learned
    from depends on how many answers there were at each step, and so on the machine.

    Arguments are those of `train_allocator`; `training` are fields of `MdnTraining`.
    """
    recipe = get_recipe(RECIPES, preset)
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

    def save(network: State, run: dict[str, Any]) -> None:
        trained = TrainedWeights(out.name, normalization, sizes_for_file(recipe.network), network)
        save_checkpoint(out, replace(trained, preset=preset, training={"mdn": run}))

    # What takes the teacher a second takes a network in one process as long: each gets a core.
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    folder = out / "answers"
    make_folder(folder)
    task = (folder, recipe.answers, normalization.std, seed)
    writer = multiprocessing.get_context("spawn").Process(target=write_answers, args=task, daemon=True)
    writer.start()
    try:
        terms = make_terms(recipe.network, folder, recipe.answers, settings, seed, writer)
        weights = first_weights(recipe.network.shapes(), seed)
        train(weights, terms, settings, out, identity, stop_after=stop_after, on_save=save)
    finally:
        writer.terminate()
        writer.join()
        torch.set_num_threads(threads)
    return read_checkpoint(out)


def write_answers(folder: Path, settings: AnswerSettings, scale: Array, seed: int) -> None:
    """Write the files of answers that are missing, one after the other; a process of its own."""
    try:
        for number in range(settings.shards):
            write_shard(folder, settings, scale, seed, number)
    except FinlabError as error:
        print(f"finlab: error: {error}", file=sys.stderr)
        sys.exit(2)


def make_terms(
    network: ForceNetworkConfig,
    folder: Path,
    answers: AnswerSettings,
    training: MdnTraining,
    seed: int,
    writer: BaseProcess,
) -> Terms:
    """The loss terms of a step; waits for the first answers."""
    learned, held_out = Answers(), Answers()
    _wait(folder, answers.first, writer)
    first = _written(folder)[0]
    held_out.read([first])
    rows = [
        held_out.draw(np.random.default_rng([TRAIN_SEED, k]), training.batch_size) for k in range(HELD_OUT)
    ]
    judged = torch.zeros(())

    def net_of(w: Tensors) -> Callable[..., ForceMixture]:
        return partial(network, w)

    def terms(w: Tensors, step: int) -> dict[str, Tensor]:
        nonlocal judged
        if step % LOOK_EVERY == 0 or not len(learned):
            learned.read(_written(folder)[1:])
            with torch.no_grad():
                judged = torch.stack([losses(net_of(w), batch, 1.0, 0.0)["loss"] for batch in rows]).mean()
        batch = learned.draw(np.random.default_rng([TRAIN_SEED + seed, step]), training.batch_size)
        cold = min(1.0, step / max(training.anneal, 1))
        temper = float(batch.nodes.shape[1]) ** (1.0 - cold)
        result = losses(net_of(w), batch, temper, training.spread)
        return {**result, "held_out": judged, "targets": torch.tensor(float(len(learned)))}

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


def _wait(folder: Path, count: int, writer: BaseProcess) -> None:
    """Wait for so many files of answers; a bar shows how many there are."""
    with tqdm(total=count, desc="first answers", unit="file", disable=not sys.stderr.isatty()) as bar:
        # A bar that is off, where nobody looks, counts nothing itself.
        while (there := min(count, len(_written(folder)))) < count:
            bar.n = there
            bar.refresh()
            if writer.exitcode:
                raise DataError(f"{folder}: the process that writes answers has ended; see its message above")
            time.sleep(0.2)


def _written(folder: Path) -> list[Path]:
    """The files of answers that are whole, in order."""
    return sorted(folder.glob("answers-*.npz"))
