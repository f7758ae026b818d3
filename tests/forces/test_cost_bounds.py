"""Lower bounds on cost: never above what some command costs, close to what the search finds."""

import numpy as np

from finlab.forces.envelopes import layout_envelopes
from finlab.forces.force_space import PlanarProblem, planar_problem
from finlab.layout import Fin, FinModelSpec, Layout, Limits
from finlab.physics.objective import Name, Objective

SIGMA = np.array([1.0, 1.0, 1.0, 0.2, 0.2, 0.2])


def uneven(n: int, seed: int) -> Layout:
    """A robot of soft fins that lean and push harder in one direction, one of them with stops."""
    rng = np.random.default_rng(4)
    model = FinModelSpec("soft", (("d", 0.1), ("e", 0.2), ("k", 3.0), ("phi_e", 0.7)))
    fins = []
    for i in range(n):
        x, y, z = rng.uniform(-1.0, 1.0, 3) * [0.3, 0.3, 0.1]
        limits = Limits(zero_direction=(-1.2, 1.2)) if i == 0 else Limits()
        fins.append(Fin(f"fin_{i}", (x, y, z), rng.uniform(-3.0, 3.0), limits, model))
    return Layout(name="uneven", actuators=tuple(fins))


def problem_of(layout: Layout, name: Name) -> PlanarProblem:
    objective = Objective(name)
    return planar_problem(layout, layout_envelopes(layout, objective), SIGMA, objective)
