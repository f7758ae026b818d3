"""`finlab train allocator`: imitation, guidance through the surrogate, entropy (paper, main training)."""

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from finlab.inference.checkpoint import read_checkpoint, resolve_checkpoint
from finlab.inference.features import SIZES, fin_frame_features, geometry, raw_features
from finlab.inference.weights import NetworkConfig, TrainedWeights
from finlab.layout import FinModelSpec
from finlab.physics import make_law
from finlab.training import losses
from finlab.training.device import (
    autocast_dtype,
    join_processes,
    leave_processes,
    share_of_batch,
    training_device,
)
from finlab.training.loop import LoopSettings, plot_log, train
from finlab.training.networks.allocator_network import AllocatorNetwork
from finlab.training.presets import AllocatorTraining, get_preset
from finlab.training.sampling import Batch, ForwardSampler, seeded_generator
from finlab.training.saving import save_checkpoint, state_of, surrogate_of
from finlab.training.surrogate import TRAIN_SEED


def train_allocator(
    preset: str,
    out: Path,
    *,
    surrogate: Path,
    seed: int = 0,
    steps: int | None = None,
    batch_size: int | None = None,
    learning_rate: float | None = None,
    stop_after: int | None = None,
    overrides: dict[str, Any] | None = None,
    network_overrides: dict[str, Any] | None = None,
) -> TrainedWeights:
    """Train a preset's allocator network and write a whole checkpoint folder.

    A run that was stopped goes on where it was when called again with the same arguments. Under
    `torchrun` every process computes its share of each batch.

    Args:
        preset: name of the recipe.
        out: folder for checkpoint, log, loss curves and resume state.
        surrogate: checkpoint folder of the trained surrogate, which stays as it is.
        seed: seed of the data and of the first weights.
        steps: optimizer steps instead of the preset's.
        batch_size: samples per step, over all processes, instead of the preset's.
        learning_rate: peak learning rate instead of the preset's.
        stop_after: stop (resumable) after so many steps.
        overrides: other fields of `AllocatorTraining` to change, for ablations.
        network_overrides: fields of `NetworkConfig` to change, for ablations.
    """
    recipe = get_preset(preset)
    recipe = replace(recipe, network=replace(recipe.network, **(network_overrides or {})))
    base = read_checkpoint(resolve_checkpoint(surrogate))
    changes = {"steps": steps, "batch_size": batch_size, "learning_rate": learning_rate, **(overrides or {})}
    training = replace(recipe.allocator_training, **{k: v for k, v in changes.items() if v is not None})
    rank, world = join_processes()
    device = training_device()
    torch.manual_seed(seed)
    network = AllocatorNetwork(recipe.network, SIZES[recipe.network.features]).to(device)
    terms = make_terms(base, recipe.network, training, seed, device, rank, world)
    identity: dict[str, Any] = {
        "preset": preset,
        "seed": seed,
        "training": asdict(training),
        "network": asdict(recipe.network),
        "surrogate_sha256": base.sha256,
    }

    def save(weights: dict[str, Tensor], step: int) -> None:
        done = {"steps_done": step, "samples": step * training.batch_size}
        made = {**base.training, "allocator": identity | done}
        config, state = recipe.network, state_of(weights)
        whole = replace(base, preset=preset, network_config=config, network=state, training=made)
        save_checkpoint(out, whole)
        plot_log(out)

    settings = LoopSettings(
        training.steps,
        training.batch_size,
        training.learning_rate,
        warmup=training.warmup,
        cosine=training.cosine,
        ema=training.ema,
    )
    train(network, terms, settings, out, identity, stop_after=stop_after, on_save=save)
    leave_processes()
    return read_checkpoint(out) if rank == 0 else base


def make_terms(
    base: TrainedWeights,
    network: NetworkConfig,
    training: AllocatorTraining,
    seed: int,
    device: torch.device,
    rank: int = 0,
    world: int = 1,
) -> Callable[[nn.Module, int], dict[str, Tensor]]:
    """The loss terms of a step, for this process's share of the batch."""
    model, surrogate = make_law(FinModelSpec.from_values(base.fin_model)), surrogate_of(base).to(device)
    sampler = ForwardSampler(
        TRAIN_SEED + seed, training.batch_size, fin_model=model, varied_limits=training.varied_limits
    )
    mean, std = (torch.tensor(v, dtype=torch.float32, device=device) for v in base.normalization)
    share = share_of_batch(training.batch_size, rank, world)
    # Only the network runs in reduced precision; statistics, losses and physics stay in float32.
    dtype = autocast_dtype(device.type)
    autocast = torch.autocast(device.type, dtype, enabled=dtype is not None)

    def terms(net: nn.Module, step: int) -> dict[str, Tensor]:
        batch = Batch(*(t[share].to(device) for t in sampler.batch(step)))
        target = (batch.wrench - mean) / std
        x = node_features(network, batch, target, std)
        with autocast:
            mixture = net(x, target, batch.lower, batch.upper, batch.mask)
        result = {
            "imitation": losses.imitation(mixture, batch, spread_only=training.imitate == "spread").mean(),
            "entropy": losses.negative_entropy(mixture, batch.mask).mean(),
        }
        # The surrogate's wrench is compared to the absolute target: mean and std cancel in the difference.
        shifted = target + mean / std
        if training.guide == "samples":
            noise = seeded_generator(TRAIN_SEED + seed, step, device)
            whole = (share, training.batch_size)
            guidance = losses.sample_guidance(mixture, surrogate, batch, shifted, std, noise, whole).mean()
        else:
            soft, best = losses.mode_guidance(
                mixture,
                surrogate,
                batch,
                shifted,
                std,
                energy_weight=training.energy,
                softness=training.softness,
                every_mode=training.every_mode,
            )
            guidance, result["best_error"] = soft.mean(), best.mean()
        result["guidance"] = guidance
        ramp = min(1.0, step / max(1.0, training.ramp * training.steps))
        beta = training.guidance_start + ramp * (training.guidance - training.guidance_start)
        loss = (
            training.imitation * result["imitation"] + beta * guidance + training.entropy * result["entropy"]
        )
        return {"loss": loss, **result}

    return terms


def node_features(network: NetworkConfig, batch: Batch, target: Tensor, std: Tensor) -> Tensor:
    """Node features (B, n, F) of a training batch, as the network's configuration wants them."""
    layout = (batch.position, batch.mounting_angle, batch.lower, batch.upper)
    raw = network.features == "raw"
    features: Tensor = (
        raw_features(*layout) if raw else fin_frame_features(geometry(*layout, std, batch.mask), target)
    )
    return features
