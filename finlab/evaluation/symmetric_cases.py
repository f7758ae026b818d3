"""Cases in which fins are equals, so that a method must choose which of them works, as robots mostly ask.

`axes`: pure axes on the symmetric shipped layouts; `axes-mixed`: two or three axes together.
"""

from functools import cache
from itertools import combinations

import numpy as np

from finlab.analysis import AXES, authority
from finlab.arrays import Array
from finlab.evaluation.splits import Case
from finlab.layout import Layout, load_layout

DOMAIN = 0x5E11
"""Leads the seed of every case."""
LAYOUTS = ("A", "B", "penta", "hexa", "octo")
"""The symmetric shipped layouts."""
SHARES = (0.2, 0.5, 0.8)
"""Of the largest wrench along an axis alone: what is asked for."""
SETS = ("axes", "axes-mixed")
"""Names of the sets; the order is part of the seed: append only."""


def symmetric_cases(name: str, n_layouts: int, n_targets: int, seed: int) -> list[Case]:
    """The cases of a set, on the first of the shipped layouts.

    Args:
        name: one of `SETS`.
        n_layouts: most layouts.
        n_targets: most targets of each; axes are asked for in a drawn order.
        seed: of all draws.
    """
    cases = []
    for k, robot in enumerate(LAYOUTS[:n_layouts]):
        rng = np.random.default_rng((DOMAIN, SETS.index(name), seed, k))
        layout = load_layout(robot)
        targets = rng.permutation(_mixed_axes(rng, layout) if name == "axes-mixed" else _axes(layout))
        cases.append(Case(layout, targets[:n_targets], ()))
    return cases


@cache
def _largest(layout: Layout) -> Array:
    """The largest wrenches (a, 6) along each axis that can be had alone, as much as either sign gives."""
    held = authority(layout)
    least = np.minimum(held.largest, held.most_negative)
    alone = [AXES.index(name) for name in held.reachable]
    return np.asarray(np.diag(least)[alone])


def _axes(layout: Layout) -> Array:
    """Each axis in both directions, at each of `SHARES`."""
    largest = _largest(layout)
    return np.concatenate([sign * share * largest for sign in (1.0, -1.0) for share in SHARES])


def _mixed_axes(rng: np.random.Generator, layout: Layout) -> Array:
    """Every two and three axes with drawn signs and parts, together a share of what each gives alone."""
    largest = _largest(layout)
    targets = []
    for chosen in (each for count in (2, 3) for each in combinations(range(len(largest)), count)):
        part = rng.dirichlet(np.ones(len(chosen))) * rng.choice([-1.0, 1.0], len(chosen))
        targets.append(rng.choice(SHARES) * part @ largest[list(chosen)])
    return np.array(targets).reshape(-1, 6)
