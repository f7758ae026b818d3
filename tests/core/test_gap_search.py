"""The search for least power where sets have gaps: beside all forces of robots whose forces for a
wrench leave one number free, or two."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import null_space

from finlab.actuators.thrust_model import PowerLaw
from finlab.arrays import Array
from finlab.core.fields import Record
from finlab.layout import Layout, Thruster
from finlab.layout.load import parse_layout
from tests.core.internal_functions import Robot, dual_function, in_the_core, pods_either_way
from tests.core.test_set_gaps import has
from tests.random_robots import random_robot

POINTS = 801
"""Values of the number that is free."""
NEAR = 1e-3
"""Share by which points of a scan may cost more than the best forces between them."""
ARC_SLACK = 2e-4
"""By how much [rad] an answer may lie beyond the end of an arc."""
PLANAR = ("Fx", "Fy", "Tz")


def some_thrusters(count: int, seed: int) -> Layout:
    """Thrusters of a robot in a plane, each with a dead band."""
    rng = np.random.default_rng([count, seed])
    parts = []
    for k in range(count):
        angle = rng.uniform(-np.pi, np.pi)
        most = rng.uniform(20.0, 40.0)
        parts.append(
            Thruster(
                f"t{k}",
                (*rng.uniform(-0.5, 0.5, 2), 0.0),
                (np.cos(angle), np.sin(angle), 0.0),
                (-rng.uniform(0.5, 1.0) * most, most),
                PowerLaw(rng.uniform(0.2, 0.5), rng.uniform(0.2, 0.5)),
                dead_band=rng.uniform(0.05, 0.25) * most,
            )
        )
    return Layout("some", tuple(parts), axes=PLANAR)


def two_pods(seed: int) -> Layout:
    """Pods that push either way, in wide arcs, some with a dead band."""
    whole = pods_either_way(seed)
    return replace(whole, actuators=whole.actuators[1:3], axes=PLANAR)


def two_of(kind: str, seed: int) -> Layout:
    """The first two actuators of a random robot, in three axes that they drive."""
    whole = parse_layout(random_robot(kind, seed, 71))
    pair = replace(whole, actuators=whole.actuators[:2])
    for axes in (PLANAR, ("Fx", "Fz", "Ty"), ("Fy", "Fz", "Tx"), ("Fx", "Fy", "Fz")):
        layout = replace(pair, axes=axes)
        if np.linalg.matrix_rank(columns_of(in_the_core(layout)), tol=1e-6) == 3:
            return layout
    return pair


LAYOUTS = {
    "thrusters": lambda seed: some_thrusters(4, seed),
    "pods": two_pods,
    "wide arcs": lambda seed: two_of("wide arcs", seed),
    "holes": lambda seed: two_of("holes", seed),
}


def columns_of(robot: Robot) -> Array:
    """Scaled wrenches in the basis (6, k) of a newton along each row of each actuator."""
    rows = [
        robot.actuators["effectiveness_reduced"][i, row]
        for i in range(robot.n)
        for row in range(int(robot.actuators["rows"][i]))
    ]
    return np.array(rows).T


def powers_of(robot: Robot, force: Array, arc_slack: float = 1e-6) -> tuple[Array, Array]:
    """Power (K,) [W] of forces (K, n, 2), and which of them (K,) the sets have, to some rounding of
    their arcs [rad]."""
    power = np.zeros(len(force))
    is_given = np.ones(len(force), bool)
    for i in range(robot.n):
        limits = robot.whole_set(i)
        own = robot.actuators[i]
        size = np.hypot(*force[:, i].T)
        in_band = (size < own["dead_band"] * (1.0 - 1e-9)) & (size > 1e-6 * own["row_force_max"][0])
        for k, one in enumerate(force[:, i]):
            if not is_given[k]:
                continue
            is_given[k] = not in_band[k] and has(robot, i, limits, one, arc_slack)
            if is_given[k]:
                power[k] += power_of(robot, i, one)
    return power, is_given


def power_of(robot: Robot, i: int, force: Array) -> float:
    """Power [W] of a force (2,) of an actuator; of a plane that pushes either way by its side of
    the arc."""
    if not robot.is_plane(i):
        return robot.power(i, float(force[0]))
    angle = float(np.arctan2(force[1], force[0]))
    size = float(np.hypot(*force)) / robot.radius(i, angle)
    own = robot.actuators[i]
    off = abs((angle - own["sector_center"] + np.pi) % (2.0 * np.pi) - np.pi)
    ways = [1.0] if off <= own["sector_half_angle"] + 1e-6 else []
    if own["force_min"] < 0.0 and np.pi - off <= own["sector_half_angle"] + 1e-6:
        ways.append(-1.0)
    ends = {1.0: own["force_max"], -1.0: -own["force_min"]}
    ways = [way for way in ways if size <= ends[way] * (1.0 + 1e-6)] or [1.0]
    return min(robot.power(i, way * size) for way in ways)


def all_forces(robot: Robot, force: Array) -> Array:
    """Forces (K, n, 2) that give the same wrench as some (n, 2): dense, and where one rests or is at
    the edge of its dead band."""
    columns = columns_of(robot)
    (free,) = null_space(columns, rcond=1e-9).T
    first = np.concatenate([force[i, : int(robot.actuators["rows"][i])] for i in range(robot.n)])
    largest = robot.actuators["row_force_max"].max()
    size = np.linspace(-3.0, 3.0, POINTS) * largest / np.abs(free).max()
    special = list[float]()
    if len(first) == robot.n:  # of thrusters
        for edge in (0.0, 1.0, -1.0):
            special += list((edge * robot.actuators["dead_band"] - first) / free)
    flat = first + np.append(size, special)[:, None] * free
    made = np.zeros((len(flat), robot.n, 2))
    place = 0
    for i in range(robot.n):
        rows = int(robot.actuators["rows"][i])
        made[:, i, :rows] = flat[:, place : place + rows]
        place += rows
    made[np.abs(made) < 1e-9 * largest] = 0.0
    return made


def cases_of(name: str) -> Iterator[tuple[Robot, Array, Array, Record]]:
    """Robots, forces (n, 2) that they can give, their wrenches (6,), and the answers to these."""
    for seed in range(3):
        robot = in_the_core(LAYOUTS[name](seed))
        if np.linalg.matrix_rank(columns_of(robot), tol=1e-6) != 3:
            continue
        rng = np.random.default_rng([2, seed])
        for command in robot.plant.sample(rng, (3,)):
            force = np.zeros((robot.n, 2))
            for i in range(robot.n):
                law, _ = robot.force(i, np.ascontiguousarray(command[i]))
                rows = law[1:] if robot.is_plane(i) else law[:2]
                sign = 1.0 if robot.is_plane(i) else robot.actuators[i]["command_sign"]
                force[i] = sign * rows
            _, is_given = powers_of(robot, force[None])
            if not is_given[0]:  # within a dead band
                continue
            reduced = np.einsum("nr,nrj->j", force, robot.actuators["effectiveness_reduced"])
            wrench = robot.head["basis"] @ reduced * robot.head["axis_scale"]
            wrench += robot.head["wrench_offset"]
            yield robot, force, wrench, robot.answer(wrench)


@pytest.mark.parametrize("name", LAYOUTS)
def test_the_least_power_of_all_forces_is_found_and_proved(name: str) -> None:
    cases = 0
    for robot, known, wrench, answer in cases_of(name):
        found = answer["force"][: robot.n]
        assert answer["is_attainable"]
        # The forces give the wrench, and the sets have them.
        columns = robot.actuators["effectiveness_reduced"]
        given = np.einsum("nr,nrj->j", found - known, columns)
        np.testing.assert_allclose(given, 0.0, atol=1e-7)
        (own_power,), (is_given,) = powers_of(robot, found[None], ARC_SLACK)
        assert is_given
        power, is_given = powers_of(robot, all_forces(robot, known))
        known_power, _ = powers_of(robot, known[None])
        least = min(power[is_given].min(initial=np.inf), known_power[0])
        assert own_power <= least * (1.0 + NEAR)
        if not answer["is_truncated"]:
            # What gaps are proved to need is no more than any forces take; that, or the dual at
            # the answer's multipliers, is nearly as much.
            gap_bound = float(answer["gap_power_bound"])
            _, dual = dual_function(robot.block, wrench, answer["lambda_reduced"].copy())
            assert max(gap_bound, dual) <= own_power * (1.0 + 1e-6)
            assert max(gap_bound, dual) >= own_power * (1.0 - 2e-3)
        cases += 1
    assert cases >= 3


def forces_of_five(robot: Robot, force: Array) -> Array:
    """Forces (K, 5) of thrusters that give the same wrench as some (5,): dense, and along all lines
    and at all points where one or two of them rest or are at the edge of their dead bands."""
    free = null_space(columns_of(robot), rcond=1e-9)
    band = robot.actuators["dead_band"]
    edges = [(i, edge * band[i]) for i in range(5) for edge in (-1.0, 0.0, 1.0)]
    span = np.linspace(-2.0, 2.0, 121) * robot.actuators["row_force_max"].max()
    shares = [np.stack(np.meshgrid(span, span), axis=-1).reshape(-1, 2)]
    for k, (i, edge) in enumerate(edges):
        across = free[i] / (free[i] @ free[i])
        along = np.array([-free[i, 1], free[i, 0]]) / np.linalg.norm(free[i])
        shares.append(
            (edge - force[i]) * across + np.linspace(-1, 1, 801)[:, None] * span[-1] * along
        )
        for j, other in edges[k + 1 :]:
            if i != j:
                both = np.linalg.solve(free[[i, j]], [edge - force[i], other - force[j]])
                shares.append(both[None])
    made = force + np.concatenate(shares) @ free.T
    made[np.abs(made) < 1e-9 * span[-1]] = 0.0
    return np.asarray(made)


@pytest.mark.parametrize("seed", range(4))
def test_of_five_thrusters_near_their_dead_bands_the_cheapest_choice_is_found(seed: int) -> None:
    layout = some_thrusters(5, seed)
    robot = in_the_core(layout)
    own = robot.actuators
    rng = np.random.default_rng([3, seed])
    law = [actuator.model for actuator in layout.actuators]  # type: ignore[attr-defined]
    # Forces along the rows have the sign of their commands.
    ahead = np.array([one.forward for one in law])
    reverse = np.array([one.reverse for one in law])
    searched = 0
    for _ in range(8):
        share = rng.uniform(1.0, 1.6, 5) * rng.choice([-1.0, 0.0, 1.0], 5)
        force = np.clip(share * own["dead_band"], own["force_min"], own["force_max"])
        reduced = force @ own["effectiveness_reduced"][:, 0]
        wrench = robot.head["basis"] @ reduced * robot.head["axis_scale"]
        answer = robot.answer(wrench)
        found = answer["force"][:5, 0]
        np.testing.assert_allclose(columns_of(robot) @ (found - force), 0.0, atol=1e-7)
        tried = forces_of_five(robot, force)
        size = np.abs(tried)
        is_given = (tried >= own["force_min"] - 1e-9) & (tried <= own["force_max"] + 1e-9)
        is_given &= (size == 0.0) | (size >= own["dead_band"] * (1.0 - 1e-9))
        signed = own["command_sign"] * tried
        power = (np.where(signed > 0.0, ahead, reverse) * size**1.5).sum(axis=1)
        least = power[is_given.all(axis=1)].min()
        own_power = sum(robot.power(i, float(one)) for i, one in enumerate(found))
        assert own_power <= least * (1.0 + NEAR)
        assert not answer["is_truncated"]
        gap_bound = float(answer["gap_power_bound"])
        _, dual = dual_function(robot.block, wrench, answer["lambda_reduced"].copy())
        assert max(gap_bound, dual) <= min(own_power, least) * (1.0 + NEAR)
        assert max(gap_bound, dual) >= own_power * (1.0 - 2e-3)
        searched += dual < own_power * (1.0 - 2e-3)
    assert searched > 2
