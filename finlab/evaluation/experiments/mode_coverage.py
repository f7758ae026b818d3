"""How many of a robot's ways to deliver a wrench an allocator knows, against many random starts.

The ground truth knows neither network nor search in force space: from random commands, a solver looks for the
least cost that delivers the wrench by the fins' own models. Where it converges is a local minimum; these are
clustered into modes. Among those of reasonable cost, a mode counts as covered if the allocator's modes hold
one that does the same.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.allocation.modes import ModeSignature, cluster, force_sizes, mode_signature, same_signature
from finlab.arrays import Array
from finlab.evaluation.cheapest_commands import CheapestCommands
from finlab.evaluation.progress import progress
from finlab.evaluation.splits import Case
from finlab.evaluation.statistics.tables import Row
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.physics.objective import Objective

CHEAP = 1.25
"""Modes that need up to so much of the least cost known are counted."""


def mode_rows(
    allocator: Allocator, cases: Sequence[Case], *, n_starts: int = 256, seed: int = 0
) -> list[Row]:
    """One row per fin count.

    Args:
        allocator: a method whose answers tell modes; they are compared by its own objective.
        cases: layouts with targets.
        n_starts: random starts of the ground truth, per target.
        seed: of the starts.
    """
    truth = CheapestCommands(_objective(allocator), allocator.normalization.std)
    found: dict[int, list[Row]] = {}
    for case in progress(cases, "layout"):
        layout = case.healthy
        for target in case.targets:
            compared = _compare(allocator, truth, layout, target, n_starts, seed)
            if compared is not None:
                found.setdefault(layout.n_fins, []).append(compared)
    return [
        {"fins": fins, "n": len(parts)} | {key: float(np.mean([p[key] for p in parts])) for key in parts[0]}
        for fins, parts in sorted(found.items())
    ]


def _objective(allocator: Allocator) -> Objective:
    """What a method keeps least; effort where it cannot choose."""
    return Objective(allocator.options.get("objective", "effort"))


def _compare(
    allocator: Allocator, ways: CheapestCommands, layout: Layout, target: Array, n_starts: int, seed: int
) -> Row | None:
    """Counts and coverage for one target; None where no start delivers it."""
    plant = plant_of(layout)
    ends, _ = ways.ends(layout, target, n_starts, seed)
    truth = ends[[group[0] for group in cluster(_signatures(layout, ends))]]
    mine = np.array([mode.command for mode in allocator.explore(allocator.allocate(layout, target))])
    if not len(truth) or not len(mine):
        return None
    meter = ways.objective.meter(plant)
    both = [(command, np.asarray(meter(command))) for command in (truth, mine)]
    (_, truth_cost), (_, cost) = both
    least = min(truth_cost.min(), cost.min())
    cheap = [command[spent <= CHEAP * least] for command, spent in both]
    forces = (plant.fin_forces(command).reshape(-1, 3 * layout.n_fins) for command in cheap)
    truth_ways, own_ways = (_signatures(layout, command) for command in cheap)
    return {
        "truth": len(truth_ways),
        "modes": len(own_ways),
        "coverage": _covered(truth_ways, own_ways),
        "truth_coverage": _covered(own_ways, truth_ways),
        "best_cost": float(cost.min() / truth_cost.min()),
        "distance": _energy_distance(*forces),
    }


def _signatures(layout: Layout, command: Array) -> list[ModeSignature]:
    """What matters of each of some commands (K, n, 3)."""
    return [mode_signature(*each) for each in zip(command, force_sizes(layout, command), strict=True)]


def _covered(wanted: list[Any], known: list[Any]) -> float:
    """Share of some ways that are among others; one where nothing is wanted."""
    if not wanted:
        return 1.0
    return float(np.mean([any(same_signature(way, other) for other in known) for way in wanted]))


def _energy_distance(one: Array, other: Array) -> float:
    """Székely's energy distance between two sets of points over twice their mean size; 0 if one is empty."""
    if not len(one) or not len(other):
        return 0.0

    def mean(a: Array, b: Array) -> float:
        return float(np.linalg.norm(a[:, None] - b[None], axis=-1).mean())

    apart = 2.0 * mean(one, other) - mean(one, one) - mean(other, other)
    size = 2.0 * np.linalg.norm(np.concatenate([one, other]), axis=-1).mean()
    return float(max(apart, 0.0) / max(size, 1e-12))
