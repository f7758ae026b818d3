"""The null space of an answer: the wrench stays, watts are no less, and beyond the ranges it
ends."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.analysis.null_space import NullSpace
from finlab.layout import load_layout
from finlab.layout.effectiveness import layout_effectiveness
from finlab.layout.layout import Bus
from finlab.physics import plant_of
from finlab.physics.objective import REACHED
from tests.random_robots import KINDS, load, random_flow, random_plant, random_robot, within
from tests.sampled_cases import sampled

SAME = 1e-6
"""Normalized error that counts as none, and share of power."""


@pytest.mark.parametrize("kind", sampled(KINDS, every=3))
def test_along_it_the_wrench_stays_and_watts_are_no_less(kind: str) -> None:
    rng = np.random.default_rng(4)
    off = []
    for number in range(3):
        allocator = Allocator(load(random_robot(kind, number, 0)))
        target = within(random_plant(kind, number, 0), rng, 0.2, 0.5)
        answer = allocator.allocate(target, flow=random_flow(kind, number, 0))
        space = NullSpace(answer)
        count = len(space.basis)
        flat = space.basis.reshape(count, space.basis[0].size if count else 0)
        np.testing.assert_allclose(flat @ flat.T, np.eye(count), atol=1e-9)
        for k, range_ends in enumerate(space.ranges(np.zeros(count), count)):
            assert range_ends[0] <= 0.0 <= range_ends[1]
            shift = np.outer(range_ends * rng.uniform(0.5, 0.99), np.eye(count)[k])
            for command in space.commands(shift):
                other = answer.with_command(command)
                off.append(np.linalg.norm((other.wrench - answer.wrench) / answer.scale))
                assert off[-1] < REACHED, f"{kind} {number}, direction {k}"
                assert answer.bound is None or other.power >= answer.bound * (1.0 - SAME)
                low = answer.layout.lower - 1e-9
                high = answer.layout.upper + 1e-9
                assert ((command >= low) & (command <= high)).all()
    assert off or kind in ("rudders", "holes"), "some of them have another way"
    assert np.median(off or 0.0) < SAME, (
        "less exact only where the force of a fin hardly changes with its command"
    )


def test_it_has_as_many_directions_as_forces_beyond_the_rank() -> None:
    for name, lost in (
        ("bluerov2_heavy", ()),
        ("hexa", ()),
        ("hexa", ("middle_left",)),
        ("catamaran", ()),
    ):
        layout = load_layout(name)
        answer = Allocator(layout).allocate([1.0, 0, 0, 0, 0, 0.1], lost=lost)
        left = layout_effectiveness(layout.without(lost) if lost else layout)[layout.commanded]
        space = NullSpace(answer)
        assert len(space.basis) == left.shape[1] - np.linalg.matrix_rank(left), name
        assert not any(set(lost) & set(space.participants(k)) for k in range(len(space.basis)))
        moved = space.commands(np.ones((1, len(space.basis))) * 0.1)[0]
        assert [bool(np.isnan(row).all()) for row in moved] == [
            actuator in lost for actuator in layout.names
        ]


def test_beyond_a_range_an_actuator_has_no_command() -> None:
    layout = load_layout("bluerov2_heavy")
    answer = Allocator(layout).allocate([20.0, 0, 0, 0, 0, 0])
    space = NullSpace(answer)
    range_ends = space.ranges(np.zeros(2), 2)
    least, most = np.array([actuator.force for actuator in layout.actuators]).T  # type: ignore[attr-defined]
    for k in range(2):
        for range_end in range_ends[k]:
            force = answer.command[:, 0] + range_end * space.basis[k, :, 0]
            room = np.minimum(force - least, most - force)
            assert abs(room.min()) < 0.005 * most.max(), "one of them is at its limit there"
    further = space.ranges(np.array([0.5 * range_ends[0, 1], 0.0]), 2)
    np.testing.assert_allclose(further[0], range_ends[0], atol=0.1)


def test_the_mean_of_two_commands_of_fins_misses_and_of_thrusters_does_not() -> None:
    for name, misses in (("ucat", True), ("bluerov2_heavy", False)):
        answer = Allocator(load_layout(name)).allocate([1.2, 0, 0, 0, 0, 0.25])
        space = NullSpace(answer)
        other = space.commands(np.array([[0.8 * space.ranges(np.zeros(2), 2)[0, 1], 0.0]]))[0]
        assert answer.with_command(other).reachable
        mean = answer.with_command(space.mean(answer.command, other))
        assert (mean.err_norm > 0.05) is misses
        np.testing.assert_allclose(
            space.mean(answer.command, answer.command), answer.command, atol=1e-12
        )


@pytest.mark.parametrize("lost", [(), ("front_left",)])
def test_ranges_end_where_the_power_budget_does(lost: tuple[str, ...]) -> None:
    heavy = load_layout("bluerov2_heavy")
    target = [15.0, 0.0, 10.0, 0.0, 0.0, 0.0]
    free = Allocator(heavy).allocate(target, lost=lost)
    buses = (
        Bus("fore", 1.3 * float(free.power), heavy.names[:4]),
        Bus("lift", 60.0, heavy.names[4:]),
    )
    layout = replace(heavy, buses=buses)
    answer = Allocator(layout).allocate(target, lost=lost)
    space = NullSpace(answer)
    count = len(space.basis)
    ranges = space.ranges(np.zeros(count), count)
    plain = NullSpace(free).ranges(np.zeros(count), count)
    assert (ranges[:, 1] - ranges[:, 0] < 0.9 * (plain[:, 1] - plain[:, 0])).any()
    ends = []
    for k in range(count):
        for end in ranges[k]:
            command = space.commands(1.0001 * end * np.eye(count)[k : k + 1])[0]
            power = np.nan_to_num(plant_of(layout).power(command))
            taken = np.array([power[:4].sum(), power[4:].sum()])
            ends.append((taken / [bus.power_w for bus in buses]).max())
    assert max(ends) <= 1.001
    assert np.mean(np.array(ends) >= 0.99) >= 0.5
