"""The convex sets that stand for what a robot's compiled fins can push, where only reach counts."""

import numpy as np

from finlab.forces.fin_sets import FinSets
from finlab.forces.force_space import PlanarProblem


def planar_sets(problem: PlanarProblem) -> FinSets:
    """The fins of a problem as one robot of a batch."""
    fins, rim = problem.fins, problem.fins.rim_shares
    columns = np.stack(np.split(problem.columns, 2), axis=1)
    return FinSets(
        columns[None],
        fins.maximum[None],
        fins.middle[None],
        fins.half[None],
        None if rim is None else rim[None],
    )
