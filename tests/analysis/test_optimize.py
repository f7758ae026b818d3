"""Searches improve their goals, stay within bounds, keep mirror links, and stop when told."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from finlab.analysis import (
    GOALS,
    Bounds,
    Progress,
    authority,
    least_power,
    mirror_pairs,
    optimize_layout,
)
from finlab.arrays import Array
from finlab.axes import AXES as WRENCH
from finlab.errors import FinlabError, LayoutError
from finlab.layout import Layout
from tests.sampled_cases import sampled

Layouts = Callable[[str], Layout]
"""The type of the fixture `shipped`: a shipped robot by its name."""


@pytest.mark.parametrize("goal", GOALS)
def test_it_improves_within_bounds_and_keeps_the_mirror(shipped: Layouts, goal: str) -> None:
    layout = shipped("A")
    bounds = {"back_left": Bounds.around(layout.fins[2], (0.04, 0.04, 0.0), 0.6)}
    improvement = optimize_layout(layout, ["back_left"], bounds, goal, rounds=2, seed=1)
    assert improvement.improved
    assert improvement.value_after > improvement.value_before
    assert improvement.moved == ("back_left", "back_right")
    assert mirror_pairs(improvement.layout) == mirror_pairs(layout)
    assert improvement.layout.fins[:2] == layout.fins[:2]
    moved = improvement.layout.fins[2]
    assert np.abs(np.subtract(moved.position, layout.fins[2].position)).max() <= 0.04 + 1e-12
    assert moved.position[2] == layout.fins[2].position[2]
    assert abs(moved.mounting_angle - layout.fins[2].mounting_angle) <= 0.6 + 1e-12
    if goal == "weakest_direction":
        assert improvement.card_after.authority.weakest == pytest.approx(
            improvement.value_after, abs=1e-3
        )
        assert improvement.card_after.authority.weakest > improvement.card_before.authority.weakest


def test_no_yaw_learns_to_yaw(shipped: Layouts) -> None:
    layout = replace(shipped("no_yaw"), axes=WRENCH)
    improvement = optimize_layout(layout, ["front"], rounds=2)
    assert improvement.value_before == 0.0
    assert authority(improvement.layout).rank == 6 and improvement.layout.axes == WRENCH


def test_it_stops_when_told(shipped: Layouts) -> None:
    reports: list[Progress] = []
    improvement = optimize_layout(
        shipped("A"),
        ["front_right"],
        rounds=50,
        progress=reports.append,
        cancelled=lambda: len(reports) >= 1,
    )
    assert improvement.cancelled
    assert len(reports) == 1


def test_it_stops_within_a_round(shipped: Layouts) -> None:
    layout = shipped("A")
    reports = list[int]()

    def rule(position: Array, frames: Array) -> Array:
        reports.append(len(position))
        return np.zeros(len(position))

    improvement = optimize_layout(layout, layout.names, rule=rule, cancelled=lambda: bool(reports))
    assert reports == [1, 1, 1], "where it begins, and the layouts before and after"
    assert improvement.cancelled and improvement.value_after >= improvement.value_before


def test_nothing_better_leaves_the_layout_as_it_was(shipped: Layouts) -> None:
    layout = shipped("B")
    x, y, z = layout.fins[0].position
    angle = layout.fins[0].mounting_angle
    inwards = Bounds(
        x=(x, x), y=(y, y + 0.05), z=(z, z), mounting_angle=(angle, angle)
    )  # shorter levers only
    improvement = optimize_layout(
        layout, layout.names[:1], {layout.names[0]: inwards}, rounds=1, mirror=()
    )
    assert improvement.value_after == improvement.value_before
    assert not improvement.improved
    assert improvement.layout is layout


def test_fins_keep_their_distance(shipped: Layouts, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("finlab.analysis.climb.CLEARANCE", 0.2)
    layout = shipped("A")
    box = Bounds((-0.26, 0.26), (0.14, 0.16), (0.0, 0.0), (1.0, 1.1))
    improvement = optimize_layout(
        layout, ["front_left"], {"front_left": box}, "mission_power", (), rounds=1
    )
    positions = improvement.layout.position
    assert (
        np.linalg.norm(positions[1] - np.delete(positions, 1, axis=0), axis=1).min() >= 0.2 - 1e-9
    )


@pytest.mark.parametrize(
    ("name", "goal", "mission", "message"),
    [
        ("A", "beauty", [[1, 0, 0, 0, 0, 0]], "goal: expected one of weakest_direction"),
        ("D", "worst_single_failure", [[1, 0, 0, 0, 0, 0]], "needs 6 directions after a loss"),
        ("A", "mission_power", [[1, 2, 3]], "wrench: expected an array of shape"),
        (
            "A",
            "mission_power",
            [[1, 0, 0, 0, 0, float("inf")]],
            "wrench: Tz must be a number of at most",
        ),
    ],
)
def test_wrong_goals(shipped: Layouts, name: str, goal: str, mission: object, message: str) -> None:
    layout = shipped(name)
    with pytest.raises(FinlabError, match=message):
        optimize_layout(layout, layout.names[:1], goal=goal, mission=mission)


SEARCHES = {
    "bluerov2_heavy": (["lift_rear_right"], {}),
    "bluerov2": (["lift_left", "front_left"], {}),
    "torpedo": (
        ["elevator_left"],
        {"axes": ["surge", "roll", "pitch", "yaw"], "flow": [1.5, 0, 0, 0, 0, 0]},
    ),
    "catamaran": (["left", "bow"], {}),
    "fish": (["tail"], {}),
    "turtle_hybrid": (["lift_left", "front_left"], {}),
}
"""Shipped robot -> which of its actuators may move, and settings of the search."""


@pytest.mark.parametrize("name", sampled(SEARCHES, every=2))
def test_any_actuator_moves_within_bounds_and_keeps_the_mirror(shipped: Layouts, name: str) -> None:
    layout = shipped(name)
    names, settings = SEARCHES[name]
    actuators = [layout.actuators[layout.index(actuator)] for actuator in names]
    bounds = {actuator.name: Bounds.around(actuator, 0.04, 0.3) for actuator in actuators}
    improvement = optimize_layout(layout, names, bounds, rounds=4, seed=1, **settings)
    assert improvement.improved
    assert improvement.value_after > improvement.value_before
    assert set(mirror_pairs(layout)) <= set(mirror_pairs(improvement.layout))
    for before, after in zip(layout.actuators, improvement.layout.actuators, strict=True):
        if before.name not in improvement.moved:
            assert after == before
        assert np.abs(np.subtract(after.position, before.position)).max() <= 0.04 + 1e-12
        # The main axis turns by at most both angles together.
        assert np.dot(before.frame[0], after.frame[0]) >= np.cos(0.6) - 1e-9
    assert improvement.card_after.authority.rank >= improvement.card_before.authority.rank


def test_a_torpedo_at_rest_has_nothing_to_raise(shipped: Layouts) -> None:
    with pytest.raises(LayoutError, match="pushes along no axis alone"):
        optimize_layout(replace(shipped("torpedo"), axes=WRENCH), ["rudder_top"])


def test_the_mission_of_a_torpedo_counts_at_its_speed(shipped: Layouts) -> None:
    layout = replace(shipped("torpedo"), axes=("Fx", "Tx", "Ty", "Tz"))
    flow = [1.5, 0, 0, 0, 0, 0]
    rolled = [[5.0, 0.0, 0.0, 0.5, 0.0, 0.0]]
    damaged = layout.actuators[layout.index("elevator_left")]
    bounds = {damaged.name: Bounds.around(damaged, (0.0, 0.05, 0.0), 0.0)}
    improvement = optimize_layout(
        layout, [damaged.name], bounds, "mission_power", mission=rolled, flow=flow, rounds=1
    )
    assert improvement.improved
    after = least_power(improvement.layout, rolled, flow=flow)
    assert -improvement.value_after == pytest.approx(after[0])
    assert after[0] < least_power(layout, rolled, flow=flow)[0]


def test_what_a_robot_pushes_alone_is_not_given_for_the_weakest_direction(shipped: Layouts) -> None:
    damaged = shipped("bluerov2").without(["front_right"])
    improvement = optimize_layout(damaged, damaged.names, rounds=6)
    assert improvement.improved and improvement.axes == ("surge", "sway", "heave", "roll", "yaw")
    assert set(improvement.axes) <= set(improvement.card_after.authority.alone)


@pytest.mark.parametrize(("goal", "least"), [("weakest_direction", 112.0), ("mission_power", -1.2)])
def test_eight_thrusters_find_their_places(shipped: Layouts, goal: str, least: float) -> None:
    """The same arguments and seed give the same layout; what is proposed keeps its distance and its
    grid."""
    layout = shipped("bluerov2_heavy")
    grid = (0.001, np.radians(1.0))
    bounds = {
        actuator.name: Bounds.around(actuator, 0.05, np.pi / 2) for actuator in layout.actuators
    }
    reports: list[Progress] = []
    improvement = optimize_layout(
        layout, layout.names, bounds, goal, (), rounds=8, grid=grid, progress=reports.append
    )
    assert improvement.value_after >= least
    assert [one.round for one in reports] == list(range(1, len(reports) + 1))
    assert all(later.best >= one.best for one, later in zip(reports, reports[1:], strict=False))
    assert reports[-1].layout.names == layout.names and reports[-1].layout != layout
    again = optimize_layout(layout, layout.names, bounds, goal, (), rounds=8, grid=grid)
    assert again.layout == improvement.layout
    positions = improvement.layout.position
    assert np.abs(positions / grid[0] - np.round(positions / grid[0])).max() < 1e-6
    first, second = np.triu_indices(layout.n, k=1)
    gaps, before = (
        np.linalg.norm(p[first] - p[second], axis=1) for p in (positions, layout.position)
    )
    assert (gaps >= np.minimum(before, 0.1) - 1e-8).all()


def test_a_wall_without_slope_is_kept(shipped: Layouts) -> None:
    layout = shipped("bluerov2_heavy")
    inner = np.abs(layout.position[:, 1]).max() + 0.01

    def wall(position: Array, frames: Array) -> Array:
        return 0.02 * (np.abs(position[..., 1]) > inner).sum(-1)

    improvement, free = (
        optimize_layout(layout, layout.names, rounds=3, rule=rule) for rule in (wall, None)
    )
    assert np.abs(improvement.layout.position[:, 1]).max() <= inner
    assert np.abs(free.layout.position[:, 1]).max() > inner
    assert improvement.value_after > 1.1 * improvement.value_before
