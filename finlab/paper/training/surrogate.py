"""`finlab train surrogate`: the physics surrogate, trained first and on its own (paper, pretraining)."""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from finlab.layout import FinModelSpec
from finlab.networks.checkpoint import read_checkpoint, write_checkpoint
from finlab.networks.trained import State, TrainedWeights
from finlab.paper.surrogate import SurrogateConfig
from finlab.paper.training.card import write_card
from finlab.paper.training.data import Batch, DataSet, DataSettings, fresh_batch, generate
from finlab.paper.training.modules import Surrogate
from finlab.paper.training.recipes import recipe
from finlab.training.device import Workplace, workplace
from finlab.training.loop import Training
from finlab.whole_file import make_folder

JUDGES = DataSettings(layouts=500, commands=20, seed=7_000)
"""Samples that no training sees, from which the error of a surrogate is measured."""


def train_surrogate(
    preset: str,
    out: Path,
    *,
    data: Path | None = None,
    seed: int = 0,
    resume: bool = False,
    device: str | None = None,
    steps: int | None = None,
) -> TrainedWeights:
    """Train a preset's surrogate and write a checkpoint folder without an allocator network.

    Args:
        preset: one of `RECIPES`.
        out: folder for checkpoint, model card, log, curves and state, made if need be.
        data: folder of a data set; the recipe's, made in `out/data`, by default.
        seed: of the first weights and of the order of the data.
        resume: go on from the state in `out`.
        device: see `workplace`.
        steps: in place of the recipe's.

    Raises:
        DataError: an unknown preset, data or a state that do not fit, or a file that cannot be written.
        CommandError: there is no such device.
    """
    made = recipe(preset)
    settings = replace(made.surrogate_training, steps=steps or made.surrogate_training.steps)
    with workplace(device, settings.batch_size) as place:
        samples = data_set(data or out / "data", made.data, place, given=data is not None)
        torch.manual_seed(seed)
        module = Surrogate(made.surrogate).to(place.device)
        network, rows = place.shared(module), place.share(settings.batch_size)
        std = torch.tensor(samples.normalization.std, dtype=torch.float32, device=place.device)

        def terms(step: int) -> dict[str, Tensor]:
            batch = samples.batch(step, settings.batch_size, seed, settings.one_layout, rows)
            with place.autocast():
                wrench = network(batch.command, batch)
            # Eq. 5; the mean mu cancels in the difference.
            return {"loss": ((wrench - batch.wrench) / std).square().sum(-1).mean()}

        identity = {
            "preset": preset,
            "seed": seed,
            "training": asdict(settings),
            "data": samples.settings,
        }

        def save(state: State, progress: dict[str, Any]) -> None:
            trained = TrainedWeights(
                name=out.name,
                normalization=samples.normalization,
                surrogate_sizes={"kind": "mlp", "hidden": list(made.surrogate.hidden)},
                surrogate=state,
                fin_model=samples.settings["fin_model"],
                preset=preset,
                training={"surrogate": identity | progress},
            )
            done = progress["steps_done"] == settings.steps
            error = {"surrogate": surrogate_error(trained)} if done else {}
            write_card(out, write_checkpoint(out, replace(trained, metrics=error)))

        training = Training(dict(module.named_parameters()), settings, out, identity, place)
        if resume:
            training.resume()
        training.run(terms, save)
        return read_checkpoint(out)


def data_set(folder: Path, settings: DataSettings, place: Workplace, given: bool) -> DataSet:
    """The data set in a folder; unless it was given by the user, it is made as the settings say."""
    if not given:
        if place.rank == 0:
            generate(make_folder(folder), settings)
        place.wait()
    return DataSet(folder, place.device)


def surrogate_of(weights: TrainedWeights, device: torch.device) -> Surrogate:
    """The surrogate of a checkpoint, frozen; a `CheckpointError` where it holds none."""
    module = Surrogate(SurrogateConfig.of(weights))
    module.load_state_dict({name: torch.tensor(value) for name, value in weights.surrogate.items()})
    return module.requires_grad_(False).to(device)


def surrogate_error(weights: TrainedWeights) -> dict[str, float]:
    """Mean normalized error of a surrogate's wrench by its fin model, on fresh samples."""
    settings = replace(JUDGES, fin_model=FinModelSpec.from_values(weights.fin_model))
    batch: Batch = fresh_batch(settings)
    with torch.no_grad():
        missing = surrogate_of(weights, torch.device("cpu"))(batch.command, batch) - batch.wrench
    error = (missing / torch.tensor(weights.normalization.std)).norm(dim=-1)
    return {"wrench_error_norm": float(error.mean())}
