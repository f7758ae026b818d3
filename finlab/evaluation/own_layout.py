"""A user's own layout as a test case: wrenches that its fins can deliver, drawn from a seed."""

import numpy as np

from finlab.evaluation.splits import Case, own_sigma
from finlab.layout import Layout
from finlab.physics import plant_of

DOMAIN = 0x0711
"""Leads the seed of the draws."""


def own_case(layout: Layout, failed: tuple[str, ...], n_targets: int, seed: int) -> Case:
    """Targets on one layout: wrenches of uniform commands of the fins that work.

    Errors are measured by the robot's own wrenches, however large or small they are.

    Args:
        layout: all fins.
        failed: names of those that do not work.
        n_targets: at least 1; a smaller number gives the first of a larger one.
        seed: not negative.

    Raises:
        DataError: a force table that cannot be read.
        LayoutError: no fin is left.
    """
    plant = plant_of(layout.without(failed))
    target_seed, sigma_seed = np.random.SeedSequence((DOMAIN, seed)).spawn(2)
    targets = plant.wrench(plant.sample(np.random.default_rng(target_seed), (n_targets,)))
    return Case(layout, targets, failed, own_sigma(plant, np.random.default_rng(sigma_seed)))
