"""Multipliers that prove how far the sums of triples of a planar frame may go.

Vectors c_1 .. c_n of a plane, in the order of their lines, have cross products D_ab >= 0. With
sum_i c_i c_i^T = I these keep sum D_ab^2 = 1, and each four of them Plücker's relation
D_ac D_bd = D_ab D_cd + D_ad D_bc. So for any multipliers the sum over triples of (D_ab + D_bc +
D_ac)^2 is at most the largest eigenvalue of its form plus the multiples of these relations. One
multiplier serves all four-element sets with the same gaps around the circle, up to turns and
mirror images. They were found by a semidefinite programme.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np

from finlab.arrays import Array

Gaps = tuple[int, int, int, int]
MULTIPLIERS: Mapping[int, Mapping[Gaps, float]] = {
    4: {(1, 1, 1, 1): 1.99966},
    5: {(1, 1, 1, 2): 1.60014},
    6: {(1, 1, 1, 3): 1.11038, (1, 1, 2, 2): 1.71945, (1, 2, 1, 2): 0.88741},
    7: {(1, 1, 1, 4): 0.66567, (1, 1, 2, 3): 1.53839, (1, 2, 1, 3): 0.3492, (1, 2, 2, 2): 1.37094},
    8: {
        (1, 1, 1, 5): 0.37003,
        (1, 1, 2, 4): 1.234,
        (1, 1, 3, 3): 1.54204,
        (1, 2, 1, 4): 0.04542,
        (1, 2, 2, 3): 1.01034,
        (1, 2, 3, 2): 1.41983,
        (1, 3, 1, 3): -0.06676,
        (2, 2, 2, 2): 1.33701,
    },
}
"""Number of vectors -> gaps of four of them -> multiplier of their relation."""


def sums_of_triples(n: int) -> Array:
    """Returns the form Q (N, N) with D^T Q D = sum over triples of (D_ab + D_bc + D_ac)^2."""
    index = pair_index(n)
    form = np.zeros((len(index), len(index)))
    for triple in combinations(range(n), 3):
        pairs = [index[pair] for pair in combinations(triple, 2)]
        form[np.ix_(pairs, pairs)] += 1.0
    return form


def relations(n: int) -> Iterator[tuple[Gaps, Array]]:
    """Yields the gaps of each four vectors, and the form (N, N) that is 0 by their relation."""
    index = pair_index(n)
    for four in combinations(range(n), 4):
        a, b, c, d = four
        form = np.zeros((len(index), len(index)))
        for first, second, sign in (
            ((a, c), (b, d), 1.0),
            ((a, b), (c, d), -1.0),
            ((a, d), (b, c), -1.0),
        ):
            form[index[first], index[second]] += 0.5 * sign
            form[index[second], index[first]] += 0.5 * sign
        yield _canonical([b - a, c - b, d - c, n - d + a]), form


def pair_index(n: int) -> Mapping[tuple[int, int], int]:
    """Returns the index of each pair of vectors."""
    return {pair: k for k, pair in enumerate(combinations(range(n), 2))}


def _canonical(gaps: Sequence[int]) -> Gaps:
    """The first of all turns and mirror images of some gaps."""
    images = []
    for direction in (gaps, gaps[::-1]):
        for k in range(4):
            images.append((*direction[k:], *direction[:k]))
    return min(images)
