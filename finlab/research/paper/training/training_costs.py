"""Costs of a step of each of the paper's two trainings."""

from functools import partial
from pathlib import Path

import torch

from finlab.research.networks.checkpoint import read_checkpoint, resolve_checkpoint
from finlab.research.paper.training import modules
from finlab.research.paper.training.recipes import PaperLoop, recipe
from finlab.research.paper.training.samples import DataSettings, SampleSet, generate
from finlab.research.paper.training.train import BatchSource, allocator_terms, surrogate_terms
from finlab.research.training.device import Workplace
from finlab.research.training.loop import Terms, Training, Weights, first_weights
from finlab.research.training.step_cost import StepCost, step_cost

DATA = DataSettings(layouts=200, commands=200)
"""What is learned from while the time is taken."""


def training_costs(preset: str, folder: Path, steps: int = 60) -> dict[str, StepCost]:
    """Measures the trainings of a preset, "surrogate" and "allocator", on one thread.

    Args:
        preset: one of `RECIPES`.
        folder: for data and state; an empty one, or that of an earlier call.
        steps: how many are timed of each.
    """
    made = recipe(preset)
    place = Workplace(torch.device("cpu"))
    generate(folder / "data", DATA)
    samples = SampleSet(folder / "data", place.device)

    def cost(settings: PaperLoop, weights: Weights, terms: Terms) -> StepCost:
        run = Training(weights, settings, folder, {}, place)
        step = partial(run.step, terms, rate=settings.learning_rate)
        return step_cost(step, settings.batch_size, steps)

    settings = made.surrogate_training
    weights = modules.surrogate_weights(made.surrogate, 0, place.device)
    source = BatchSource(place, samples, settings, 0)
    surrogate = cost(settings, weights, surrogate_terms(made.surrogate, weights, source))

    base = read_checkpoint(resolve_checkpoint("paper"))
    settings = made.allocator_training
    weights = first_weights(made.network.shapes(), 0, place.device)
    source = BatchSource(place, samples, settings, 0)
    allocator = cost(settings, weights, allocator_terms(made, base, weights, source))
    return {"surrogate": surrogate, "allocator": allocator}
