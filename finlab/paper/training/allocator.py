"""`finlab train allocator`: imitation, guidance by the frozen surrogate, entropy (paper, main training)."""

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from finlab.errors import DataError
from finlab.networks.checkpoint import read_checkpoint, resolve_checkpoint, write_checkpoint
from finlab.networks.normalization import to_command, to_normalized
from finlab.networks.trained import State, TrainedWeights, sizes_for_file
from finlab.paper.network import Mixture
from finlab.paper.training.card import write_card
from finlab.paper.training.data import N_FINS, Batch
from finlab.paper.training.modules import AllocatorNetwork, Surrogate, features
from finlab.paper.training.recipes import recipe
from finlab.paper.training.surrogate import data_set, surrogate_of
from finlab.training.device import workplace
from finlab.training.loop import Training, seeded_generator

NOISE = 1_000_000
"""Added to the seed of the noise, so that it is unrelated to the order of the data."""


def imitation(mixture: Mixture, batch: Batch) -> Tensor:
    """L_imit = -log p(u* | G) of the recorded commands (B,)."""
    recorded = to_normalized(batch.command, batch.lower, batch.upper)
    likelihood: Tensor = mixture.log_prob(recorded[:, None])[:, 0]
    return -(likelihood * batch.mask).sum(1)


def guidance(
    mixture: Mixture,
    surrogate: Callable[[Tensor, Batch], Tensor],
    batch: Batch,
    std: Tensor,
    noise: tuple[Tensor, Tensor],
) -> Tensor:
    """L_guide (Eq. 6): squared normalized error (B,) of one sample of the mixture, by the surrogate.

    `noise` is uniform (B, n, 1) and standard normal (B, n, 1, 3), as `Mixture.sample` takes it. The mean mu
    cancels in the difference.
    """
    raw = to_command(mixture.sample(*noise)[:, 0], batch.lower, batch.upper)
    # The gradient passes the clamp, or samples outside the limits would teach nothing.
    command = raw + (raw.clamp(batch.lower, batch.upper) - raw).detach()
    return ((surrogate(command, batch) - batch.wrench) / std).square().sum(-1)


def negative_entropy(mixture: Mixture, mask: Tensor) -> Tensor:
    """L_ent = sum_k pi_k log pi_k (B,), the mean over fins."""
    log_weight = mixture.logits.log_softmax(-1)
    value = (log_weight.exp() * log_weight).sum(-1)
    mean: Tensor = (value * mask).sum(1) / mask.sum(1)
    return mean


def train_allocator(
    preset: str,
    out: Path,
    *,
    surrogate: Path,
    data: Path | None = None,
    seed: int = 0,
    resume: bool = False,
    device: str | None = None,
    steps: int | None = None,
) -> TrainedWeights:
    """Train a preset's network, guided by a trained surrogate, and write a whole checkpoint folder.

    Args:
        preset: one of `RECIPES`.
        out: folder for checkpoint, model card, log, curves and state, made if need be.
        surrogate: checkpoint whose surrogate guides, and stays as it is.
        data: folder of a data set; by default that in the surrogate's folder, or the recipe's in `out/data`.
        seed: of the first weights, the noise and the order of the data.
        resume: go on from the state in `out`.
        device: see `workplace`.
        steps: in place of the recipe's.

    Raises:
        DataError: an unknown preset, data or a state that do not fit, or a file that cannot be written.
        CheckpointError: the checkpoint holds no surrogate.
        CommandError: there is no such device.
    """
    made, base = recipe(preset), read_checkpoint(resolve_checkpoint(surrogate))
    settings = replace(made.allocator_training, steps=steps or made.allocator_training.steps)
    if data is None and (surrogate / "data").is_dir():
        data = surrogate / "data"
    with workplace(device, settings.batch_size) as place:
        frozen: Surrogate = surrogate_of(base, place.device)
        samples = data_set(data or out / "data", made.data, place, given=data is not None)
        if samples.settings["fin_model"] != base.fin_model:
            raise DataError(f"{data}: its wrenches are of another fin model than the surrogate's")
        torch.manual_seed(seed)
        module = AllocatorNetwork(made.network).to(place.device)
        network, rows = place.shared(module), place.share(settings.batch_size)
        mean, std = (torch.tensor(v, dtype=torch.float32, device=place.device) for v in base.normalization)

        def terms(step: int) -> dict[str, Tensor]:
            batch = samples.batch(step, settings.batch_size, seed, False, rows)
            generator = seeded_generator(NOISE + seed, step, place.device)
            noise = torch.rand((settings.batch_size, N_FINS, 1), generator=generator, device=place.device)
            normal = torch.randn((*noise.shape, 3), generator=generator, device=place.device)
            with place.autocast():
                mixture = network(features(batch), (batch.wrench - mean) / std, batch.mask)
                guide = guidance(mixture, frozen, batch, std, (noise[rows], normal[rows])).mean()
            imitate, entropy = imitation(mixture, batch).mean(), negative_entropy(mixture, batch.mask).mean()
            loss = imitate + settings.beta(step) * guide + settings.entropy * entropy  # Eq. 7
            return {"loss": loss, "imitation": imitate, "guidance": guide, "entropy": entropy}

        identity = {
            "preset": preset,
            "seed": seed,
            "training": asdict(settings),
            "data": samples.settings,
            "surrogate_sha256": base.sha256,
        }

        def save(state: State, progress: dict[str, Any]) -> None:
            trained = replace(
                base,
                name=out.name,
                preset=preset,
                network_sizes=sizes_for_file(made.network),
                network=state,
                training={**base.training, "allocator": identity | progress},
            )
            write_card(out, write_checkpoint(out, trained))

        training = Training(dict(module.named_parameters()), settings, out, identity, place)
        if resume:
            training.resume()
        training.run(terms, save)
        return read_checkpoint(out)
