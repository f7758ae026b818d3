#!/usr/bin/env python3
"""Measures how quick finlab is, beside one line of numpy, its own core in C, and solvers of others.

    python tools/speed.py --groups call,peers --json rows.json

All sides of a row are measured in one run, in turns. Groups are call, peers, batches, coupled and
around; the solvers of peers are an extra of finlab. `make figures PAGE=speed` makes the table of
docs/measured/speed.md.
"""

import os
import sys
from collections.abc import Callable, Iterator
from datetime import datetime, timezone
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
# Set before numpy is imported: the processor time of a thread is that of a call with one thread.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import tyro

from finlab.cli.eval_verbs import verb_of
from finlab.research.evaluation.document import Column, Row
from finlab.research.evaluation.experiment import Experiment, begin, check_names
from finlab.research.evaluation.origin import commit_words, machine_words, version_words
from tools.speed_groups.around import around_rows
from tools.speed_groups.batches import batch_rows
from tools.speed_groups.calls import call_rows
from tools.speed_groups.coupled import coupled_rows
from tools.speed_groups.peers import PEERS, peer_rows
from tools.speed_groups.timing import Sizes

GROUPS: dict[str, Callable[[Sizes], Iterator[Row]]] = {
    "call": call_rows,
    "peers": peer_rows,
    "batches": batch_rows,
    "coupled": coupled_rows,
    "around": around_rows,
}
"""Groups of rows by name, in the order of the table."""


def run(
    groups: tuple[str, ...] = ("all",),
    questions: int = Sizes().questions,
    repeats: int = Sizes().repeats,
    batch: int = Sizes().batch,
    swim: float = Sizes().swim_s,
    steps: int = Sizes().steps,
    drags: int = Sizes().drags,
) -> Iterator[Row]:
    """Gives a row for each figure. Raises DataError: an unknown group.

    Args:
        groups: call, peers, batches, coupled, around, or all.
        questions: targets of each robot, and ticks of a walk.
        repeats: times that each question is asked; the least time counts.
        batch: targets of a batch.
        swim: duration of a swim in seconds.
        steps: of a training.
        drags: of the slider in the app.
    """
    check_names("groups", groups, ("all", *GROUPS))
    sizes = Sizes(questions, repeats, batch, swim, steps, drags)
    for name, rows_of in GROUPS.items():
        if name not in groups and "all" not in groups:
            continue
        begin(f"speed, {name}")
        for row in rows_of(sizes):
            yield {"group": name} | row


def origin() -> str:
    """Returns where and when the figures were measured."""
    packages = dict.fromkeys(["numpy", "scipy", *(peer.package for peer in PEERS if peer.package)])
    day = datetime.now(timezone.utc).date().isoformat()
    versions = version_words(packages)
    return f"Measured on {day} at {commit_words()}, on {machine_words()}, with {versions}."


experiment = Experiment(
    name="speed",
    question="How quick are answers and what is around them, beside one line of numpy, the core in "
    "C and solvers of others?",
    columns=(
        Column("group", "group", "code"),
        Column("measured", "measured"),
        Column("robot", "robot"),
        Column("over", "over"),
        Column("figure", "ratio", "three"),
        Column("p99", "99th percentile", "three"),
        Column("goal", "goal"),
        Column("met", "met"),
        Column("error", "error", "error"),
        Column("missed", "missed", "share"),
        Column("watts", "watts", "ratio"),
    ),
    run=run,
    program="python tools/speed.py",
    origin=origin,
    note=(
        "Ratio: the median of what is measured, over the median of what stands under *over*. 99th "
        "percentile: that of what is measured, over the same median. Error: the largest distance "
        "of an answer of *over* from its wrench, over the robot's wrench scale; missed: the share "
        "of its answers that are off by more than a millionth; watts: of its other answers, over "
        "those of `allocate`. Processor time of one thread, the least of several repeats."
    ),
)

if __name__ == "__main__":
    tyro.cli(verb_of(experiment))
