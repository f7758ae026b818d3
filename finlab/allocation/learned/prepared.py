"""What the learned allocator needs to know of a layout, computed once and kept."""

from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned.levenberg_marquardt import CommandProblem
from finlab.forces.force_space import PlanarProblem, planar_problem
from finlab.forces.thrust_curve import thrust_curves
from finlab.inference.features import Geometry, geometry
from finlab.inference.learned_fin import LearnedFin
from finlab.layout import Layout
from finlab.layout.angles import is_full_turn
from finlab.layout.arrays import force_columns
from finlab.physics.energy import DEFAULT_WEIGHTS, EnergyMeter, EnergyWeights

Array = NDArray[Any]

MAX_SUBSETS = 40
"""Most sub-layouts that are searched beside the network's proposals."""


class Prepared(NamedTuple):
    """One layout of n healthy fins, ready for prediction, search and refinement."""

    lower: Array
    """Lower limits (n, 3)."""
    upper: Array
    """Upper limits (n, 3)."""
    geometry: Geometry
    """The part of the network's features that does not depend on the target."""
    planar: PlanarProblem
    """The layout for the search in force space."""
    commands: CommandProblem
    """The layout for the refinement of commands."""
    subsets: Array
    """Thrust seeds (S, n) [N] of sub-layouts: the fins outside are nearly at rest."""
    energy: EnergyMeter
    """By which answers are compared."""
    usual_energy: EnergyMeter
    """By which the network's candidates are ranked: the one that it has learned to keep low."""


def prepare(
    layout: Layout, fin: LearnedFin, std: Array, weights: EnergyWeights = DEFAULT_WEIGHTS
) -> Prepared:
    """Prepare a layout whose fins are all healthy; `std` (6,) normalizes wrenches."""
    position, angle, lower, upper = layout.position, layout.mounting_angle, layout.lower, layout.upper
    columns: Array = force_columns(position, angle) / std
    curves = thrust_curves(fin, lower, upper, weights)
    wraps: NDArray[np.bool_] = is_full_turn(upper[:, 2] - lower[:, 2])
    return Prepared(
        lower,
        upper,
        geometry(position[None], angle[None], lower[None], upper[None], std),
        planar_problem(layout, curves, std, weights),
        CommandProblem(fin, columns, lower, upper, wraps),
        _subset_seeds(curves.maximum),
        EnergyMeter(upper, weights),
        EnergyMeter(upper),
    )


def _subset_seeds(maximum: Array) -> Array:
    """Seeds that let no, one or two fins rest while at least three work.

    The energy is concave in a fin's force, so the cheapest allocation often rests some fins, which a
    local search from the whole layout may miss. Two fins alone rarely span a wrench.
    """
    n = len(maximum)
    resting = [c for k in range(min(2, max(n - 3, 0)) + 1) for c in combinations(range(n), k)][:MAX_SUBSETS]
    seeds = np.tile(maximum, (len(resting), 1))
    for row, fins in enumerate(resting):
        seeds[row, list(fins)] *= 1e-3
    return seeds
