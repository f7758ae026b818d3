"""How long a robot waits for its first answer when its fins were not seen before.

A fin is compiled once, whatever its law, and kept by content. So the first call of a robot with new fins pays
for compiling them; the first call of another robot with the same fins does not.
"""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.evaluation.noisy_tables import noisy_table
from finlab.evaluation.progress import progress
from finlab.evaluation.statistics.tables import Row
from finlab.layout import Fin, Layout, load_layout, random_layout
from finlab.layout.random_fins import FAMILIES, random_fin_model

DOMAIN = 0xF1257
"""Leads the seed of every robot."""
KINDS = (*FAMILIES, "table")
"""Fin models that are timed; a table is one of a random fin, with 3 % noise."""
N_FINS = 4
"""Of each robot."""
SMALL = np.array([0.02, 0.02, 0.02, 0.002, 0.002, 0.002])
"""Size of the targets [N, N m], within reach of the weakest fins."""


def first_answer_rows(allocator: Allocator, *, robots: int, seed: int) -> list[Row]:
    """One row for each of `KINDS`, with one new model for all fins of a robot and with one for each.

    Args:
        allocator: the method.
        robots: of each row; `first_ms` and `again_ms` are the slowest of them.
        seed: of robots, fins and targets.
    """
    allocator.allocate(load_layout("A"), np.zeros(6))  # what a process does once is not the fins' doing
    rows = []
    for kind, models in progress([(kind, models) for kind in KINDS for models in (1, N_FINS)], "row"):
        times = []
        for k in range(robots):
            rng = np.random.default_rng([DOMAIN, seed, KINDS.index(kind), models, k])
            fins = [_new_fin(rng, kind, f"{seed}-{models}-{k}-{i}") for i in range(models)]
            times.append([_call_ms(allocator, _robot(rng, fins), rng) for _ in ("first", "again")])
        first, again = np.array(times).T
        row = {"fins": kind, "new_models": models, "robots": robots}
        rows.append({**row, "first_ms": float(first.max()), "again_ms": float(again.max())})
    return rows


def _new_fin(rng: np.random.Generator, kind: str, name: str) -> Fin:
    """A fin of a random model of a kind."""
    fin = Fin("new", (0.0, 0.0, 0.0), 0.0, model=random_fin_model(rng, None if kind == "table" else kind))
    return noisy_table(rng, fin, f"first-answer-{name}") if kind == "table" else fin


def _robot(rng: np.random.Generator, fins: Sequence[Fin]) -> Layout:
    """A random robot with fins of these models, one after the other."""
    layout = random_layout(rng, n_fins=N_FINS)
    models = (fins[i % len(fins)].model for i in range(N_FINS))
    return replace(
        layout, fins=tuple(replace(fin, model=m) for fin, m in zip(layout.fins, models, strict=True))
    )


def _call_ms(allocator: Allocator, layout: Layout, rng: np.random.Generator) -> float:
    """The processor's time [ms] for the first call of a robot, whose tables have not been read before."""
    target = SMALL * rng.standard_normal(6)
    start = time.process_time()
    allocator.allocate(layout, target)
    return 1e3 * (time.process_time() - start)
