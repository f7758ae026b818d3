"""`finlab train fast`: fit the distilled network to the allocator's best answers.

Two terms: the shares of thrust of the best answer, and what the decoded shares cost beyond that answer. The
first points to the right mode, the second settles what the mean of two modes would leave undecided.
"""

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from finlab.allocation.learned.fast import FastAllocator
from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.inference.fast_network import FastWeights, save_fast
from finlab.inference.features import FIN_FRAME_SIZE, fin_frame_features, geometry
from finlab.inference.normalization import Normalization
from finlab.layout import random_layout
from finlab.physics import Plant
from finlab.physics.energy import command_energy
from finlab.training.distill.answers import Answers, AnswerSettings, Array, read_answers, write_answers
from finlab.training.distill.network import FastConfig, FastNetwork, decode, energy
from finlab.training.loop import LoopSettings, train
from finlab.training.saving import state_of

SEED = 80_000
"""Added to the user's seed."""
ENERGY_WEIGHT = 0.3
"""Weight of the cost beyond the best answer's, in units of that answer's energy."""


FAST_TRAINING = LoopSettings(20_000, 1024, 2e-3, warmup=200, ema=0.999)
"""How the distilled network is trained."""


def train_fast(
    allocator: LearnedAllocator,
    out: Path,
    *,
    config: FastConfig,
    settings: LoopSettings,
    data: AnswerSettings,
    stop_after: int | None = None,
) -> dict[str, float]:
    """Write missing answers to `out/answers`, train, and write the weights to `out`; resumable throughout.

    Returns:
        Losses on layouts that were held out, and `fast_metrics`.
    """
    write_answers(allocator, out / "answers", data)
    answers = read_answers(out / "answers")
    n = len(answers.position)
    cut = min(round(n * 0.98), n - 1)
    learned, judged = (Answers(*(a[rows] for a in answers)) for rows in (slice(cut), slice(cut, None)))
    torch.manual_seed(SEED + data.seed)
    network = FastNetwork(config, FIN_FRAME_SIZE)
    batches = Batches(learned, allocator.normalization)

    def terms(net: nn.Module, step: int) -> dict[str, Tensor]:
        rng = np.random.default_rng([SEED + data.seed, step])
        return losses(net, *batches.draw(rng, settings.batch_size))

    identity: dict[str, Any] = {"fast": asdict(settings) | asdict(config), "answers": asdict(data)}

    def save(weights: dict[str, Tensor], **about: object) -> None:
        fast = FastWeights(state_of(weights), config.rounds)
        save_fast(out, fast, identity | {"checkpoint": allocator.checkpoint} | about)

    weights = train(
        network,
        terms,
        settings,
        out,
        identity,
        stop_after=stop_after,
        on_save=lambda weights, step: save(weights, step=step),
    )
    network.load_state_dict(weights, strict=True)
    with torch.inference_mode():
        held_out = losses(network, *Batches(judged, allocator.normalization).all())
    metrics = {f"held_out_{name}": float(value) for name, value in held_out.items()}
    metrics |= fast_metrics(allocator, FastWeights(state_of(weights), config.rounds))
    save(weights, metrics=metrics)
    return metrics


def losses(net: Callable[..., Tensor], features: Tensor, batch: Answers[Tensor]) -> dict[str, Tensor]:
    """The loss and its parts, means over a batch with these node features (B, n, F)."""
    share = net(features, batch.mask)
    apart = nn.functional.smooth_l1_loss(share, batch.share, reduction="none", beta=0.1)
    imitation = (apart * batch.mask).sum() / batch.mask.sum()
    forces = decode(share, batch.columns, batch.maximum, batch.mask, batch.target)
    beyond = energy(forces, batch.mask) / batch.energy
    # Arcs are not part of this decoding; there the answers alone are the teacher.
    regret = ((beyond - 1.0).clamp(-0.5, 3.0) * batch.free).sum() / batch.free.sum().clamp_min(1)
    return {"loss": imitation + ENERGY_WEIGHT * regret, "imitation": imitation, "regret": regret}


class Batches:
    """Draws batches from answers; node features are made as they are needed."""

    def __init__(self, answers: Answers[Array], normalization: Normalization) -> None:
        """Take over answers in memory."""
        self._answers, self._normalization = answers, normalization
        position, angle, lower, upper = (np.asarray(a, dtype=np.float64) for a in answers[:4])
        self._geometry = geometry(position, angle, lower, upper, normalization.std, answers.mask)

    def draw(self, rng: np.random.Generator, size: int) -> tuple[Tensor, Answers[Tensor]]:
        """Node features and answers of a random batch."""
        n_layouts, n_targets, _ = self._answers.target.shape
        return self._of(rng.integers(n_layouts, size=size), rng.integers(n_targets, size=size))

    def all(self) -> tuple[Tensor, Answers[Tensor]]:
        """Everything at once."""
        rows, columns = np.indices(self._answers.energy.shape)
        return self._of(rows.ravel(), columns.ravel())

    def _of(self, row: Array, place: Array) -> tuple[Tensor, Answers[Tensor]]:
        a = self._answers
        parts = [part[row] for part in a[:8]] + [part[row, place] for part in a[8:]]
        picked = Answers(*parts)
        centred = picked.target - self._normalization.mean / self._normalization.std
        seen = type(self._geometry)(*(part[row] for part in self._geometry))
        return _tensor(fin_frame_features(seen, centred)), Answers(*map(_tensor, picked))


def _tensor(values: Array) -> Tensor:
    return torch.from_numpy(np.asarray(values, dtype=np.float32))


JUDGE_SEED = 90_000
"""Of the layouts and targets measured here."""


def fast_metrics(
    allocator: LearnedAllocator, weights: FastWeights, n_layouts: int = 60, n_targets: int = 50
) -> dict[str, float]:
    """Error by the analytic fin model, and energy over that of the full pipeline, on nominal limits.

    `energy_ratio` is the mean over targets of the one energy over the other.
    """
    fast = FastAllocator(replace(allocator.weights, fast=weights))
    rng = np.random.default_rng(JUDGE_SEED)
    errors, ratios = [], []
    for _ in range(n_layouts):
        layout = random_layout(rng)
        plant, lower, upper = Plant(layout), layout.lower, layout.upper
        targets = plant.wrench(lower + rng.random((n_targets, layout.n_fins, 3)) * (upper - lower))
        quick = fast.allocate_batch(layout, targets).command
        whole = allocator.allocate_batch(layout, targets).command
        errors.append(allocator.normalization.error(plant.wrench(quick), targets))
        ratios.append(command_energy(quick, upper) / command_energy(whole, upper))
    error, ratio = np.concatenate(errors), np.concatenate(ratios)
    return {
        "err_norm_mean": float(error.mean()),
        "err_norm_max": float(error.max()),
        "energy_ratio": float(ratio.mean()),
        "energy_ratio_p95": float(np.percentile(ratio, 95)),
    }
