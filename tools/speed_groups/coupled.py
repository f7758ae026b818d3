"""Robots whose actuators act on each other, by the formula of jets and by a network, beside the
same robots without."""

from collections.abc import Iterator
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from finlab import Allocator
from finlab.interaction.interaction import InteractionModel
from finlab.interaction.jets import Jets
from finlab.interaction.learned import Learned
from finlab.research.evaluation.document import Row
from tools.speed_groups.questions import allocator_of, as_questions, rim_targets, unit_side
from tools.speed_groups.timing import (
    Goal,
    Side,
    Sizes,
    figure_row,
    least_times,
    left_out_row,
    ratio_row,
)

ROBOT = "bluerov2_heavy"
"""The robot."""
SHARE = 0.5
"""Of its reach."""
QUESTIONS = 40
"""Most targets of robots with jets, whose answers take long."""
QUESTIONS_OF_NETWORK = 10
"""Most targets of robots with a learned interaction, whose answers take longer."""
REPEATS_OF_NETWORK = 2
"""Most times that each of them is asked."""
SHARE_OF_BATCH = 0.1
"""Of the targets of a batch without interaction, so many are in one with it."""
MOST_WITH_JETS = Goal(5)
"""Of an answer with jets, over one without."""
MOST_OF_BATCH = Goal(2)
"""Of a target in a batch with jets, over one without."""
MOST_WITH_NETWORK = Goal(1350)
"""Of an answer with a learned interaction, over the unit: 5 ms where the unit takes 3.7 us."""
SAMPLES = {"layouts": 20, "commands": 20, "seed": 0, "noise": 0.02, "count": (4, 8)}
"""What the network learns from: robots, commands of each, the seed, noise, numbers of actuators."""
STEPS = 60
"""Steps of its training: what it has learned counts for little, how large it is for all."""
SAMPLES_OF_STEP = 128
"""Samples of a step of its training."""


def coupled_rows(sizes: Sizes) -> Iterator[Row]:
    """Returns the rows of interaction."""
    measured = f"`allocate` at {SHARE:g} of reach with a learned interaction"
    yield from _rows_of_jets(sizes)
    if find_spec("torch") is None:
        yield left_out_row(measured, ROBOT, "without", "torch")
        return
    with TemporaryDirectory() as folder:
        network = trained_network(Path(folder))
        yield from _rows_of_network(measured, network, sizes)


def _rows_of_jets(sizes: Sizes) -> Iterator[Row]:
    """Rows of the formula: single answers and a batch."""
    without = allocator_of(ROBOT)
    with_jets = _with(Jets())
    questions = as_questions(rim_targets(without, SHARE, min(sizes.questions, QUESTIONS)))
    times = least_times(
        {"without": Side(without.allocate, questions), "jets": Side(with_jets.allocate, questions)},
        sizes.repeats,
    )
    measured = f"`allocate` at {SHARE:g} of reach with jets"
    yield ratio_row(measured, ROBOT, "without", times["jets"], times["without"], MOST_WITH_JETS)

    count = max(1, round(SHARE_OF_BATCH * sizes.batch))
    targets = rim_targets(without, SHARE, count)
    times = least_times(
        {
            "without": Side(without.allocate_batch, [(targets,)]),
            "jets": Side(with_jets.allocate_batch, [(targets,)]),
        },
        sizes.repeats,
    )
    ratio = float(times["jets"][0] / times["without"][0])
    measured = f"a target in a batch of {count:,} with jets"
    yield figure_row(measured, ROBOT, "without", ratio, MOST_OF_BATCH)


def _rows_of_network(measured: str, network: Learned, sizes: Sizes) -> Iterator[Row]:
    """Rows of a learned interaction."""
    without = allocator_of(ROBOT)
    with_network = _with(network)
    count = min(sizes.questions, QUESTIONS_OF_NETWORK)
    questions = as_questions(rim_targets(without, SHARE, count))
    times = least_times(
        {
            "unit": unit_side(len(questions)),
            "without": Side(without.allocate, questions),
            "network": Side(with_network.allocate, questions),
        },
        min(sizes.repeats, REPEATS_OF_NETWORK),
    )
    yield ratio_row(measured, ROBOT, "without", times["network"], times["without"])
    yield ratio_row(measured, ROBOT, "the unit", times["network"], times["unit"], MOST_WITH_NETWORK)


def _with(interaction: InteractionModel) -> Allocator:
    """The robot, whose actuators act on each other."""
    layout = allocator_of(ROBOT).layout
    return Allocator(replace(layout, interaction=interaction))


def trained_network(folder: Path) -> Learned:
    """Returns networks of the usual size after a short training on samples of the formula of jets.

    Args:
        folder: for their file, which has to stay as long as they are used.
    """
    from finlab.research.interaction.random_samples import random_samples, with_jets
    from finlab.research.interaction.train import WEIGHTS_FILE, recipe, train

    train(random_samples(with_jets, **SAMPLES), folder, recipe(STEPS, SAMPLES_OF_STEP))
    return Learned(str(folder / WEIGHTS_FILE))
