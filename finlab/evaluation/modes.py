"""How many of a robot's ways to deliver a wrench an allocator knows, against many random starts.

The ground truth is made without any network: random commands descend on error and energy by the analytic
fin model; the ends that deliver the wrench are clustered into modes. Among those of reasonable energy, a mode
counts as covered if the allocator's modes hold one that does the same.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from finlab.allocation.actuation import Actuation
from finlab.allocation.actuation_descent import DescentOptions, descend
from finlab.allocation.allocator import Allocator
from finlab.allocation.energy import command_energy
from finlab.allocation.modes import cluster, same_way, way_of
from finlab.evaluation.splits import Case
from finlab.evaluation.tables import text_table
from finlab.layout import Layout
from finlab.physics import Plant

Array = NDArray[np.float64]

TRUTH = DescentOptions(n_steps=80, energy_weight=1e-4)
"""How the random starts descend: the objective that the model-based methods share."""
POLISH = DescentOptions(n_steps=20, damping=1e-6)
"""Last steps, on the error alone."""
EXACT = 1e-3
"""Normalized error up to which an end delivers the wrench."""
CHEAP = 1.25
"""Modes that need up to so much of the least energy known are counted."""

Row = dict[str, Any]


def mode_rows(
    allocator: Allocator, cases: Sequence[Case], *, n_starts: int = 256, seed: int = 0
) -> list[Row]:
    """One row per fin count.

    Args:
        allocator: a method whose answers tell modes.
        cases: layouts with targets.
        n_starts: random starts of the ground truth, per target.
        seed: of the starts.
    """
    found: dict[int, list[Row]] = {}
    for case in tqdm(cases, unit="layout", disable=None, leave=False, file=sys.stderr):
        layout = case.layout.without(case.failed) if case.failed else case.layout
        for target in case.targets:
            told = _compare(allocator, layout, target, n_starts, seed)
            if told is not None:
                found.setdefault(layout.n_fins, []).append(told)
    return [
        {"fins": fins, "n": len(parts)} | {key: float(np.mean([p[key] for p in parts])) for key in parts[0]}
        for fins, parts in sorted(found.items())
    ]


def mode_report(rows: Sequence[Row], n_starts: int) -> str:
    """The rows as a table, with what its columns mean."""
    note = (
        f"Ground truth: {n_starts} random starts per target on the analytic fin model. modes: within "
        f"{CHEAP:g} of the least energy, by the allocator (modes) and by the starts (truth); coverage: share "
        "of those of the starts that the allocator has too; truth_coverage: the reverse; best_energy: the "
        "allocator's least energy over that of the starts; distance: energy distance between the two sets of "
        "forces over twice their mean size, 0 for the same set."
    )
    return f"{text_table(rows)}\n\n{note}"


def _compare(allocator: Allocator, layout: Layout, target: Array, n_starts: int, seed: int) -> Row | None:
    """Counts and coverage for one target; None where no start delivers it."""
    sigma = allocator.normalization.std
    truth = _truth(layout, target, sigma, n_starts, seed)
    mine = np.array([mode.command for mode in allocator.allocate(layout, target).modes])
    upper = np.array([fin.limits.upper for fin in layout.fins])
    if not len(truth) or not len(mine):
        return None
    truth_energy, energy = command_energy(truth, upper), command_energy(mine, upper)
    least = min(truth_energy.min(), energy.min())
    truth_ways = [way_of(command) for command in truth[truth_energy <= CHEAP * least]]
    ways = [way_of(command) for command in mine[energy <= CHEAP * least]]
    return {
        "truth": len(truth_ways),
        "modes": len(ways),
        "coverage": _covered(truth_ways, ways),
        "truth_coverage": _covered(ways, truth_ways),
        "best_energy": float(energy.min() / truth_energy.min()),
        "distance": _energy_distance(
            *(_forces(layout, c[e <= CHEAP * least]) for c, e in ((truth, truth_energy), (mine, energy)))
        ),
    }


def _truth(layout: Layout, target: Array, sigma: Array, n_starts: int, seed: int) -> Array:
    """The best command of each mode (M, n, 3) that random starts lead to, cheapest first."""
    actuation = Actuation(layout)
    start = actuation.sample(np.random.default_rng(seed), (n_starts,))
    targets = np.tile(target, (n_starts, 1))
    ends = descend(actuation, start, targets, sigma, TRUTH)
    ends = descend(actuation, ends.command, targets, sigma, POLISH)
    good = np.linalg.norm((ends.wrench - target) / sigma, axis=1) <= EXACT
    command = ends.command[good]
    command = command[np.argsort(command_energy(command, actuation.upper))]
    first = [group[0] for group in cluster([way_of(one) for one in command])]
    kept: Array = command[first]
    return kept


def _covered(wanted: list[Any], known: list[Any]) -> float:
    """Share of some ways that are among others; one where nothing is wanted."""
    if not wanted:
        return 1.0
    return float(np.mean([any(same_way(way, other) for other in known) for way in wanted]))


def _forces(layout: Layout, command: Array) -> Array:
    """Forces of all fins (M, 3n) [N] by the plant."""
    return Plant(layout).fin_forces(command).reshape(len(command), 3 * layout.n_fins)


def _energy_distance(one: Array, other: Array) -> float:
    """Székely's energy distance between two sets of points over twice their mean size; 0 if one is empty."""
    if not len(one) or not len(other):
        return 0.0

    def mean(a: Array, b: Array) -> float:
        return float(np.linalg.norm(a[:, None] - b[None], axis=-1).mean())

    apart = 2.0 * mean(one, other) - mean(one, one) - mean(other, other)
    size = 2.0 * np.linalg.norm(np.concatenate([one, other]), axis=-1).mean()
    return float(max(apart, 0.0) / max(size, 1e-12))
