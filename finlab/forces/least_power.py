"""The least power for a wrench, from the fins' own laws; no allocator is asked.

Power grows faster than force, so there is one cheapest set of forces, and the search in force space goes
straight to it. Here every fin may rest: the tiny force that it cannot go below is left out.
"""

from collections.abc import Collection

import numpy as np
from numpy.typing import ArrayLike

from finlab.arrays import Array
from finlab.forces.envelopes import layout_envelopes
from finlab.forces.fin_envelope import COST
from finlab.forces.fin_sets import SCALE, FinSets
from finlab.forces.force_space import PlanarProblem, descend, flat_effectiveness, planar_problem
from finlab.layout import Layout
from finlab.physics.objective import Objective

STEPS = 15
"""Most quadratic problems that are solved for each wrench."""
OFF = 1e-6
"""Scaled wrench by which an answer may miss, as a share of the strongest fin's."""


def least_power(layout: Layout, wrenches: ArrayLike, *, failed: Collection[str] = ()) -> Array:
    """Returns the least power [W] for each wrench (N, 6) [N, N m]: (N,), NaN where it is out of reach.

    Raises:
        LayoutError: there is no fin of a name in `failed`.
    """
    wanted = np.asarray(wrenches, dtype=np.float64).reshape(-1, 6) / SCALE
    if len(set(layout.indices(tuple(failed)))) == layout.n_fins:
        return np.where((wanted == 0.0).all(-1), 0.0, np.nan)
    return cheapest(power_problem(layout.without(failed)), wanted)


def power_problem(layout: Layout) -> PlanarProblem:
    """Returns the search for the least power in force space, in scaled wrenches."""
    objective = Objective("power")
    fins = layout_envelopes(layout, objective).without_rest()
    return planar_problem(layout, fins, SCALE, objective)


def variant(problem: PlanarProblem, sets: FinSets, row: int) -> PlanarProblem:
    """Returns the same fins placed, and stopped, as those of one robot among `sets`."""
    effectiveness, products = flat_effectiveness(sets.effectiveness[row])
    fins = problem.fins.within(sets.middle[row], sets.half[row])
    return problem._replace(effectiveness=effectiveness, products=products, fins=fins)


def cheapest(problem: PlanarProblem, target: Array) -> Array:
    """Returns the least power (N,) [W] for scaled wrenches (N, 6), NaN where none of the fins' forces gives
    them."""
    if len(target) == 0:
        return np.empty(0)
    maximum = problem.fins.maximum
    found = descend(problem, target, np.broadcast_to(maximum, (len(target), len(maximum))), STEPS)
    strongest = (np.tile(maximum, 2)[:, None] * problem.effectiveness).max()
    missed = np.abs(found.residual).max(-1) > OFF * strongest
    return np.where(missed, np.nan, found.row[..., COST].sum(-1))
