"""`finlab train surrogate`: learn the fin physics from forward samples (paper, surrogate pretraining)."""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from finlab.inference.learned_fin import REFERENCE
from finlab.inference.normalization import Normalization
from finlab.inference.weights import TrainedWeights
from finlab.layout import FinModelSpec
from finlab.physics import FinLaw, make_law
from finlab.training.device import Share, shared_training
from finlab.training.loop import Terms, plot_log, train
from finlab.training.networks.surrogate import CoefficientSurrogate, Surrogate, make_surrogate
from finlab.training.presets import get_preset
from finlab.training.sampling import Batch, ForwardSampler
from finlab.training.saving import save_checkpoint, state_of

TRAIN_SEED = 20_000
"""Added to the user's seed, so that no training stream equals one of evaluation."""
NORMALIZATION_SAMPLES = 200_000
"""Samples with nominal limits over which the wrench statistics are taken."""
COMMAND_RANGE = ((0.02, 0.85), (0.05, 3.2), (-np.pi, np.pi))
"""Commands a coefficient surrogate learns: amplitude [rad], frequency [Hz], zero direction [rad]; a
little wider than every limit of the splits."""


def train_surrogate(
    preset: str,
    out: Path,
    *,
    seed: int = 0,
    steps: int | None = None,
    stop_after: int | None = None,
    fin_model: FinModelSpec | None = None,
) -> TrainedWeights:
    """Train a preset's surrogate and write a checkpoint folder without an allocator network.

    Args:
        preset: name of the recipe.
        out: folder for checkpoint, log, loss curve and resume state.
        seed: seed of the data and of the first weights.
        steps: optimizer steps instead of the preset's.
        stop_after: stop (resumable) after so many steps.
        fin_model: fin model to learn; the default `drag` otherwise.
    """
    recipe = get_preset(preset)
    spec = fin_model or FinModelSpec()
    model, written = make_law(spec), {"type": spec.type, **dict(spec.parameters)}
    training = replace(recipe.surrogate_training, steps=steps or recipe.surrogate_training.steps)
    torch.manual_seed(seed)
    surrogate = make_surrogate(recipe.surrogate)
    normalization = measure_normalization(model, seed)
    identity: dict[str, Any] = {
        "preset": preset,
        "seed": seed,
        "training": asdict(training),
        "surrogate": asdict(recipe.surrogate),
        "fin_model": written,
    }
    with shared_training(training.batch_size) as share:
        surrogate.to(share.device)
        if isinstance(surrogate, CoefficientSurrogate):
            terms = _coefficient_terms(model, training.batch_size, seed, share)
        else:
            terms = _wrench_terms(model, training.batch_size, seed, normalization, share)
        weights = train(surrogate, terms, training, out, identity, stop_after=stop_after)
    surrogate.load_state_dict(weights, strict=True)
    surrogate.cpu().eval().requires_grad_(False)
    checkpoint = TrainedWeights(
        name=out.name,
        normalization=normalization,
        fin_model=written,
        surrogate_config=recipe.surrogate,
        surrogate=state_of(surrogate.state_dict()),
        preset=preset,
        training={"surrogate": identity | {"samples": training.steps * training.batch_size}},
        metrics={"surrogate": surrogate_metrics(surrogate, model, seed + 1)},
    )
    if not share.first:
        return checkpoint
    plot_log(out)
    return save_checkpoint(out, checkpoint)


def measure_normalization(model: FinLaw, seed: int) -> Normalization:
    """Wrench statistics over layouts of 2-5 fins with nominal limits."""
    sampler = ForwardSampler(TRAIN_SEED + seed, NORMALIZATION_SAMPLES, fin_model=model, varied_limits=0.0)
    return Normalization.of(sampler.batch(0).wrench.numpy())


def surrogate_metrics(surrogate: Surrogate, model: FinLaw, seed: int) -> dict[str, float]:
    """Accuracy against the fin model on fresh samples, half of them with varied limits.

    `relative_force_error` is RMS(F - F_plant) / RMS(F_plant) per fin and is known only where the
    surrogate speaks of single fins; `wrench_error_norm` is the mean normalized wrench error.
    """
    sampler = ForwardSampler(TRAIN_SEED + 7_000 + seed, 50_000, fin_model=model)
    batch = sampler.batch(0)
    std = measure_normalization(model, seed).std
    with torch.inference_mode():
        limits = (batch.lower, batch.upper, batch.mask)
        wrench = surrogate(batch.command, batch.position, batch.mounting_angle, *limits)
        metrics = {
            "wrench_error_norm": float(((wrench - batch.wrench) / torch.tensor(std)).norm(dim=-1).mean())
        }
        if isinstance(surrogate, CoefficientSurrogate):
            command = batch.command[batch.mask]
            truth = model.force(command)
            rms = (surrogate.fin_force(command) - truth).square().mean().sqrt() / truth.square().mean().sqrt()
            metrics["relative_force_error"] = float(rms)
    return metrics


def _coefficient_terms(model: FinLaw, batch_size: int, seed: int, share: Share) -> Terms:
    """Mean squared error of force coefficients over single fins: the same relative weight for all forces."""
    device = share.device
    low, high = torch.tensor(COMMAND_RANGE, dtype=torch.float32, device=device).T
    a0, f0 = REFERENCE
    # Of a lone fin at the origin, shaft along x, the wrench's force is the force in the fin frame.
    position, angle = torch.zeros(1, 3, device=device), torch.zeros(1, device=device)

    def terms(net: nn.Module, step: int) -> dict[str, Tensor]:
        generator = torch.Generator().manual_seed((TRAIN_SEED + seed) * 1_000_003 + step)
        draw = torch.rand(batch_size, 3, generator=generator)[share.rows]
        command = low + (high - low) * draw.to(device)
        scale = (command[:, 0] * command[:, 1] / (a0 * f0)).square()[:, None]
        force = net(command[:, None], position, angle, low, high)[:, :3]
        return {"loss": ((force - model.force(command)) / scale).square().sum(-1).mean()}

    return terms


def _wrench_terms(
    model: FinLaw, batch_size: int, seed: int, normalization: Normalization, share: Share
) -> Terms:
    """The paper's L_phys: squared error of the normalized wrench of whole robots."""
    sampler = ForwardSampler(TRAIN_SEED + seed, batch_size, fin_model=model)
    std = torch.tensor(normalization.std, dtype=torch.float32, device=share.device)

    def terms(net: nn.Module, step: int) -> dict[str, Tensor]:
        b = Batch(*(t[share.rows].to(share.device) for t in sampler.batch(step)))
        wrench = net(b.command, b.position, b.mounting_angle, b.lower, b.upper, b.mask)
        return {"loss": ((wrench - b.wrench) / std).square().sum(-1).mean()}

    return terms
