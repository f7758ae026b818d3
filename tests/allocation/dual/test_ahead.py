"""Pods turn in time for wrenches that are known: less power, no more turning, nothing missed for
it."""

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from finlab import Allocator, Azimuth, Layout, PowerLaw, load_layout
from finlab.allocation.dual.ahead import conditions_ahead
from finlab.allocation.dual.compiled import Compiled
from finlab.arrays import Array
from finlab.core.calls import Conditions

PERIOD_S = 0.1
"""Length of a tick [s]."""
QUARTER_TURN = math.pi / 2.0
"""An angle of 90 degrees [rad]."""
POD_POSITIONS = ((1.8, 0.8), (1.8, -0.8), (-1.8, 0.8), (-1.8, -0.8))
"""Where the four pods stand: x and y [m], one in each corner."""
POD_ARCS = (
    (QUARTER_TURN, 2.0 * QUARTER_TURN),
    (-2.0 * QUARTER_TURN, -QUARTER_TURN),
    (0.0, QUARTER_TURN),
    (-QUARTER_TURN, 0.0),
)
"""Angles that each pod can turn to [rad]: a quarter turn each."""
TICKS_AHEAD = 8
"""How many ticks ahead the wrenches are known."""


def four_pods() -> Layout:
    """A small ferry whose pods turn slowly, each in a quarter of the circle."""
    pods = tuple(
        Azimuth(
            name=f"pod_{i}",
            position=(*place, 0.0),
            turn_axis=(0.0, 0.0, 1.0),
            zero=(1.0, 0.0, 0.0),
            force=(-400.0, 400.0),
            model=PowerLaw(forward=1.0, reverse=1.0, exponent=2.0),
            arc=arc,
            turn_rate=0.5,
            rate=200.0,
        )
        for i, (place, arc) in enumerate(zip(POD_POSITIONS, POD_ARCS, strict=True))
    )
    return Layout(name="four", axes=("Fx", "Fy", "Tz"), actuators=pods)


def waves(ticks: int, seed: int) -> Array:
    """Wrenches (ticks + AHEAD, 6) of a slow load, waves and noise [N, N m]."""
    time = PERIOD_S * np.arange(ticks + TICKS_AHEAD)
    wrench = np.zeros((len(time), 6))
    wrench[:, 0] = 150.0 * np.sin(0.05 * time) + 60.0 * np.sin(0.9 * time)
    wrench[:, 1] = 120.0 * np.sin(0.04 * time + 1.0) + 80.0 * np.sin(0.8 * time + 0.4)
    wrench[:, 5] = 150.0 * np.sin(0.06 * time + 2.0) + 120.0 * np.sin(0.85 * time)
    noise = np.random.default_rng(seed).normal(size=(len(time), 3)) * [8.0, 8.0, 12.0]
    wrench[:, [0, 1, 5]] += noise
    return wrench


def ride(known: int, seed: int, ticks: int = 300) -> tuple[float, float, int]:
    """Returns mean power [W], turning of all pods [rad] and missed ticks, with so many wrenches
    known."""
    allocator = Allocator(four_pods(), calm=10.0, period_s=PERIOD_S)
    wrench = waves(ticks, seed)
    command = np.array([[sum(arc) / 2.0, 0.0, 0.0] for arc in POD_ARCS])
    power = 0.0
    total_turn = 0.0
    missed = 0
    for tick in range(ticks):
        reference = wrench[tick + 1 : tick + 1 + known] if known else None
        answer = allocator.allocate(wrench[tick], previous=command, reference=reference)
        np.testing.assert_array_equal(np.nan_to_num(answer.target), wrench[tick])
        turn = np.abs(answer.command[:, 0] - command[:, 0])
        assert turn.max() <= 0.5 * PERIOD_S * (1.0 + 1e-6)
        power += answer.power / ticks
        total_turn += turn.sum()
        missed += not answer.reachable
        command = answer.command
    return power, total_turn, missed


@pytest.mark.parametrize("seed", [2, 11])
def test_known_waves_take_a_tenth_less_power_for_no_more_turning(seed: int) -> None:
    blind_power, blind_turned, blind_missed = ride(0, seed)
    power, turned, missed = ride(TICKS_AHEAD, seed)
    assert power < 0.92 * blind_power
    assert turned < 1.02 * blind_turned
    assert missed <= blind_missed + 1


def test_a_pod_turns_before_the_wrench_does() -> None:
    """A push ahead becomes one to port in eight ticks: the stern's pods have begun to turn."""
    allocator = Allocator(load_layout("catamaran"), calm=2.0, period_s=PERIOD_S)
    now = np.zeros(6)
    later = np.zeros((TICKS_AHEAD, 6))
    now[0] = 40.0
    later[:, 0] = 10.0
    later[:, 1] = 20.0
    before = allocator.allocate(now).command
    stays = allocator.allocate(now, previous=before).command
    turns = allocator.allocate(now, previous=before, reference=later)
    assert turns.reachable
    assert np.abs(turns.command[:2, 0] - before[:2, 0]).max() > 0.02
    assert np.abs(stays[:2, 0] - before[:2, 0]).max() < 0.01


def test_what_stays_the_same_asks_for_no_turning() -> None:
    allocator = Allocator(load_layout("catamaran"), period_s=PERIOD_S)
    wrench = np.array([40.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    before = allocator.allocate(wrench).command
    alone = allocator.allocate(wrench, previous=before).command
    known = allocator.allocate(wrench, previous=before, reference=[wrench] * TICKS_AHEAD).command
    np.testing.assert_allclose(known, alone, atol=1e-3)


def test_lost_pods_and_free_axes_keep_out_of_it() -> None:
    allocator = Allocator(load_layout("catamaran"), period_s=PERIOD_S)
    wrench = np.array([30.0, 0.0, 0.0, 0.0, 0.0, 2.0])
    before = allocator.allocate(wrench).command
    known = [wrench] * TICKS_AHEAD
    answer = allocator.allocate(
        wrench, previous=before, reference=known, lost=["left"], free=("Fy",)
    )
    assert np.isnan(answer.command[0]).all() and np.isfinite(answer.command[1:]).all()


class CompiledStandIn:
    """Stands for a compiled robot whose answer to any later wrench is known."""

    def __init__(self, angles: list[float]) -> None:
        """Takes the angles [rad] of that answer."""
        self.angles = angles
        self.asked: list[tuple[Array, int]] = []

    def forces(self, targets: Array, _: Any, __: Any, conditions: Conditions) -> Any:
        """The answer."""
        self.asked.append((targets, conditions.ticks))
        return SimpleNamespace(command=np.array([[[angle, 1.0, 0.0] for angle in self.angles]]))


def test_half_of_a_turn_but_for_its_small_part_is_wanted_now() -> None:
    """In five ticks at 1 rad/s a pod turns by 0.5 rad, of which 0.05 is too little to turn for."""
    before = np.zeros((6, 3))
    before[:, 0] = [0.0, 0.0, 0.0, 3.0, -3.0, 0.0]
    compiled = CompiledStandIn([0.25, -0.45, 0.04, -3.0, 3.0, 0.3])
    turn_rates = np.array([1.0, 1.0, 1.0, 1.0, 1.0, math.nan])
    reference = np.arange(4.0)[:, None] * np.ones(6)
    asked = Conditions(previous=before, calm=2.0)
    told = conditions_ahead(cast("Compiled", compiled), turn_rates, PERIOD_S, reference, asked)
    over_seam = 2.0 * math.pi - 6.0
    expected = [
        0.5 * (0.25 - 0.05),
        -0.5 * (0.45 - 0.05),
        0.0,
        3.0 + 0.5 * (over_seam - 0.05),
        -3.0 - 0.5 * (over_seam - 0.05),
        math.nan,
    ]
    assert told.angles_wanted is not None
    np.testing.assert_allclose(told.angles_wanted, expected, atol=1e-12)
    assert told.calm == 20.0 and told.ticks == asked.ticks
    ((wrench, ticks),) = compiled.asked
    np.testing.assert_array_equal(wrench, [reference[3]])
    assert ticks == 5


@pytest.mark.parametrize(("known", "last"), [(1, 0), (8, 7), (30, 7)])
def test_no_more_than_eight_ticks_are_looked_ahead(known: int, last: int) -> None:
    compiled = CompiledStandIn([0.3])
    reference = np.arange(float(known))[:, None] * np.ones(6)
    asked = Conditions(previous=np.zeros((1, 3)), calm=2.0)
    conditions_ahead(cast("Compiled", compiled), np.ones(1), PERIOD_S, reference, asked)
    ((wrench, ticks),) = compiled.asked
    np.testing.assert_array_equal(wrench, [reference[last]])
    assert ticks == last + 2
