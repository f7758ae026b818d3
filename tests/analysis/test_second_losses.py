"""Fatal pairs of losses, judged by ranks and linear programs of the wrenches per newton."""

import json
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy.optimize import linprog

from finlab.analysis import second_losses
from finlab.analysis.second_losses import MAX_PAIRED, pair_blocks
from finlab.axes import MOTIONS
from finlab.cli import main
from finlab.display import text
from finlab.errors import LayoutError
from finlab.layout import Layout, load_layout

LEAST_N = 1e-3
"""Wrench from which on an axis counts as reachable [N, N m]."""


def columns_of(robot: Layout) -> np.ndarray:
    """Wrench (6, n) of each thruster per newton, by its place and axis."""
    parts = robot.actuators
    return np.array([[*p.axis, *np.cross(p.position, p.axis)] for p in parts]).T


def reachable(robot: Layout, lost: set[str]) -> set[str]:
    """Axes along which thrusters push both ways with nothing along the others, by linear
    programs."""
    columns = columns_of(robot)
    limits = [(0.0, 0.0) if p.name in lost else p.force for p in robot.actuators]
    found = set()
    for k, axis in enumerate(MOTIONS):
        others = np.delete(columns, k, axis=0)
        ends = []
        for sign in (1.0, -1.0):
            answer = linprog(-sign * columns[k], A_eq=others, b_eq=np.zeros(5), bounds=limits)
            ends.append(-answer.fun)
        if min(ends) > LEAST_N:
            found.add(axis)
    return found


def fatal(robot: Layout) -> dict[tuple[str, str], set[str]]:
    """Pairs of thrusters with the axes that only both losses take away."""
    after_one = {name: reachable(robot, {name}) for name in robot.names}
    pairs = {}
    for first, second in combinations(robot.names, 2):
        left = after_one[first] & after_one[second]
        taken = left - reachable(robot, {first, second})
        if taken:
            pairs[first, second] = taken
    return pairs


def found_in(robot: Layout) -> dict[tuple[str, str], set[str]]:
    """What `second_losses` finds, in the form of `fatal`."""
    return {(pair.first, pair.second): {*pair.lost} for pair in second_losses(robot)}


def test_twelve_pairs_of_the_heavy_are_fatal() -> None:
    robot = load_layout("bluerov2_heavy")
    assert len(second_losses(robot)) == 12
    assert found_in(robot) == fatal(robot)


@pytest.mark.parametrize("seed", range(4))
def test_pairs_of_random_robots_are_those_of_linear_programs(seed: int) -> None:
    """Six to eight thrusters, of which every second robot has some that push one way alone."""
    rng = np.random.default_rng(seed)
    heavy = load_layout("bluerov2_heavy")
    n = int(rng.integers(6, 9))
    parts = []
    for part in heavy.actuators[:n]:
        axis = rng.normal(size=3)
        is_one_way = seed % 2 == 1 and rng.random() < 0.3
        moved = replace(
            part,
            axis=tuple(axis / np.linalg.norm(axis)),
            position=tuple(rng.uniform(-0.3, 0.3, 3)),
            force=(0.0, 40.0) if is_one_way else (-40.0, 40.0),
        )
        parts.append(moved)
    robot = replace(heavy, name="random", actuators=tuple(parts), body=None)
    assert found_in(robot) == fatal(robot)


def test_losses_that_are_there_count() -> None:
    robot = load_layout("bluerov2_heavy")
    name = robot.names[0]
    assert all(name not in (pair.first, pair.second) for pair in second_losses(robot, [name]))
    without = replace(robot, actuators=robot.actuators[1:])
    assert second_losses(robot, [name]) == second_losses(without)
    with pytest.raises(LayoutError, match="nobody"):
        second_losses(robot, ["nobody"])


def test_axes_that_a_robot_does_not_command_cannot_be_lost() -> None:
    robot = replace(load_layout("bluerov2_heavy"), axes=("Fx", "Fz", "Tz"))
    for pair in second_losses(robot):
        assert {*pair.lost} <= {"surge", "heave", "yaw"}


def test_large_robots_have_no_pairs_and_say_so() -> None:
    robot = load_layout("bluerov2_heavy")
    parts = tuple(
        replace(robot.actuators[k % 8], name=f"thruster_{k}") for k in range(MAX_PAIRED + 1)
    )
    large = replace(robot, actuators=parts)
    assert second_losses(large) == ()
    assert "up to 64" in text(pair_blocks((), large.n))


def test_the_command_line_lists_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["layout", "show", "bluerov2_heavy"]) == 0
    said = capsys.readouterr().out
    assert "12 of 28" in said
    assert main(["layout", "show", "bluerov2_heavy", "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    assert len(values["second_losses"]) == 12
    assert values["second_losses"][0]["lost"] == ["sway", "yaw"]
