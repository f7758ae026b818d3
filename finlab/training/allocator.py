"""`finlab train allocator`: imitation, guidance through the surrogate, entropy (paper, main training)."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from finlab.inference.checkpoint import read_checkpoint, resolve_checkpoint
from finlab.inference.features import raw_features
from finlab.inference.weights import State, TrainedWeights
from finlab.layout import FinModelSpec
from finlab.layout.random import TRAINING_FINS
from finlab.physics import make_law
from finlab.training import losses
from finlab.training.device import autocast_dtype, shared_training
from finlab.training.loop import Terms, train
from finlab.training.networks.allocator_network import AllocatorNetwork
from finlab.training.presets import PAPER_RECIPES, AllocatorTraining, get_recipe
from finlab.training.recorded import recorded_samples
from finlab.training.sampling import Batch, seeded_generator
from finlab.training.saving import load_network, save_checkpoint, surrogate_of
from finlab.training.surrogate import TRAIN_SEED

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

    A run that was stopped goes on where it was when called again with the same arguments. Under
    `torchrun` every process computes its share of each batch.

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
    recipe = get_recipe(PAPER_RECIPES, preset)
    base = read_checkpoint(resolve_checkpoint(surrogate))
    config = replace(recipe.network, **(network or {}))
    settings = replace(recipe.allocator_training, **{k: v for k, v in training.items() if v is not None})
    torch.manual_seed(seed)
    model = AllocatorNetwork(config)
    before = None if start is None else read_checkpoint(resolve_checkpoint(start))
    if before is not None:
        load_network(model, before)
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
        save_checkpoint(
            out, replace(base, preset=preset, network_config=config, network=network, training=made)
        )

    with shared_training(settings.batch_size) as share:
        terms = make_terms(base, settings, seed, share.device, share.rows)
        train(model.to(share.device), terms, settings, out, identity, stop_after=stop_after, on_save=save)
    return read_checkpoint(out) if share.first else base


def make_terms(
    base: TrainedWeights,
    training: AllocatorTraining,
    seed: int,
    device: torch.device,
    rows: slice = slice(None),
) -> Terms:
    """The loss terms of a step, for these rows of the batch."""
    model, surrogate = make_law(FinModelSpec.from_values(base.fin_model)), surrogate_of(base).to(device)
    samples = recorded_samples(model, training, TRAIN_SEED + seed, device)
    mean, std = (torch.tensor(v, dtype=torch.float32, device=device) for v in base.normalization)
    # Only the network runs in reduced precision; statistics, losses and physics stay in float32.
    dtype = autocast_dtype(device.type)
    autocast = torch.autocast(device.type, dtype, enabled=dtype is not None)

    def parts(net: nn.Module, batch: Batch, noise: tuple[Tensor, Tensor]) -> tuple[Tensor, Tensor, Tensor]:
        target = (batch.wrench - mean) / std
        x = raw_features(batch.position, batch.mounting_angle, batch.lower, batch.upper)
        with autocast:
            mixture = net(x, target, batch.mask)
        # The surrogate's wrench is compared to the absolute target: mean and std cancel in the difference.
        guidance = losses.sample_guidance(mixture, surrogate, batch, target + mean / std, std, noise)
        imitation, entropy = losses.imitation(mixture, batch), losses.negative_entropy(mixture, batch.mask)
        return imitation.mean(), entropy.mean(), guidance.mean()

    # A GPU is kept waiting by the many small steps of the losses unless they are fused.
    fused = torch.compile(parts) if device.type == "cuda" else parts

    def terms(net: nn.Module, step: int) -> dict[str, Tensor]:
        batch = samples.batch(step, rows)
        # The noise is that of the whole batch, however it is shared among processes.
        generator, shape = seeded_generator(TRAIN_SEED + seed, step, device), (training.batch_size, N_FINS)
        uniform = torch.rand((*shape, 1), generator=generator, device=device)
        normal = torch.randn((*shape, 3), generator=generator, device=device)
        imitation, entropy, guidance = fused(net, batch, (uniform[rows], normal[rows]))
        ramp = min(1.0, step / max(1.0, training.ramp * training.steps))
        beta = training.guidance_start + ramp * (training.guidance - training.guidance_start)
        loss = imitation + beta * guidance + training.entropy * entropy
        return {"loss": loss, "imitation": imitation, "entropy": entropy, "guidance": guidance}

    return terms
