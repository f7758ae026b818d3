"""`finlab train surrogate`: learn the fin physics from forward samples (paper, surrogate pretraining)."""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from finlab.inference.normalization import Normalization
from finlab.inference.weights import TrainedWeights
from finlab.layout import FinModelSpec
from finlab.physics import FinLaw, make_law
from finlab.training.device import Share, shared_training
from finlab.training.loop import Terms, train
from finlab.training.networks.surrogate import Surrogate
from finlab.training.presets import PAPER_RECIPES, SampledTraining, get_recipe
from finlab.training.recorded import recorded_samples
from finlab.training.sampling import ForwardSampler
from finlab.training.saving import save_checkpoint, state_of

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
    recipe = get_recipe(PAPER_RECIPES, preset)
    spec = fin_model or FinModelSpec()
    model, written = make_law(spec), {"type": spec.type, **dict(spec.parameters)}
    settings = replace(recipe.surrogate_training, **{k: v for k, v in training.items() if v is not None})
    torch.manual_seed(seed)
    surrogate = Surrogate(recipe.surrogate)
    normalization = measure_normalization(model, seed)
    identity: dict[str, Any] = {
        "preset": preset,
        "seed": seed,
        "training": asdict(settings),
        "surrogate": asdict(recipe.surrogate),
        "fin_model": written,
    }
    with shared_training(settings.batch_size) as share:
        surrogate.to(share.device)
        terms = _wrench_terms(model, settings, seed, normalization, share)
        weights = train(surrogate, terms, settings, out, identity, stop_after=stop_after)
    surrogate.load_state_dict(weights, strict=True)
    surrogate.cpu().eval().requires_grad_(False)
    checkpoint = TrainedWeights(
        name=out.name,
        normalization=normalization,
        fin_model=written,
        surrogate_config=recipe.surrogate,
        surrogate=state_of(surrogate.state_dict()),
        preset=preset,
        training={"surrogate": identity | {"samples": settings.steps * settings.batch_size}},
        metrics={"surrogate": surrogate_metrics(surrogate, model, seed + 1)},
    )
    return save_checkpoint(out, checkpoint) if share.first else checkpoint


def measure_normalization(model: FinLaw, seed: int) -> Normalization:
    """Wrench statistics over layouts of 2-5 fins with nominal limits."""
    sampler = ForwardSampler(TRAIN_SEED + seed, NORMALIZATION_SAMPLES, fin_model=model, varied_limits=0.0)
    return Normalization.of(sampler.batch(0).wrench.numpy())


def surrogate_metrics(surrogate: Surrogate, model: FinLaw, seed: int) -> dict[str, float]:
    """Mean normalized error of the wrench by the fin model, on fresh samples, half of them with varied
    limits."""
    sampler = ForwardSampler(TRAIN_SEED + 7_000 + seed, 50_000, fin_model=model)
    batch = sampler.batch(0)
    std = measure_normalization(model, seed).std
    with torch.inference_mode():
        limits = (batch.lower, batch.upper, batch.mask)
        wrench = surrogate(batch.command, batch.position, batch.mounting_angle, *limits)
        error = ((wrench - batch.wrench) / torch.tensor(std)).norm(dim=-1)
    return {"wrench_error_norm": float(error.mean())}


def _wrench_terms(
    model: FinLaw, training: SampledTraining, seed: int, normalization: Normalization, share: Share
) -> Terms:
    """The paper's L_phys: squared error of the normalized wrench of whole robots."""
    samples = recorded_samples(model, training, TRAIN_SEED + seed, share.device)
    std = torch.tensor(normalization.std, dtype=torch.float32, device=share.device)

    def terms(net: nn.Module, step: int) -> dict[str, Tensor]:
        b = samples.batch(step, share.rows)
        wrench = net(b.command, b.position, b.mounting_angle, b.lower, b.upper, b.mask)
        return {"loss": ((wrench - b.wrench) / std).square().sum(-1).mean()}

    return terms
