"""The search among convex parts, beside all combinations of parts one by one."""

from itertools import product

import numpy as np
import pytest

from finlab.analysis.refusal_check import covers, proven_share
from finlab.analysis.split_sets import Piece, SplitSet, largest_shares
from finlab.forces.power_sides import PowerCurve, Side
from tests.oracle_budget import ConicProgram


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


def with_power(rng: np.random.Generator, each: SplitSet, bus: str | None) -> SplitSet:
    """A set whose forces take power, by a law of its own: all its parts alike."""
    curve = PowerCurve(rng.uniform(1.0, 3.0), rng.uniform(1.3, 2.5))

    def priced(piece: Piece) -> Piece:
        side = Side(curve, piece.radius, piece.center, piece.half_angle, piece.corners)
        return piece._replace(sides=(side,))

    parts = tuple(priced(part) for part in each.parts)
    return each._replace(cover=priced(each.cover), parts=parts, bus=bus)


def share_by_cones(
    sets: list[SplitSet], target: np.ndarray, factor: np.ndarray, watts: dict[str, float]
) -> float:
    """The largest share of a wrench (6,) that forces of the covers hold, by a cone program: the
    share g of the largest forces of a set is a number, of a polygon the sum of its corners'
    weights."""
    program = ConicProgram()
    share = program.number()
    balance: list[dict[int, float]] = [{share: -float(each)} for each in target]
    buses: dict[str, dict[int, float]] = {name: {} for name in watts}
    for each, left in zip(sets, factor, strict=True):
        (side,) = each.cover.sides
        g = program.number()
        t = program.number()
        program.at_most({g: 1.0}, 1.0)
        program.at_most({g: -1.0}, 0.0)
        program.power_at_least(t, g, side.curve.exponent)
        if each.bus is not None:
            buses[each.bus][t] = side.curve.watts / watts[each.bus]
        if side.corners is None:
            along = [program.number(), program.number()]
            size = program.number()
            program.equal({size: 1.0, g: -side.radius}, 0.0)
            program.norm_at_most(size, [({k: 1.0}, 0.0) for k in along])
            if side.half_angle < np.pi:
                a = side.center - side.half_angle
                b = side.center + side.half_angle
                program.at_most({along[0]: np.sin(a), along[1]: -np.cos(a)}, 0.0)
                program.at_most({along[0]: -np.sin(b), along[1]: np.cos(b)}, 0.0)
            force = [(k, unit) for k, unit in zip(along, np.eye(2), strict=True)]
        else:
            weights = [program.number() for _ in side.corners]
            for k in weights:
                program.at_most({k: -1.0}, 0.0)
            program.equal({**dict.fromkeys(weights, 1.0), g: -1.0}, 0.0)
            force = list(zip(weights, side.corners, strict=True))
        for k, planar in force:
            for axis, gain in enumerate(left * planar @ each.effectiveness):
                balance[axis][k] = float(gain)
    for terms in balance:
        if any(terms.values()):
            program.equal(terms, 0.0)
    for terms in buses.values():
        if terms:
            program.at_most(terms, 1.0)
    program.at_most({share: 1.0}, 100.0)
    return float(program.least({share: -1.0})[share])


@pytest.mark.parametrize("seed", range(6))
def test_shares_within_budgets_are_the_best_of_all_combinations(seed: int) -> None:
    rng = np.random.default_rng([seed, 1])
    watts = {"fore": rng.uniform(0.5, 2.0), "aft": rng.uniform(0.3, 1.5)}
    buses = ["fore", "fore", "aft", None] if seed % 2 else ["fore", "aft", "aft", "fore"]
    sets = [with_power(rng, random_set(rng, f"azimuth_{k}"), bus) for k, bus in enumerate(buses)]
    target = np.zeros((4, 6))
    target[:, [0, 1, 5]] = rng.standard_normal((4, 3)) * [1.0, 1.0, 5.0]
    factor = rng.uniform(0.3, 1.0, (4, 4))
    found = largest_shares(sets, target, factor, watts)
    by_combination = []
    for parts in product(*(each.parts for each in sets)):
        convex = [
            each._replace(cover=part, parts=()) for each, part in zip(sets, parts, strict=True)
        ]
        by_combination.append(
            [share_by_cones(convex, *own, watts) for own in zip(target, factor, strict=True)]
        )
    assert found.share == pytest.approx(np.max(by_combination, axis=0), rel=1e-5, abs=1e-6)
    assert (found.share < 0.9 * largest_shares(sets, target, factor).share).any()
    assert ((found.budget_worth > 0.0) & (found.budget_worth <= 1.0)).any()
    in_file = [each.to_dict() for each in sets]
    for wrench, scales, share, leaves in zip(
        target, factor, found.share, found.leaves, strict=True
    ):
        as_leaves = [leaf._asdict() | {"price": leaf.price.tolist()} for leaf in leaves]
        assert covers(as_leaves, in_file)
        for leaf in as_leaves:
            bound = proven_share(in_file, scales.tolist(), leaf, (-wrench).tolist(), watts)
            assert bound <= share * (1.0 + 1e-9) + 1e-9
