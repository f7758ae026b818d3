"""What holds for any layout, whichever fins it has: limits, symmetries, repeatability, no NaN."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from finlab.allocation import Allocation
from finlab.layout import Layout
from finlab.physics import Plant
from finlab.research.random_layouts import random_layout
from tests.allocator_cache import AllocatorCache, normalized_error
from webapp.tasks.modes import force_sizes, mode_signature, same_signature

GOOD = 1e-5
"""Normalized error below which an answer counts as exact here."""
SEEDS = st.integers(0, 2**32 - 1)
"""Seeds of random robots."""
LIMITS = st.sampled_from(["nominal", "varied"])
"""Whether all fins of a random robot have the same limits."""
MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
"""What becomes of a wrench when y changes its sign."""


def few(examples: int) -> settings:
    """Always the same examples, and not many."""
    return settings(derandomize=True, max_examples=examples, deadline=None, database=None)


def inside(layout: Layout, command: np.ndarray) -> bool:
    """To the last bit."""
    within = (command >= layout.lower).all() and (command <= layout.upper).all()
    return bool(np.isfinite(command).all() and within)


def drawn(seed: int, limits: str = "nominal") -> tuple[Layout, np.ndarray]:
    """A layout and a wrench of one of its commands."""
    rng = np.random.default_rng(seed)
    layout = random_layout(rng, limits=limits)  # type: ignore[arg-type]
    return layout, reachable_wrench(layout, rng)


def reachable_wrench(layout: Layout, rng: np.random.Generator) -> np.ndarray:
    """The wrench (6,) of a random command."""
    lower = layout.lower
    upper = layout.upper
    return Plant(layout).wrench(lower + rng.uniform(size=lower.shape) * (upper - lower))


def is_same_power(one: Allocation, other: Allocation, share: float) -> bool:
    """Whether two answers take as much power, but for a share of it."""
    return abs(one.power - other.power) <= share * one.power


def wrapped(angle: float) -> float:
    """An angle [rad] in [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


@few(20)
@given(seed=SEEDS)
def test_the_order_of_the_fins_does_not_matter(search: AllocatorCache, seed: int) -> None:
    layout, target = drawn(seed)
    order = np.random.default_rng(seed).permutation(layout.n_fins)
    shuffled = replace(layout, actuators=tuple(layout.fins[i] for i in order))
    one = search.allocate(layout, target)
    other = search.allocate(shuffled, target)
    assert one.err_norm < GOOD and other.err_norm < GOOD
    assert normalized_error(search.normalization, one.wrench, other.wrench) < GOOD
    assert is_same_power(one, other, 0.002)


@few(20)
@given(seed=SEEDS, limits=LIMITS, yaw=st.floats(-math.pi, math.pi))
def test_a_turned_robot_gets_the_turned_answer(
    search: AllocatorCache, seed: int, limits: str, yaw: float
) -> None:
    layout, target = drawn(seed, limits)
    c = math.cos(yaw)
    s = math.sin(yaw)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    fins = [
        replace(
            fin,
            position=tuple((rotation @ fin.position).tolist()),
            mounting_angle=wrapped(fin.mounting_angle + yaw),
        )
        for fin in layout.fins
    ]
    turned_layout = replace(layout, actuators=tuple(fins))
    one = search.allocate(layout, target)
    other = search.allocate(
        turned_layout, np.concatenate([rotation @ target[:3], rotation @ target[3:]])
    )
    assert one.err_norm < GOOD and other.err_norm < GOOD
    assert is_same_power(one, other, 0.002)


@few(20)
@given(seed=SEEDS, limits=LIMITS)
def test_a_mirrored_robot_gets_the_mirrored_answer(
    search: AllocatorCache, seed: int, limits: str
) -> None:
    layout, target = drawn(seed, limits)
    # The thrust axis e_h is mirrored, so zero directions and with them the energy stay what they
    # are.
    fins = [
        replace(
            fin,
            position=(fin.position[0], -fin.position[1], fin.position[2]),
            mounting_angle=wrapped(math.pi - fin.mounting_angle),
        )
        for fin in layout.fins
    ]
    one = search.allocate(layout, target)
    other = search.allocate(replace(layout, actuators=tuple(fins)), MIRROR * target)
    assert one.err_norm < GOOD and other.err_norm < GOOD
    assert is_same_power(one, other, 0.002)


@few(15)
@given(seed=SEEDS, limits=LIMITS, place=st.integers(0, 4))
def test_a_lost_one_is_removed(search: AllocatorCache, seed: int, limits: str, place: int) -> None:
    layout, target = drawn(seed, limits)
    name = layout.names[place % layout.n_fins]
    # What is nearest depends on the wrench scale, which is that of the whole robot.
    without = search.allocate(layout, target, lost=[name], policy="direction")
    removed = search.allocate(layout.without([name]), target, policy="direction")
    alive = [i for i, fin in enumerate(layout.names) if fin != name]
    if removed.reachable:
        np.testing.assert_allclose(without.command[alive], removed.command, atol=1e-6)
    assert np.isnan(without.command[layout.index(name)]).all()
    np.testing.assert_allclose(without.wrench, removed.wrench, atol=1e-3)
    # Where next to nothing of a target can be had, so is the power.
    assert without.power == pytest.approx(removed.power, rel=1e-4, abs=1e-5)


@few(15)
@given(seed=SEEDS)
def test_a_small_change_of_the_layout_changes_the_answer_little(
    search: AllocatorCache, seed: int
) -> None:
    layout, target = drawn(seed)
    rng = np.random.default_rng(seed + 1)
    fins = [
        replace(
            fin,
            position=tuple((np.array(fin.position) + rng.uniform(-1e-5, 1e-5, 3)).tolist()),
            mounting_angle=wrapped(fin.mounting_angle + float(rng.uniform(-1e-5, 1e-5))),
        )
        for fin in layout.fins
    ]
    one = search.allocate(layout, target)
    other = search.allocate(replace(layout, actuators=tuple(fins)), target)
    # A robot of few fins may have been moved away from the target.
    moved = normalized_error(search.normalization, Plant(other.layout).wrench(one.command), target)
    assert other.err_norm <= max(GOOD, moved)
    # Fins that hardly span a wrench make the least power itself sensitive: then both are proved to
    # be least.
    is_least = [answer.power <= (1.0 + 1e-4) * answer.bound for answer in (one, other)]
    assert is_same_power(one, other, 0.002) or all(is_least)
    signatures = [mode_signature(a.command, force_sizes(a.layout, a.command)) for a in (one, other)]
    if same_signature(*signatures):
        np.testing.assert_allclose(one.forces, other.forces, atol=0.05)
