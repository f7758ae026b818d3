"""Distinct ways to deliver a wrench: what counts as the same, and what is told of each."""

import math

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.allocation.modes import find_modes, mode_signature, same_signature
from finlab.allocation.solution import Candidates
from finlab.assets import shipped_layouts
from finlab.layout import load_layout
from finlab.physics import Plant

LOWER, UPPER = np.tile([0.05, 0.1, -math.pi], (2, 1)), np.tile([0.6, 2.1, math.pi], (2, 1))
PUSH, REST = (0.4, 1.5, 0.0), (0.05, 0.1, 0.0)


def candidates(*commands: list[tuple[float, ...]]) -> Candidates:
    command = np.array(commands)
    k = len(command)
    return Candidates(command, np.zeros((k, 6)), np.zeros(k), np.arange(1.0, k + 1), ("",) * k)


def test_the_same_fins_at_rest_are_the_same_mode_whatever_they_do_there() -> None:
    told = candidates([PUSH, REST], [PUSH, (0.05, 0.1, 2.0)], [REST, PUSH])
    modes = find_modes(told, LOWER, UPPER)
    assert [mode.members for mode in modes] == [(0, 1), (2,)]
    assert [mode.resting for mode in modes] == [(1,), (0,)]
    assert modes[1].energy == 3.0 and modes[0].distance is None and modes[0].turn is None


def test_angles_are_compared_the_shorter_way_round() -> None:
    one = mode_signature(np.array([PUSH, (0.4, 1.5, math.pi - 0.05)]))
    assert same_signature(one, mode_signature(np.array([PUSH, (0.4, 1.5, 0.05 - math.pi)])))
    assert not same_signature(one, mode_signature(np.array([PUSH, (0.4, 1.5, 0.6 - math.pi)])))


def test_distance_and_saturation() -> None:
    previous = np.array([(0.4, 1.5, math.pi - 0.1), REST])
    (mode,) = find_modes(candidates([(0.4, 2.1, 0.1 - math.pi), REST]), LOWER, UPPER, previous)
    assert mode.turn == pytest.approx(0.2)
    assert mode.distance == pytest.approx(math.sqrt(0.5 * ((0.6 / 2.0) ** 2 + (0.2 / math.pi) ** 2)))
    assert mode.saturation == 1.0
    (lost,) = find_modes(candidates([PUSH, (math.nan,) * 3]), LOWER, UPPER, np.full((2, 3), np.nan))
    assert lost.distance is None and lost.resting == ()


def test_modes_of_an_answer_deliver_the_wrench_in_different_ways(learned: LearnedAllocator) -> None:
    layout = load_layout(shipped_layouts()["penta"])
    target = np.array([1.0, 0.5, 2.0, 0.0, 0.1, 0.1])
    before = learned.allocate(layout, 0.9 * target).command
    result = learned.allocate(layout, target, failed=["bow"], previous=before)
    modes = result.explore()
    assert len(modes) >= 2
    np.testing.assert_array_equal(modes[0].command, result.command)
    assert modes[0].energy == pytest.approx(result.energy)
    wrench = Plant(layout).wrench(np.array([mode.command for mode in modes]))
    assert learned.normalization.error(wrench, target).max() < 5e-3
    ways = [mode_signature(mode.command) for mode in modes]
    assert not any(same_signature(a, b) for i, a in enumerate(ways) for b in ways[:i])
    bow = layout.index("bow")
    assert all(mode.distance is not None and np.isnan(mode.command[bow]).all() for mode in modes)


def test_a_method_with_one_answer_tells_no_modes() -> None:
    layout = load_layout(shipped_layouts()["A"])
    assert load_allocator("analytic").allocate(layout, [1, 0, 0, 0, 0, 0]).explore() == ()
