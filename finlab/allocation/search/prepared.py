"""What the search needs to know of a layout, computed once and kept."""

from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.levenberg_marquardt import CommandProblem
from finlab.arrays import Array
from finlab.forces.convex_parts import arcs_to_search
from finlab.forces.envelopes import layout_envelopes
from finlab.forces.force_space import PlanarProblem, planar_problem
from finlab.layout import Layout
from finlab.physics.known_plants import plant_of
from finlab.physics.objective import CostMeter, Objective
from finlab.physics.plant import Plant


@dataclass(frozen=True)
class SeedNumbers:
    """Where searches for the least effort begin, which has many local minima."""

    most_subsets: int = 80
    """Most sub-layouts that are searched."""
    many: int = 6
    """Fins from which on effort has more local minima than sub-layouts are searched."""
    least_working: int = 2
    """Fewest fins that work in a sub-layout; of two fins, one."""
    resting: float = 1e-3
    """Share of its largest force at which a fin begins that is to rest."""
    waking: tuple[float, float] = (0.1, 0.5)
    """Least share of its largest force at which a fin begins that worked, and that of one that rested."""
    least_share: float = 0.05
    """Least share of its largest force with which a fin begins where all work, some much harder."""


SEEDS = SeedNumbers()
"""What every layout is prepared by."""


class Prepared(NamedTuple):
    """One layout of n healthy fins, ready for search and refinement."""

    plant: Plant
    """The fins' own laws."""
    planar: PlanarProblem
    """The layout for the search in force space."""
    commands: CommandProblem
    """The layout for the refinement of commands."""
    seeds: Array
    """Sizes of forces (S, n) [N] to start from: all fins, then for effort sub-layouts whose other fins nearly
    rest, and fins that work unevenly."""
    cost: CostMeter
    """By which answers are compared."""
    arcs: tuple[Array, Array] | None
    """Middles and halves (P, n) [rad] of arcs of force directions in which the search is repeated; None where
    those of the fins will do."""
    unsettled: bool
    """Whether cheaper commands may lie near those of the search: it sees the power of a force table smoothed,
    and with many fins for effort some are at their largest force while others rest."""
    exactness: float
    """What thresholds on the normalized error are multiplied by: less than one for a robot that is weak
    beside the error's yardstick."""

    def at(self, flow: Array | None, std: Array) -> "Prepared":
        """The same layout at a flow (6,); `std` (6,) normalizes wrenches."""
        plant = self.plant.at(flow)
        if plant is self.plant:
            return self
        return self._replace(plant=plant, commands=CommandProblem.of(plant, std))


def prepare(layout: Layout, std: Array, objective: Objective) -> Prepared:
    """Prepare a layout whose fins are all healthy; `std` (6,) normalizes wrenches.

    Raises:
        DataError: a fin's force table cannot be read.
    """
    plant = plant_of(layout)
    fins = layout_envelopes(layout, objective)
    planar = planar_problem(layout, fins, std, objective)
    seeds = fins.maximum[None]
    if not objective.convex:
        rests = resting_seeds(fins.maximum, resting_fins(layout.n_fins))
        seeds = np.concatenate([rests, uneven_seeds(fins.maximum)])
    tables = any(fin.model.type == "table" for fin in layout.fins)
    unsettled = tables if objective.convex else layout.n_fins >= SEEDS.many
    strongest = np.tile(fins.maximum, 2)[:, None] * planar.effectiveness
    return Prepared(
        plant,
        planar,
        CommandProblem.of(plant, std),
        seeds,
        objective.meter(plant),
        arcs_to_search(fins, len(seeds)),
        unsettled,
        min(1.0, float(np.linalg.norm(strongest))),
    )


def resting_fins(n: int) -> tuple[tuple[int, ...], ...]:
    """Which of n fins are tried at rest: none, each, and each pair; then all but each pair.

    Where a cost is concave in a fin's force, the cheapest allocation often rests some fins, which a search
    from the whole layout may miss.
    """
    fins = range(n)
    most = min(2, max(n - SEEDS.least_working, n - 1 if n == 2 else 0))
    resting = [c for k in range(most + 1) for c in combinations(fins, k)]
    if n - SEEDS.least_working > most:
        working = combinations(fins, SEEDS.least_working)
        resting += [tuple(i for i in fins if i not in pair) for pair in working]
    return tuple(resting[: SEEDS.most_subsets])


def resting_seeds(maximum: Array, rests: tuple[tuple[int, ...], ...], left: float = SEEDS.resting) -> Array:
    """Seeds (S, n) [N] from largest forces (n,) in which some fins nearly rest, at the share that is left."""
    seeds = np.tile(maximum, (len(rests), 1))
    for row, fins in enumerate(rests):
        seeds[row, list(fins)] *= left
    return seeds


def uneven_seeds(maximum: Array) -> Array:
    """Seeds (n, n) [N] from largest forces (n,), spread by irrational steps: a few fins work hard.

    Equal fins that all work alike are a saddle of the effort, which a search leaves slowly.
    """
    fin = np.arange(len(maximum))
    row = fin[:, None] + 1
    spread = (row * 0.6180339887 + fin * 0.7548776662) % 1.0
    return maximum * (SEEDS.least_share + (1.0 - SEEDS.least_share) * spread**2)


def neighbour_seeds(size: Array, works: NDArray[np.bool_], maximum: Array) -> Array:
    """Seeds (R, n (n + 1) / 2, n) [N] near allocations of many fins, of which some rest.

    In each, one fin or two work that did not, or rest that did not, or take each other's part: of six fins
    and more the cheapest ways rest more of them than are tried from the start.

    Args:
        size: sizes of the forces (R, n) [N].
        works: which fins work (R, n).
        maximum: largest forces (n,) [N].
    """
    first, second = np.triu_indices(size.shape[1])
    one = np.eye(size.shape[1], dtype=bool)
    wanted = works[:, None] ^ (one[first] | one[second])
    start = maximum * np.where(works, np.maximum(size / maximum, SEEDS.waking[0]), SEEDS.waking[1])
    return np.where(wanted, start[:, None], SEEDS.resting * maximum)
