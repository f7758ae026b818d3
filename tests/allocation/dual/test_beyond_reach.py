"""Policies beyond reach on random robots of thrusters, beside a linear programme and bounded least squares."""

import itertools
from functools import cache

import numpy as np
import pytest
from scipy.optimize import linprog, lsq_linear

from finlab.allocation import Allocator, Policy
from finlab.arrays import Array
from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.layout import load_layout
from finlab.layout.file import parse_layout
from tests.mixed_robots import layout_of

ROBOTS = range(24)
LAW = {"type": "power_law", "forward": 1.0, "reverse": 1.5, "exponent": 1.5}


@cache
def _robot(number: int) -> tuple[Allocator, Array, Array, Array]:
    """A robot of 2 to 12 thrusters, its effectiveness matrix (6, n), and the ends of its forces (n,)."""
    rng = np.random.default_rng([0xBE40, number])
    parts, columns, ends = [], [], []
    for k in range(rng.integers(2, 13)):
        axis = np.eye(3)[rng.integers(3)] if rng.random() < 0.4 else rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        place, turn = rng.uniform(-0.5, 0.5, 3), float(rng.choice([0.0, 0.02]))
        ends.append([-float(rng.choice([0.0, 10.0, 40.0])), float(rng.uniform(1.0, 60.0))])
        columns.append([*axis, *(np.cross(place, axis) + turn * axis)])
        parts.append(
            {"name": f"m{k}", "type": "thruster", "position_m": place.tolist(), "axis": axis.tolist()}
            | {"force_n": ends[-1], "torque_per_newton_m": turn}
            | {"model": LAW}
        )
    allocator = Allocator(parse_layout(layout_of(f"r{number}", parts)))
    return allocator, np.array(columns).T, *np.array(ends).T


def _targets(number: int, allocator: Allocator, by: Array, low: Array, high: Array) -> Array:
    """Wrenches (4, 6) near and far beyond the reach of a robot, half of them along what it can push."""
    rng = np.random.default_rng([0xBE41, number])
    some = rng.normal(size=(2, 6)) * allocator.scale
    own = (low + rng.random((2, len(low))) * (high - low)) @ by.T
    return np.concatenate([some, own]) * 10.0 ** rng.uniform(0.0, 1.5, (4, 1))


@pytest.mark.parametrize("number", ROBOTS)
def test_direction_gives_the_share_of_the_linear_programme_and_nothing_beside(number: int) -> None:
    allocator, by, low, high = robot = _robot(number)
    scale = allocator.scale
    for target in _targets(number, *robot):
        answer = allocator.allocate(target, policy="direction")
        rows = np.column_stack([by / scale[:, None], -target / scale])
        best = linprog(
            np.eye(len(low) + 1)[-1] * -1.0,
            A_eq=rows,
            b_eq=np.zeros(6),
            bounds=[*zip(low, high, strict=True), (0.0, 1.0)],
        )
        assert np.linalg.norm((answer.wrench - answer.share * target) / scale) < 1e-6
        assert answer.share >= 0.998 * best.x[-1] - 1e-6


@pytest.mark.parametrize("number", ROBOTS)
def test_closest_and_the_first_group_miss_no_more_than_least_squares(number: int) -> None:
    allocator, by, low, high = robot = _robot(number)
    for target in _targets(number, *robot):
        for policy, rows in ((None, slice(None)), (Policy("priority", order=(("Fz",), ("Fx",))), [2])):
            answer = allocator.allocate(target, policy=policy or "closest")
            scaled, wanted = (by / allocator.scale[:, None])[rows], (target / allocator.scale)[rows]
            best = lsq_linear(scaled, wanted, (low, high), method="bvls", tol=1e-14)
            least = np.linalg.norm(scaled @ best.x - wanted)
            assert np.linalg.norm((answer.unallocated / allocator.scale)[rows]) <= least + 1e-5


@pytest.mark.parametrize("policy", ["closest", "direction", "priority"])
def test_one_code_one_answer_whose_bound_is_below_its_power(policy: str) -> None:
    for number in ROBOTS:
        allocator, *_ = robot = _robot(number)
        targets = np.concatenate([_targets(number, *robot), 0.05 * _targets(number, *robot)])
        batch = allocator.allocate_batch(targets, policy=policy)
        previous = None
        for k, target in enumerate(targets):
            one = allocator.allocate(target, policy=policy)
            assert batch.err_norm[k] == pytest.approx(one.err_norm, abs=1e-9)
            assert batch.power[k] == pytest.approx(one.power, rel=1e-9, abs=1e-9)
            assert batch.reachable[k] == one.reachable
            assert one.bound is not None and one.bound <= one.power
            next_one = allocator.allocate(target, policy=policy, previous=previous)
            assert next_one.bound is not None and next_one.bound <= next_one.power
            previous = next_one.command


def test_a_command_inside_a_dead_band_is_neutral() -> None:
    rng = np.random.default_rng(4)
    band = {"name": "t", "type": "thruster", "force_n": [-40.0, 50.0], "model": LAW, "dead_band_n": 3.0}
    for number in range(12):
        parts = []
        for k in range(6):
            axis = rng.normal(size=3)
            axis /= np.linalg.norm(axis)
            parts.append(
                band | {"name": f"t{k}", "axis": axis.tolist(), "position_m": rng.uniform(-1, 1, 3).tolist()}
            )
        allocator = Allocator(parse_layout(layout_of(f"b{number}", parts)))
        targets = rng.normal(size=(20, 6)) * allocator.scale * 10.0 ** rng.uniform(-2, 1, (20, 1))
        for policy, target in itertools.product(("closest", "direction", "priority"), targets):
            force = allocator.allocate(target, policy=policy).command[:, 0]
            assert not ((np.abs(force) < 3.0 * (1.0 - 1e-9)) & (force != 0.0)).any(), force


@pytest.mark.parametrize("name", sorted(shipped_layouts()))
def test_no_question_of_a_shipped_layout_ends_in_a_foreign_exception(name: str) -> None:
    layout, rng = load_layout(name), np.random.default_rng(11)
    allocator = Allocator(layout)
    losses: list[tuple[str, ...]] = [(), layout.names[:1], layout.names[2:]]
    for lost, policy in itertools.product(losses, ("closest", "direction", "priority")):
        target = rng.normal(size=6) * allocator.scale * 10.0 ** rng.uniform(-1, 2)
        try:
            answer = allocator.allocate(target, failed=lost, policy=policy)
        except FinlabError:
            continue
        assert np.isfinite(answer.err_norm)
        assert answer.bound is None or answer.bound <= answer.power
