"""Policy `falling`: an axis may be given less than was asked for, and never more. A second-order cone
program over the forces of thrusters and fins judges the answers."""

from itertools import product
from typing import Any

import clarabel
import numpy as np
import pytest
from scipy import sparse

from finlab import Allocator, Layout, Policy, load_layout
from finlab.allocation.policy import policy_from
from finlab.arrays import Array
from finlab.axes import AXES, mask_of
from finlab.errors import CommandError
from finlab.physics import plant_of

EXACT = 1e-6
"""By how much, over the wrench scale, an axis may be beyond its range."""
NEAREST = 5e-5
"""By how much a wrench may be from that of the cone program, over the wrench scale."""


def nearest_that_falls(layout: Layout, scale: Array, wrench: Array, falls: Array) -> Array:
    """The wrench (6,) nearest to another, over the wrench scale, that gives along the axes that fall
    between nothing and what was asked for; of thrusters within limits, and of fins that turn
    fully."""
    effectiveness = plant_of(layout).effectiveness
    columns: list[Array] = []
    cones: list[tuple[Array, Array, Any]] = []
    for i, actuator in enumerate(layout.actuators):
        first = len(columns)
        if actuator.type == "thruster":
            columns.append(effectiveness[i, 0] / scale)
            low, high = actuator.force
            rows = np.zeros((2, 64))
            rows[:, first] = 1.0, -1.0
            cones.append((rows, np.array([high, -low]), clarabel.NonnegativeConeT(2)))
            continue
        columns += [*(effectiveness[i, 1:] / scale)]  # across the shaft
        strongest = np.array(actuator.upper)
        command = np.zeros((layout.n, 3))
        command[i] = strongest
        most = float(np.linalg.norm(plant_of(layout).force(command)[i]))
        rows = np.zeros((3, 64))
        rows[1, first] = rows[2, first + 1] = -1.0
        cones.append((rows, np.array([most, 0.0, 0.0]), clarabel.SecondOrderConeT(3)))
    given = np.array(columns).T
    target = wrench / scale
    n = given.shape[1]
    for k in np.flatnonzero(falls):
        ends = np.sort([0.0, target[k]])
        rows = np.zeros((2, 64))
        rows[0, :n] = given[k]
        rows[1, :n] = -given[k]
        cones.append((rows, np.array([ends[1], -ends[0]]), clarabel.NonnegativeConeT(2)))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-10
    quadratic = sparse.csc_matrix(np.triu(given.T @ given) + 1e-12 * np.eye(n))
    rows, bounds, kinds = (list(part) for part in zip(*cones, strict=True))
    matrix = sparse.csc_matrix(np.vstack(rows)[:, :n])
    solver = clarabel.DefaultSolver(
        quadratic, -given.T @ target, matrix, np.concatenate(bounds), kinds, settings
    )
    return np.asarray(given @ np.array(solver.solve().x))


def beyond(target: Array, given: Array, falls: Array) -> float:
    """How far the axes that fall are beyond their ranges, over the wrench scale."""
    low = np.minimum(target, 0.0)
    high = np.maximum(target, 0.0)
    return float(np.maximum(low - given, given - high)[falls].max(initial=0.0))


def questions(seed: int, scale: Array, count: int) -> list[tuple[Array, tuple[str, ...]]]:
    """Random wrenches out of reach, some along few axes, and the axes that fall."""
    rng = np.random.default_rng(seed)
    found = []
    for k in range(count):
        wrench = rng.normal(size=6) * scale * rng.uniform(1.0, 6.0)
        wrench[rng.random(6) < 0.2] = 0.0
        chosen = rng.random(6) < 0.6
        falling = AXES if k % 2 == 0 else tuple(np.array(AXES)[chosen].tolist())
        found.append((wrench, falling))
    return found


@pytest.mark.parametrize("name", ["bluerov2_heavy", "A", "penta", "bluerov2"])
def test_the_wrench_is_the_nearest_that_falls(name: str) -> None:
    layout = load_layout(name)
    allocator = Allocator(layout)
    n_beyond = 0
    for wrench, falling in questions(len(name), allocator.scale, 40):
        answer = allocator.allocate(wrench, policy=Policy("falling", falling=falling))
        falls = mask_of(falling) & layout.commanded
        target = np.where(layout.commanded, wrench, 0.0) / allocator.scale
        given = np.where(layout.commanded, answer.wrench, 0.0) / allocator.scale
        if answer.reachable:
            continue
        n_beyond += 1
        assert beyond(target, given, falls) < EXACT
        if layout.commanded.all():
            nearest = nearest_that_falls(layout, allocator.scale, wrench, falls)
            own = np.linalg.norm(given - target)
            assert own <= np.linalg.norm(nearest - target) + NEAREST
    assert n_beyond > 20


def test_thrust_may_fall_and_not_rise_as_in_a_multicopter() -> None:
    """Roll beyond what thrust leaves room for: by `closest` thrust rises, here it does not."""
    layout = load_layout("bluerov2_heavy")
    allocator = Allocator(layout)
    wrench = np.array([0.0, 0.0, 60.0, 40.0, 0.0, 0.0])
    thrust_alone = Policy("falling", falling=("Fz",))
    answer = allocator.allocate(wrench, policy=thrust_alone)
    assert answer.wrench[2] <= 60.0 + 1e-6
    roll_first = allocator.allocate(wrench, policy=Policy("priority", order=(("Tx",), ("Fz",))))
    assert answer.wrench[3] <= roll_first.wrench[3] + 1e-6


def test_where_nothing_rises_it_is_the_closest_wrench() -> None:
    layout = load_layout("bluerov2_heavy")
    allocator = Allocator(layout)
    n_same = 0
    for wrench, _ in questions(3, allocator.scale, 300):
        closest = allocator.allocate(wrench)
        target = wrench / allocator.scale
        if beyond(target, closest.wrench / allocator.scale, np.ones(6, bool)) > 0.0:
            continue
        n_same += 1
        falling = allocator.allocate(wrench, policy="falling")
        np.testing.assert_allclose(falling.wrench, closest.wrench, atol=1e-6)
    assert n_same >= 3


@pytest.mark.parametrize(
    ("name", "lost"), [*product(["turtle_hybrid", "catamaran", "torpedo", "fish"], [(), (0,)])]
)
def test_no_axis_rises_whatever_the_robot(name: str, lost: tuple[int, ...]) -> None:
    layout = load_layout(name)
    allocator = Allocator(layout)
    names = [layout.names[i] for i in lost]
    flow = (-1.5, 0.0, 0.0, 0.0, 0.0, 0.0) if layout.flow_driven else None
    at_rest = allocator.allocate(np.zeros(6), lost=names, flow=flow)
    if not at_rest.reachable:
        return  # what the flow pushes cannot be held back
    for wrench, falling in questions(7, allocator.scale, 12):
        answer = allocator.allocate(
            wrench, lost=names, flow=flow, policy=Policy("falling", falling=falling)
        )
        falls = mask_of(falling) & layout.commanded
        target = wrench / allocator.scale
        # Commands of measured fins at their limits are exact to so much.
        assert beyond(target, answer.wrench / allocator.scale, falls) < 1e-5


def test_one_wrench_and_a_batch_are_answered_alike() -> None:
    allocator = Allocator(load_layout("bluerov2_heavy"))
    wrenches = np.array([wrench for wrench, _ in questions(5, allocator.scale, 20)])
    batch = allocator.allocate_batch(wrenches, policy="falling")
    singles = [allocator.allocate(wrench, policy="falling").command for wrench in wrenches]
    np.testing.assert_allclose(batch.command, singles, atol=1e-9)


def test_axes_that_are_none_are_refused() -> None:
    with pytest.raises(CommandError, match="falling: expected axes among"):
        Policy("falling", falling=("Fq",))  # type: ignore[arg-type]
    with pytest.raises(CommandError, match="falling: every axis may be named once"):
        Policy("falling", falling=("Fz", "Fz"))
    assert policy_from("falling", None, None, "Fz,Tx").falling == ("Fz", "Tx")
    assert policy_from("falling").falling == AXES
