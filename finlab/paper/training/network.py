"""`finlab train allocator`: imitation, guidance through the surrogate, entropy (paper, main training)."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from finlab.errors import DataError
from finlab.layout import FinModelSpec
from finlab.layout.random import TRAINING_FINS
from finlab.networks.checkpoint import read_checkpoint, resolve_checkpoint
from finlab.networks.trained import State, TrainedWeights, sizes_for_file
from finlab.paper.features import raw_features
from finlab.paper.network import NetworkConfig
from finlab.paper.surrogate import SurrogateConfig
from finlab.paper.training import losses
from finlab.paper.training.recipes import RECIPES, AllocatorTraining
from finlab.paper.training.sampling import Batch, RecordedSamples, seeded_generator
from finlab.paper.training.surrogate import TRAIN_SEED
from finlab.physics import make_law
from finlab.training.device import autocast_dtype, training_device
from finlab.training.first_weights import first_weights
from finlab.training.loop import Terms, train
from finlab.training.recipes import get_recipe
from finlab.training.saving import Tensors, save_checkpoint, tensors_of

N_FINS = TRAINING_FINS[1]
"""Fins that every robot of a batch is padded to."""


def train_allocator(
    preset: str,
    out: Path,
    *,
    surrogate: Path,
    start: Path | None = None,
    seed: int = 0,
    stop_after: int | None = None,
    network: Mapping[str, Any] | None = None,
    **training: Any,
) -> TrainedWeights:
    """Train a preset's allocator network and write a whole checkpoint folder.

    A run that was stopped goes on where it was when called again with the same arguments.

    Args:
        preset: name of the recipe.
        out: folder for checkpoint, log, loss curves and resume state.
        surrogate: checkpoint folder of the trained surrogate, which stays as it is.
        start: checkpoint folder of a network of the same sizes to begin with; random weights if None.
        seed: seed of the data and of the first weights.
        stop_after: stop (resumable) after so many steps.
        network: fields of `NetworkConfig` that differ from the preset's.
        training: fields of `AllocatorTraining` that differ from the preset's; None does not.
    """
    recipe = get_recipe(RECIPES, preset)
    base = read_checkpoint(resolve_checkpoint(surrogate))
    config = replace(recipe.network, **(network or {}))
    settings = replace(recipe.allocator_training, **{k: v for k, v in training.items() if v is not None})
    device = training_device()
    weights = first_weights(config.shapes(), seed)
    before = None if start is None else read_checkpoint(resolve_checkpoint(start))
    if before is not None:
        if before.network_of(NetworkConfig) != config:
            raise DataError(
                f"checkpoint {before.name!r}: its network has other sizes; start from one of the same sizes"
            )
        weights = tensors_of(before.network)
    weights = {name: value.to(device).requires_grad_() for name, value in weights.items()}
    identity: dict[str, Any] = {
        "preset": preset,
        "seed": seed,
        "training": asdict(settings),
        "network": asdict(config),
        "surrogate_sha256": base.sha256,
        "start": None if before is None else {"sha256": before.sha256, **before.training["allocator"]},
    }

    def save(network: State, run: dict[str, Any]) -> None:
        made = {**base.training, "allocator": run}
        sizes = sizes_for_file(config)
        save_checkpoint(
            out, replace(base, preset=preset, network_sizes=sizes, network=network, training=made)
        )

    terms = make_terms(base, config, settings, seed, device)
    train(weights, terms, settings, out, identity, stop_after=stop_after, on_save=save)
    return read_checkpoint(out)


def make_terms(
    base: TrainedWeights,
    config: NetworkConfig,
    training: AllocatorTraining,
    seed: int,
    device: torch.device,
) -> Terms:
    """The loss terms of a step, guided by the surrogate of `base`."""
    model = make_law(FinModelSpec.from_values(base.fin_model))
    fixed = {name: value.to(device) for name, value in tensors_of(base.surrogate).items()}
    surrogate = losses.Surrogate(SurrogateConfig.of(base), fixed)
    samples = RecordedSamples(model, training, TRAIN_SEED + seed, device)
    mean, std = (torch.tensor(v, dtype=torch.float32, device=device) for v in base.normalization)
    # Only the network runs in reduced precision; statistics, losses and physics stay in float32.
    dtype = autocast_dtype(device.type)
    autocast = torch.autocast(device.type, dtype, enabled=dtype is not None)

    def parts(w: Tensors, batch: Batch, noise: tuple[Tensor, Tensor]) -> tuple[Tensor, Tensor, Tensor]:
        target = (batch.wrench - mean) / std
        x = raw_features(batch.position, batch.mounting_angle, batch.lower, batch.upper)
        with autocast:
            mixture = config(w, x, target, batch.mask)
        # The surrogate's wrench is compared to the absolute target: mean and std cancel in the difference.
        guidance = losses.sample_guidance(mixture, surrogate, batch, target + mean / std, std, noise)
        imitation, entropy = losses.imitation(mixture, batch), losses.negative_entropy(mixture, batch.mask)
        return imitation.mean(), entropy.mean(), guidance.mean()

    # A GPU is kept waiting by the many small steps of the losses unless they are fused.
    fused = torch.compile(parts) if device.type == "cuda" else parts

    def terms(w: Tensors, step: int) -> dict[str, Tensor]:
        batch = samples.batch(step)
        generator, shape = seeded_generator(TRAIN_SEED + seed, step, device), (training.batch_size, N_FINS, 1)
        uniform = torch.rand(shape, generator=generator, device=device)
        normal = torch.randn((*shape, 3), generator=generator, device=device)
        imitation, entropy, guidance = fused(w, batch, (uniform, normal))
        ramp = min(1.0, step / max(1.0, training.ramp * training.steps))
        beta = training.guidance_start + ramp * (training.guidance - training.guidance_start)
        loss = imitation + beta * guidance + training.entropy * entropy
        return {"loss": loss, "imitation": imitation, "entropy": entropy, "guidance": guidance}

    return terms
