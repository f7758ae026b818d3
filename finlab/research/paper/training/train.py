"""`finlab train surrogate` and `finlab train allocator`: the physics surrogate is trained first and
on its own, then the network with the surrogate frozen."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from finlab.errors import DataError
from finlab.files.checkpoint_config import read_normalization
from finlab.layout import FinModelSpec
from finlab.research.networks.checkpoint import (
    read_checkpoint,
    resolve_checkpoint,
    write_checkpoint,
)
from finlab.research.networks.trained import ArraysByName, TrainedWeights, sizes_for_file
from finlab.research.paper.surrogate import SurrogateConfig
from finlab.research.paper.training import modules
from finlab.research.paper.training.recipes import (
    PaperLoop,
    PaperRecipe,
    recipe,
    recipe_hash,
    write_card,
)
from finlab.research.paper.training.samples import (
    N_FINS,
    DataSettings,
    SampleBatch,
    SampleSet,
    fresh_batch,
    generate,
)
from finlab.research.training.device import Workplace, workplace
from finlab.research.training.loop import Terms, Training, Weights, first_weights, seeded_generator

NOISE_SEED = 1_000_000
"""Added to the seed of the noise, so that it is unrelated to the order of the data."""
HELD_OUT = DataSettings(layouts=500, commands=20, seed=7_000)
"""Samples that no training sees, from which the error of a surrogate is measured."""


@dataclass(frozen=True)
class TrainingOptions:
    """What both trainings have to know, beside the recipe."""

    preset: str
    """One of `RECIPES`."""
    output: Path
    """Folder for checkpoint, model card, log, curves and state, made if need be."""
    data: Path | None = None
    """Folder of a data set; None for the recipe's, made in `output/data`."""
    seed: int = 0
    """Of the first weights, the noise and the order of the data."""
    steps: int | None = None
    """In place of the recipe's."""
    resume: bool = False
    """Whether to go on from the state in `output`."""
    device: str | None = None
    """cpu, cuda, or None for the best there is."""


class BatchSource:
    """A data set in the memory of this process's device, and its share of every batch."""

    def __init__(
        self, place: Workplace, samples: SampleSet, settings: PaperLoop, seed: int
    ) -> None:
        """Takes a data set.

        Args:
            place: this process among those that train.
            samples: the data set.
            settings: of the loop.
            seed: of the order of the data and of the noise.
        """
        self.place = place
        self.samples = samples
        self.settings = settings
        self.seed = seed
        self.rows = place.share(settings.batch_size)

    def batch(self, step: int) -> SampleBatch:
        """The share of batch number `step`."""
        settings = self.settings
        return self.samples.batch(
            step, settings.batch_size, self.seed, settings.one_layout, self.rows
        )

    def noise(self, step: int) -> tuple[Tensor, Tensor]:
        """The share of the noise of `guidance` in a step: uniform (B, n, 1) and normal (B, n, 1,
        3)."""
        device = self.place.device
        shape = (self.settings.batch_size, N_FINS, 1)
        generator = seeded_generator(NOISE_SEED + self.seed, step, device)
        uniform = torch.rand(shape, generator=generator, device=device)
        normal = torch.randn((*shape, 3), generator=generator, device=device)
        return uniform[self.rows], normal[self.rows]

    def tensors(self, *values: Any) -> list[Tensor]:
        """Arrays on the device."""
        return [
            torch.tensor(value, dtype=torch.float32, device=self.place.device) for value in values
        ]


def train_surrogate(options: TrainingOptions) -> TrainedWeights:
    """Train a preset's surrogate and write a checkpoint folder without an allocator network. Raises
    DataError: an unknown preset, data or a state that do not fit, or a file that cannot be written;
    CommandError: there is no such device."""
    made = recipe(options.preset)

    def checkpoint(samples: SampleSet, state: ArraysByName) -> TrainedWeights:
        trained = TrainedWeights(
            name="",
            normalization=samples.normalization,
            surrogate_sizes={"kind": "mlp", "hidden": list(made.surrogate.hidden)},
            surrogate=state,
            fin_model=samples.settings["fin_model"],
        )
        batch = fresh_batch(
            replace(HELD_OUT, fin_model=FinModelSpec.from_values(trained.fin_model))
        )
        std = torch.tensor(trained.normalization.std, dtype=torch.float32)
        error = float(modules.physics(surrogate_of(trained), batch, std).sqrt().mean())
        scored = {
            "wrench_error_norm": error,
            "held_out_layouts": HELD_OUT.layouts,
            "held_out_commands": HELD_OUT.commands,
            "held_out_seed": HELD_OUT.seed,
        }
        return replace(trained, metrics={"surrogate": scored})

    begin = partial(modules.surrogate_weights, made.surrogate)
    terms_of = partial(surrogate_terms, made.surrogate)
    return _train("surrogate", options, made.surrogate_training, begin, terms_of, checkpoint)


def surrogate_terms(config: SurrogateConfig, weights: Weights, source: BatchSource) -> Terms:
    """Returns the loss of a step of the surrogate's training (Eq. 5).

    Args:
        config: sizes of the surrogate.
        weights: its weights.
        source: of the batches.
    """
    (std,) = source.tensors(source.samples.normalization.std)
    wrench = partial(modules.surrogate_wrench, config, weights)

    def terms(step: int) -> dict[str, Tensor]:
        batch = source.batch(step)
        with source.place.autocast(max(config.hidden), source.settings.is_float32(step)):
            return {"loss": modules.physics(wrench, batch, std).mean()}

    return terms


def train_allocator(options: TrainingOptions, surrogate: Path) -> TrainedWeights:
    """Train a preset's network, guided by the surrogate of a checkpoint, and write a whole
    checkpoint folder.

    Without other data that in the surrogate's folder is learned from, if there is any. Raises
    CheckpointError: the checkpoint holds no surrogate. DataError, CommandError: as in
    `train_surrogate`."""
    made = recipe(options.preset)
    base = read_checkpoint(resolve_checkpoint(surrogate))
    settings = made.allocator_training
    network = made.network
    surrogate_of(base)  # reports what is missing before data are made
    if options.data is None and (surrogate / "data").is_dir():
        options = replace(options, data=surrogate / "data")

    def terms_of(weights: Weights, source: BatchSource) -> Terms:
        if source.samples.settings["fin_model"] != base.fin_model:
            raise DataError(
                f"{options.data}: its wrenches are of another fin model than the surrogate's"
            )
        return allocator_terms(made, base, weights, source)

    def checkpoint(samples: SampleSet, state: ArraysByName) -> TrainedWeights:
        return replace(base, network_sizes=sizes_for_file(network), network=state)

    begin = partial(first_weights, network.shapes())
    return _train("allocator", options, settings, begin, terms_of, checkpoint, base.sha256)


def allocator_terms(
    made: PaperRecipe, base: TrainedWeights, weights: Weights, source: BatchSource
) -> Terms:
    """Returns the loss of a step of the network's training and its terms (Eq. 7).

    Args:
        made: the recipe.
        base: checkpoint of the surrogate that guides.
        weights: of the network.
        source: of the batches.
    """
    mean, std = source.tensors(*base.normalization)
    frozen = surrogate_of(base, device=source.place.device)
    ramp = replace(made.allocator_training, steps=source.settings.steps)
    network = made.network
    network_width = max(network.width, network.feedforward)
    surrogate_width = max(SurrogateConfig.of(base).hidden)

    def terms(step: int) -> dict[str, Tensor]:
        batch = source.batch(step)
        target = (batch.wrench - mean) / std
        in_float32 = source.settings.is_float32(step)
        with source.place.autocast(network_width, in_float32):
            hidden = network.encoded(weights, batch.features, target, batch.mask)
        mixture = network.mixture(weights, hidden.float())
        with source.place.autocast(surrogate_width, in_float32):
            guide = modules.guidance(mixture, frozen, batch, std, source.noise(step)).mean()
        imitate = modules.imitation(mixture, batch).mean()
        entropy = modules.negative_entropy(mixture, batch.mask).mean()
        loss = imitate + ramp.beta(step) * guide + ramp.entropy * entropy  # Eq. 7
        return {"loss": loss, "imitation": imitate, "guidance": guide, "entropy": entropy}

    return terms


def _train(
    verb: str,
    options: TrainingOptions,
    settings: PaperLoop,
    begin: Callable[[int, torch.device], Weights],
    terms_of: Callable[[Weights, BatchSource], Terms],
    checkpoint: Callable[[SampleSet, ArraysByName], TrainedWeights],
    surrogate: str = "",
) -> TrainedWeights:
    """Train the weights that `begin` gives, and write the checkpoints that are made of them."""
    settings = replace(settings, steps=options.steps or settings.steps)
    output = options.output
    with workplace(options.device, settings.batch_size) as place:
        if options.data is None and place.rank == 0:
            generate(output / "data", recipe(options.preset).data)
        place.wait()
        samples = SampleSet(options.data or output / "data", place.device)
        made_by = recipe(options.preset)
        if made_by.normalization is not None:
            samples.normalization = read_normalization(resolve_checkpoint(made_by.normalization))
        weights = begin(options.seed, place.device)
        identity = {"preset": options.preset, "seed": options.seed, "training": asdict(settings)}
        identity |= {"data": samples.settings, "surrogate_sha256": surrogate}
        identity |= {"data_sha256": samples.sha256, "recipe_sha256": recipe_hash(made_by, verb)}

        def save(state: ArraysByName, progress: dict[str, Any]) -> None:
            made = checkpoint(samples, state)
            history = {**made.training, verb: identity | progress}
            made = replace(made, name=output.name, preset=options.preset, training=history)
            write_card(output, write_checkpoint(output, made))

        training = Training(weights, settings, output, identity, place)
        if options.resume:
            training.resume()
        source = BatchSource(place, samples, settings, options.seed)
        training.run(terms_of(weights, source), save)
        return read_checkpoint(output)


def surrogate_of(weights: TrainedWeights, **of_tensors: Any) -> modules.WrenchOf:
    """The surrogate of a checkpoint, frozen, with options of `torch.tensor` for its weights. Raises
    CheckpointError: it holds none."""
    config = SurrogateConfig.of(weights)
    tensors = {name: torch.tensor(value, **of_tensors) for name, value in weights.surrogate.items()}
    return partial(modules.surrogate_wrench, config, tensors)
