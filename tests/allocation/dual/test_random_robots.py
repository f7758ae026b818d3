"""The default method on random robots of all kinds, against judges that were written apart from
it."""

import itertools
from functools import cache

import numpy as np
import pytest
from scipy.optimize import linprog, lsq_linear

import finlab
from finlab.allocation import Allocator, Policy
from finlab.arrays import Array
from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.layout import load_layout
from finlab.layout.load import parse_layout
from tests import random_robots
from tests.oracle_optima import conic_optimum, farthest, least_known, least_miss, lower_bound
from tests.oracle_plant import OraclePlant
from tests.sampled_cases import sampled

ERROR_LIMIT = 1e-3
"""Largest error of a wrench that counts as served, in units of the wrench scale."""


def relative_error(plant: OraclePlant, commands: Array, wrench: Array) -> float:
    """The error of commands, in units of the judge's wrench scale."""
    return float(np.linalg.norm((plant.wrench(commands) - wrench) / plant.scales))


def test_a_heavy_takes_the_watts_of_clarabel() -> None:
    plant = OraclePlant(random_robots.bluerov2_heavy())
    rng = np.random.default_rng(4)
    allocator = finlab.Allocator(random_robots.load(plant.layout))
    for _ in range(10):
        wrench = random_robots.within(plant, rng)
        commands = plant.commands_of(allocator.allocate(wrench))
        assert relative_error(plant, commands, wrench) <= 1e-6
        assert plant.excess(commands) == 0.0
        assert plant.power(commands) <= 1.00001 * conic_optimum(plant, wrench)[0]


def test_a_heavy_beyond_reach_keeps_the_direction_or_comes_nearest() -> None:
    plant = OraclePlant(random_robots.bluerov2_heavy())
    rng = np.random.default_rng(5)
    allocator = finlab.Allocator(random_robots.load(plant.layout))
    for times in (1.2, 2.0, 3.0):
        wrench = random_robots.beyond(plant, rng, times)
        along = plant.commands_of(allocator.allocate(wrench, policy="direction"))
        most = farthest(plant, wrench)
        assert relative_error(plant, along, most * wrench) <= 2e-3
        near = plant.commands_of(allocator.allocate(wrench))
        assert relative_error(plant, near, wrench) <= 1.0005 * least_miss(plant, wrench)


@pytest.mark.parametrize("number", sampled(range(3)))
@pytest.mark.parametrize("kind", random_robots.KINDS)
def test_exact_within_limits_at_the_least_watts(kind: str, number: int) -> None:
    plant = random_robots.random_plant(kind, number, 7)
    rng = np.random.default_rng(number)
    allocator = finlab.Allocator(random_robots.load(plant.layout))
    most = plant.power(np.array([each.limits[1] for each in plant.actuators]))
    for _ in range(2):
        wrench = random_robots.within(plant, rng)
        result = allocator.allocate(wrench, flow=plant.flow)
        commands = plant.commands_of(result)
        assert relative_error(plant, commands, wrench) <= ERROR_LIMIT
        assert plant.excess(commands) == 0.0
        watts = plant.power(commands)
        assert result.power == pytest.approx(watts, rel=1e-6)
        if kind == "rudders" or watts <= 1.001 * lower_bound(plant, wrench):
            continue
        best = least_known(plant, wrench, 4)
        assert best is None or watts <= 1.01 * best + 1e-4 * most


@pytest.mark.parametrize("kind", ["thrusters", "azimuths", "fins", "mixed"])
def test_a_random_robot_beyond_reach_keeps_the_direction(kind: str) -> None:
    plant = random_robots.random_plant(kind, 3, 7)
    rng = np.random.default_rng(0)
    allocator = finlab.Allocator(random_robots.load(plant.layout))
    for times in (1.2, 3.0):
        wrench = random_robots.beyond(plant, rng, times)
        commands = plant.commands_of(allocator.allocate(wrench, policy="direction"))
        assert relative_error(plant, commands, wrench / times) <= 2e-3


def test_fins_of_mixed_laws_have_no_dear_answers() -> None:
    for number in range(4):
        plant = OraclePlant(random_robots.fins_with_a_tail(number, 3))
        rng = np.random.default_rng(number)
        wrench = random_robots.within(plant, rng)
        commands = plant.commands_of(
            finlab.Allocator(random_robots.load(plant.layout)).allocate(wrench)
        )
        assert relative_error(plant, commands, wrench) <= ERROR_LIMIT
        assert plant.power(commands) <= 1.01 * lower_bound(plant, wrench)


@pytest.mark.parametrize("period", [0.02, 0.2])
@pytest.mark.parametrize("kind", ["thrusters", "azimuths", "fins", "mixed"])
def test_ticks_of_a_wandering_wrench(kind: str, period: float) -> None:
    """No limit and no rate is broken, and an answer that misses is the nearest, or the farthest in
    its direction, among those that may follow."""
    plant = OraclePlant(random_robots.with_rates(random_robots.random_robot(kind, 1, 7)))
    rng = np.random.default_rng(1)
    allocator = finlab.Allocator(random_robots.load(plant.layout), period_s=period)
    first = random_robots.within(plant, rng)
    last = random_robots.within(plant, rng)
    before: Array | None = None
    for share in np.linspace(0.0, 1.0, 6):
        wrench = (1.0 - share) * first + share * last
        options = {} if before is None else {"previous": before}
        commands = plant.commands_of(allocator.allocate(wrench, **options))
        assert plant.excess(commands) == 0.0
        if before is not None:
            assert plant.rate_excess(before, commands, period) <= 1e-9
            error = relative_error(plant, commands, wrench)
            near = plant.after(before, period)
            if error > ERROR_LIMIT and error > least_miss(near, wrench, 33) + 2e-3:
                most = min(farthest(near, wrench, 33), 1.0)
                assert relative_error(plant, commands, most * wrench) <= 1e-2 * np.linalg.norm(
                    wrench / plant.scales
                )
        before = commands


ROBOT_NUMBERS = range(24)
"""Numbers of the random robots."""
THRUST_LAW = {"type": "power_law", "forward": 1.0, "reverse": 1.5, "exponent": 1.5}
"""Power over force of the thrusters made by hand, as a layout file says it."""


@cache
def _robot(number: int) -> tuple[Allocator, Array, Array, Array]:
    """A robot of 2 to 12 thrusters, its effectiveness matrix (6, n), and the ends of its forces
    (n,)."""
    rng = np.random.default_rng([0xBE40, number])
    parts = []
    columns = []
    ends = []
    for k in range(rng.integers(2, 13)):
        axis = np.eye(3)[rng.integers(3)] if rng.random() < 0.4 else rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        position = rng.uniform(-0.5, 0.5, 3)
        turn = float(rng.choice([0.0, 0.02]))
        ends.append([-float(rng.choice([0.0, 10.0, 40.0])), float(rng.uniform(1.0, 60.0))])
        columns.append([*axis, *(np.cross(position, axis) + turn * axis)])
        parts.append(
            {
                "name": f"m{k}",
                "type": "thruster",
                "position_m": position.tolist(),
                "axis": axis.tolist(),
            }
            | {"force_n": ends[-1], "torque_per_newton_m": turn}
            | {"model": THRUST_LAW}
        )
    allocator = Allocator(parse_layout(random_robots.layout_of(f"r{number}", parts)))
    return allocator, np.array(columns).T, *np.array(ends).T


def _targets(number: int, allocator: Allocator, by: Array, low: Array, high: Array) -> Array:
    """Wrenches (4, 6) near and far beyond the reach of a robot, half of them along what it can
    push."""
    rng = np.random.default_rng([0xBE41, number])
    some = rng.normal(size=(2, 6)) * allocator.scale
    own = (low + rng.random((2, len(low))) * (high - low)) @ by.T
    return np.concatenate([some, own]) * 10.0 ** rng.uniform(0.0, 1.5, (4, 1))


@pytest.mark.parametrize("number", ROBOT_NUMBERS)
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


@pytest.mark.parametrize("number", ROBOT_NUMBERS)
def test_closest_and_the_first_group_miss_no_more_than_least_squares(number: int) -> None:
    allocator, by, low, high = robot = _robot(number)
    for target in _targets(number, *robot):
        for policy, rows in (
            (None, slice(None)),
            (Policy("priority", order=(("Fz",), ("Fx",))), [2]),
        ):
            answer = allocator.allocate(target, policy=policy or "closest")
            scaled = (by / allocator.scale[:, None])[rows]
            target_of_rows = (target / allocator.scale)[rows]
            best = lsq_linear(scaled, target_of_rows, (low, high), method="bvls", tol=1e-14)
            least = np.linalg.norm(scaled @ best.x - target_of_rows)
            assert np.linalg.norm((answer.unallocated / allocator.scale)[rows]) <= least + 1e-5


@pytest.mark.parametrize("policy", ["closest", "direction", "priority"])
def test_one_code_one_answer_whose_bound_is_below_its_power(policy: str) -> None:
    for number in ROBOT_NUMBERS:
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
    band = {
        "name": "t",
        "type": "thruster",
        "force_n": [-40.0, 50.0],
        "model": THRUST_LAW,
        "dead_band_n": 3.0,
    }
    for number in range(12):
        parts = []
        for k in range(6):
            axis = rng.normal(size=3)
            axis /= np.linalg.norm(axis)
            parts.append(
                band
                | {
                    "name": f"t{k}",
                    "axis": axis.tolist(),
                    "position_m": rng.uniform(-1, 1, 3).tolist(),
                }
            )
        allocator = Allocator(parse_layout(random_robots.layout_of(f"b{number}", parts)))
        targets = rng.normal(size=(20, 6)) * allocator.scale * 10.0 ** rng.uniform(-2, 1, (20, 1))
        for policy, target in itertools.product(("closest", "direction", "priority"), targets):
            force = allocator.allocate(target, policy=policy).command[:, 0]
            assert not ((np.abs(force) < 3.0 * (1.0 - 1e-9)) & (force != 0.0)).any(), force


@pytest.mark.parametrize("name", sorted(shipped_layouts()))
def test_no_question_of_a_shipped_layout_ends_in_a_foreign_exception(name: str) -> None:
    layout = load_layout(name)
    rng = np.random.default_rng(11)
    allocator = Allocator(layout)
    losses: list[tuple[str, ...]] = [(), layout.names[:1], layout.names[2:]]
    for lost, policy in itertools.product(losses, ("closest", "direction", "priority")):
        target = rng.normal(size=6) * allocator.scale * 10.0 ** rng.uniform(-1, 2)
        try:
            answer = allocator.allocate(target, lost=lost, policy=policy)
        except FinlabError:
            continue
        assert np.isfinite(answer.err_norm)
        assert answer.bound is None or answer.bound <= answer.power
