"""Which choices of branches of foils' lifts are left out: none of which any command is cheaper."""

import ctypes

import numpy as np
import pytest

from finlab.arrays import Array
from tests.core.internal_functions import REAL, State, Work, at, functions
from tests.core.test_foil_lattice import FOILS, Laid, effectiveness, laid
from tests.core.test_foil_tangent import tangent_at

NUMBERS = (1, 3)
"""Robots whose rudders do not stall within their limits, of the second of which one is lost."""
SAMPLES = 400
"""Angles of a branch at which its worth is sampled."""


class Choices(ctypes.Structure):
    """What the dual tells of branches: `foil_choices`."""

    _fields_ = [
        ("dual_value", REAL),
        ("cost_of_use", REAL),
        ("regret", REAL * 4 * FOILS),
        ("known_branch", ctypes.c_int * FOILS),
        ("has_known", ctypes.c_int),
    ]


def choices_at(one: Laid, target: Array, multipliers: Array, cost_of_use: float) -> Choices:
    """What the dual of a target (6,) tells at multipliers (6,), both in the basis."""
    choices = Choices()
    block = at(one.robot.block)
    functions().fl_dual_start(block, one.work, at(target), at(multipliers))
    functions().fl_find_choices(
        block, one.work, ctypes.byref(one.lattice), REAL(cost_of_use), ctypes.byref(choices)
    )
    return choices


def multipliers_of(one: Laid, rng: np.random.Generator) -> Array:
    """Multipliers (6,) [W] of a size at which actuators push as much as they can, or less."""
    unit = rng.normal(size=6)
    largest = np.abs(effectiveness(one)[:, 0] @ unit).max()
    price = np.abs(one.robot.actuators["flow_speed"]).max()
    return np.asarray(unit * rng.choice([0.1, 0.5, 1.5]) * price / largest)


def branch_of(one: Laid, f: int, angle: float) -> int:
    """The branch on which a foil is at an angle [rad]."""
    inner = one.lattice.edge[f][1 : one.lattice.branches[f]]
    return int(np.searchsorted(inner, angle))


def index_of(one: Laid, branch: Array) -> int:
    """The index of a choice of one branch of each foil, by which the core counts them."""
    count = int(np.prod(one.lattice.branches[: one.lattice.foils]))
    for index in range(count):
        own = [
            functions().fl_branch_of_choice(ctypes.byref(one.lattice), index, f)
            for f in range(one.lattice.foils)
        ]
        if np.array_equal(own, branch):
            return index
    raise AssertionError(f"no choice has the branches {branch}")


@pytest.mark.parametrize("number", NUMBERS)
def test_a_regret_is_what_no_angle_of_the_branch_makes_up_for(number: int) -> None:
    one = laid(number)
    rng = np.random.default_rng([1, number])
    columns = effectiveness(one)
    for _ in range(6):
        multipliers = multipliers_of(one, rng)
        choices = choices_at(one, np.zeros(6), multipliers, 1e30)
        for f, i in enumerate(one.foil):
            prices = columns[i] @ multipliers
            worth = []
            for branch in range(one.lattice.branches[f]):
                low, high = one.lattice.edge[f][branch : branch + 2]
                tangents = [tangent_at(one.robot, i, a) for a in np.linspace(low, high, SAMPLES)]
                worth.append(max(prices @ t.force[:] - t.cost for t in tangents))
            regret = np.array(choices.regret[f][: len(worth)])
            largest = np.abs(worth).max() + np.abs(regret).max()
            # All branches together give what the set gives: one of them has no regret, but for the
            # chord of a foil whose drag is welcome.
            np.testing.assert_allclose(
                regret - regret.min(), max(worth) - np.array(worth), atol=2e-4 * largest
            )
            assert regret.min() >= -2e-4 * largest


def best_multipliers(one: Laid, target: Array) -> Array:
    """Multipliers (6,) [W] at which the dual of a target (6,) is largest, as far as the core comes
    to them."""
    block = at(one.robot.block)
    functions().fl_dual_newton(block, one.work, at(target), None, 60)
    work = Work.from_buffer(one.work)
    first = ctypes.addressof(work) + Work.state.offset
    index = (work.state_found - first) // ctypes.sizeof(State)
    return np.array(work.state[index].lambda_reduced)


@pytest.mark.parametrize("number", NUMBERS)
def test_a_choice_is_left_out_only_where_its_commands_cost_more_than_is_of_use(number: int) -> None:
    one = laid(number)
    robot = one.robot
    span = Work.from_buffer(one.work).span
    lost = np.array(span.is_lost)[: robot.n] == 1
    rng = np.random.default_rng([2, number])
    left_out = 0
    for command in robot.plant.sample(rng, (40,)):
        force = robot.plant.force(command)
        force[lost] = 0.0
        wrench = np.einsum("na,naw->w", force, robot.plant.effectiveness)
        target = one.target(wrench - np.array(span.wrench_offset))
        cost = float(robot.plant.power(command)[~lost].sum())
        branches = np.array([branch_of(one, f, command[i, 0]) for f, i in enumerate(one.foil)])
        index = index_of(one, branches)
        best = best_multipliers(one, target)
        for multipliers in (best, best * rng.uniform(0.5, 1.5, 6), multipliers_of(one, rng)):
            for share in (0.2, 0.5, 0.8, 0.999, 1.001):
                choices = choices_at(one, target, multipliers, share * cost)
                is_left = functions().fl_is_choice_left(
                    ctypes.byref(one.lattice), ctypes.byref(choices), index
                )
                left_out += not is_left
                # The core's grids are within 1e-3 of what the plant says a command costs.
                assert is_left or share < 1.0
    assert left_out > 10


def test_a_known_choice_is_left_out_and_any_branch_of_marked_foils_with_it() -> None:
    one = laid(1)
    rng = np.random.default_rng(3)
    command = np.zeros((256, 3))
    command[: one.robot.n] = one.robot.plant.sample(rng, (1,))[0]
    known = [branch_of(one, f, command[i, 0]) for f, i in enumerate(one.foil)]
    marked = np.zeros(256, np.uint8)
    lattice = ctypes.byref(one.lattice)
    for marked_foil in (None, 0):
        choices = choices_at(one, np.zeros(6), np.zeros(6), 1e30)
        if marked_foil is not None:
            marked[one.foil[marked_foil]] = 1
        functions().fl_leave_out_choice(
            lattice, at(command), ctypes.c_void_p(marked.ctypes.data), ctypes.byref(choices)
        )
        for index, choice in enumerate(one.choices()):
            own = [functions().fl_branch_of_choice(lattice, index, f) for f in range(len(known))]
            same = [own[f] == branch or f == marked_foil for f, branch in enumerate(known)]
            is_left = functions().fl_is_choice_left(lattice, ctypes.byref(choices), index)
            assert bool(is_left) is not all(same), choice
