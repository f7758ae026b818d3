"""`finlab train surrogate`: learn the fin physics from forward samples (paper, surrogate pretraining)."""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from finlab.layout import FinModelSpec
from finlab.networks.normalization import Normalization
from finlab.networks.trained import TrainedWeights
from finlab.paper.surrogate import SurrogateConfig
from finlab.paper.training.losses import Surrogate
from finlab.paper.training.recipes import RECIPES, SampledTraining
from finlab.paper.training.sampling import RecordedSamples, fresh_batch
from finlab.physics import FinLaw, make_law
from finlab.training.device import training_device
from finlab.training.first_weights import first_weights
from finlab.training.loop import Terms, train
from finlab.training.recipes import get_recipe
from finlab.training.saving import Tensors, save_checkpoint, tensors_of

TRAIN_SEED = 20_000
"""Added to the user's seed, so that no training stream equals one of evaluation."""
NORMALIZATION_SAMPLES = 200_000
"""Samples with nominal limits over which the wrench statistics are taken."""


def train_surrogate(
    preset: str,
    out: Path,
    *,
    seed: int = 0,
    stop_after: int | None = None,
    fin_model: FinModelSpec | None = None,
    **training: Any,
) -> TrainedWeights:
    """Train a preset's surrogate on a fin model, `drag` by default, and write a checkpoint folder without an
    allocator network; `training` are fields of `SampledTraining`, other arguments as in `train_allocator`."""
    recipe = get_recipe(RECIPES, preset)
    spec = fin_model or FinModelSpec()
    model, written = make_law(spec), {"type": spec.type, **dict(spec.parameters)}
    settings = replace(recipe.surrogate_training, **{k: v for k, v in training.items() if v is not None})
    config, device = recipe.surrogate, training_device()
    weights = {name: value.detach().to(device) for name, value in first_surrogate(config, seed).items()}
    normalization = measure_normalization(model, seed)
    identity: dict[str, Any] = {
        "preset": preset,
        "seed": seed,
        "training": asdict(settings),
        "surrogate": asdict(config),
        "fin_model": written,
    }
    terms = _wrench_terms(config, model, settings, seed, normalization, device)
    trainable = {name: value.requires_grad_() for name, value in weights.items()}
    trained = train(trainable, terms, settings, out, identity, stop_after=stop_after)
    checkpoint = TrainedWeights(
        name=out.name,
        normalization=normalization,
        fin_model=written,
        surrogate_sizes=config.for_file(),
        surrogate=trained,
        preset=preset,
        training={"surrogate": identity | {"samples": settings.steps * settings.batch_size}},
        metrics={"surrogate": surrogate_metrics(config, tensors_of(trained), model, seed + 1)},
    )
    return save_checkpoint(out, checkpoint)


def first_surrogate(config: SurrogateConfig, seed: int) -> Tensors:
    """Random weights to start from; at first no layout is stretched or shifted."""
    weights = first_weights(config.shapes(), seed)
    with torch.no_grad():
        # Angles enter as plain numbers and their sines must be learned; wider first weights start
        # nearer to that (measured: a sixth of the loss after the same minute).
        first = weights["net.0.weight"]
        first *= 0.8 / first.abs().max()
        for name in ("affine.weight", "affine.bias"):
            weights[name].zero_()
    return weights


def measure_normalization(model: FinLaw, seed: int) -> Normalization:
    """Wrench statistics over layouts of 2-5 fins with nominal limits."""
    batch = fresh_batch(model, NORMALIZATION_SAMPLES, TRAIN_SEED + seed, varied_limits=0.0)
    return Normalization.of(batch.wrench.numpy())


def surrogate_metrics(
    config: SurrogateConfig, weights: Tensors, model: FinLaw, seed: int
) -> dict[str, float]:
    """Mean normalized error of the wrench by the fin model, on fresh samples, half of them with varied
    limits."""
    batch = fresh_batch(model, 50_000, TRAIN_SEED + 7_000 + seed)
    std = torch.tensor(measure_normalization(model, seed).std)
    with torch.inference_mode():
        error = ((Surrogate(config, weights).wrench(batch.command, batch) - batch.wrench) / std).norm(dim=-1)
    return {"wrench_error_norm": float(error.mean())}


def _wrench_terms(
    config: SurrogateConfig,
    model: FinLaw,
    training: SampledTraining,
    seed: int,
    normalization: Normalization,
    device: torch.device,
) -> Terms:
    """The paper's L_phys: squared error of the normalized wrench of whole robots."""
    samples = RecordedSamples(model, training, TRAIN_SEED + seed, device)
    std = torch.tensor(normalization.std, dtype=torch.float32, device=device)

    def terms(w: Tensors, step: int) -> dict[str, Tensor]:
        batch = samples.batch(step)
        wrench = Surrogate(config, w).wrench(batch.command, batch)
        return {"loss": ((wrench - batch.wrench) / std).square().sum(-1).mean()}

    return terms
