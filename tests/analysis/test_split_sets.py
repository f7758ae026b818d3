"""The search among convex parts, beside all combinations of parts one by one."""

from itertools import product

import numpy as np
import pytest

from finlab.analysis.force_pieces import Piece
from finlab.analysis.refusal_check import covers, proven_share
from finlab.analysis.split_sets import SplitSet, largest_shares


def random_set(rng: np.random.Generator, name: str) -> SplitSet:
    """An azimuth in the plane with up to three sectors in which it may push, or a polygon in place
    of one of these."""
    x, y = rng.uniform(-10.0, 10.0, 2)
    effectiveness = np.zeros((2, 6))
    effectiveness[0, [0, 5]] = 1.0, -y
    effectiveness[1, [1, 5]] = 1.0, x
    radius = rng.uniform(1.0, 5.0)
    parts = []
    for center in rng.uniform(0.0, 2.0 * np.pi, rng.integers(1, 4)):
        half_angle = rng.uniform(0.1, 0.5 * np.pi)
        if rng.random() < 0.5:
            parts.append(Piece(radius, center, half_angle))
            continue
        angle = center + half_angle * np.array([-1.0, 0.0, 1.0])
        ends = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        parts.append(Piece(radius, corners=np.concatenate([[[0.0, 0.0]], ends])))
    return SplitSet(name, effectiveness, Piece(radius), tuple(parts))


@pytest.mark.parametrize("seed", range(12))
def test_shares_are_the_best_of_all_combinations_of_parts(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sets = [random_set(rng, f"azimuth_{k}") for k in range(4)]
    target = np.zeros((6, 6))
    target[:, [0, 1, 5]] = rng.standard_normal((6, 3)) * [1.0, 1.0, 5.0]
    factor = rng.uniform(0.3, 1.0, (6, 4))
    found = largest_shares(sets, target, factor)
    by_combination = []
    for parts in product(*(each.parts for each in sets)):
        convex = [
            each._replace(cover=part, parts=()) for each, part in zip(sets, parts, strict=True)
        ]
        by_combination.append(largest_shares(convex, target, factor).share)
    assert found.share == pytest.approx(np.max(by_combination, axis=0), rel=1e-6, abs=1e-6)
    in_file = [each.to_dict() for each in sets]
    for wrench, scales, share, leaves in zip(
        target, factor, found.share, found.leaves, strict=True
    ):
        as_leaves = [{"parts": leaf.parts, "price": leaf.price.tolist()} for leaf in leaves]
        assert covers(as_leaves, in_file)
        for leaf in as_leaves:
            bound = proven_share(in_file, scales.tolist(), leaf, (-wrench).tolist())
            assert bound <= share * (1.0 + 1e-9) + 1e-9


def test_leaves_that_leave_out_a_part_cover_nothing() -> None:
    sets = [{"name": "a", "parts": [{}, {}]}, {"name": "b", "parts": [{}, {}, {}]}]
    every = [{"parts": {"a": 0}}] + [{"parts": {"a": 1, "b": part}} for part in range(3)]
    assert covers(every, sets)
    for k in range(len(every)):
        assert not covers(every[:k] + every[k + 1 :], sets)
    assert not covers([], sets)
    assert not covers([{"parts": {"c": 0}}], sets)
