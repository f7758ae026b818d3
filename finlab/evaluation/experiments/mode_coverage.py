"""How many of a robot's ways to deliver a wrench an allocator knows, against many random starts.

The ground truth is made without any network: from random commands, IPOPT looks for the least energy that
delivers the wrench by the analytic fin model. Where it converges is a local minimum; these are clustered into
modes. Among those of reasonable energy, a mode counts as covered if the allocator's modes hold one that does
the same.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.allocation.baselines.ipopt import SOLVER_OPTIONS, Formulas, Ipopt
from finlab.allocation.baselines.single_target import Problem
from finlab.allocation.modes import cluster, mode_signature, same_signature
from finlab.evaluation.progress import progress
from finlab.evaluation.splits import Case
from finlab.evaluation.statistics.tables import Row, text_table
from finlab.layout import Layout
from finlab.layout.arrays import Array
from finlab.physics import Plant, plant_of
from finlab.physics.energy import command_energy

EXACT = 1e-4
"""Normalized error of each axis up to which a command delivers the wrench; the plant's and the surrogate's
wrenches differ by more."""
CHEAP = 1.25
"""Modes that need up to so much of the least energy known are counted."""


class CheapestWays(Ipopt):
    """IPOPT on the energy alone, with the wrench as a constraint; ends that did not converge are NaN."""

    def ends(self, layout: Layout, target: Array, starts: Array) -> Array:
        """The commands (M, n, 3) that converged, cheapest first, of those from starts (S, n, 3)."""
        plant = plant_of(layout)
        problem = Problem(plant, target, self.normalization.std)
        found = np.array([self._minimize(problem, problem.position(start)) for start in starts])
        found = np.array([problem.command(end) for end in found if np.isfinite(end).all()])
        command = plant.feasible(found.reshape(-1, plant.n_fins, 3))
        return np.asarray(command[np.argsort(command_energy(command, plant.upper))])

    def _minimize(self, problem: Problem, start: Array) -> Array:
        end = super()._minimize(problem, start)
        converged = self._solver(problem.plant)[0].stats()["success"]
        return end if converged else np.full_like(end, np.nan)

    @staticmethod
    def _bounds(problem: Problem) -> dict[str, Array]:
        return {**Ipopt._bounds(problem), "lbg": np.full(6, -EXACT), "ubg": np.full(6, EXACT)}

    def _build(self, plant: Plant) -> tuple[Any, Formulas]:
        formulas = self._formulas(plant)
        cost = formulas.cost / self._cost(plant).weight
        program = {"x": formulas.command, "p": formulas.target, "f": cost, "g": formulas.residual}
        return self._casadi.nlpsol("ways", "ipopt", program, SOLVER_OPTIONS | formulas.options), formulas


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
    truth = CheapestWays(allocator.normalization, objective="effort")
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


def mode_report(rows: Sequence[Row], n_starts: int) -> str:
    """The rows as a table, with what its columns mean."""
    note = (
        f"Ground truth: {n_starts} random starts of IPOPT per target, energy under exact tracking by the "
        f"analytic fin model. modes: within "
        f"{CHEAP:g} of the least energy, by the allocator (modes) and by the starts (truth); coverage: share "
        "of those of the starts that the allocator has too; truth_coverage: the reverse; best_energy: the "
        "allocator's least energy over that of the starts; distance: energy distance between the two sets of "
        "forces over twice their mean size, 0 for the same set."
    )
    return f"{text_table(rows)}\n\n{note}"


def _compare(
    allocator: Allocator, ways: CheapestWays, layout: Layout, target: Array, n_starts: int, seed: int
) -> Row | None:
    """Counts and coverage for one target; None where no start delivers it."""
    plant = plant_of(layout)
    starts = plant.sample(np.random.default_rng(seed), (n_starts,))
    ends = ways.ends(layout, target, starts)
    truth = ends[[group[0] for group in cluster([mode_signature(one) for one in ends])]]
    mine = np.array([mode.command for mode in allocator.allocate(layout, target).explore()])
    if not len(truth) or not len(mine):
        return None
    both = [(command, command_energy(command, plant.upper)) for command in (truth, mine)]
    (_, truth_energy), (_, energy) = both
    least = min(truth_energy.min(), energy.min())
    cheap = [command[spent <= CHEAP * least] for command, spent in both]
    forces = (plant.fin_forces(command).reshape(-1, 3 * layout.n_fins) for command in cheap)
    truth_ways, own_ways = ([mode_signature(one) for one in command] for command in cheap)
    return {
        "truth": len(truth_ways),
        "modes": len(own_ways),
        "coverage": _covered(truth_ways, own_ways),
        "truth_coverage": _covered(own_ways, truth_ways),
        "best_energy": float(energy.min() / truth_energy.min()),
        "distance": _energy_distance(*forces),
    }


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
