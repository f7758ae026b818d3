"""From tick to tick: with the previous command the fins turn little, and the wrench is still delivered."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.allocation.search.search_allocator import SearchAllocator
from finlab.allocation.search.turn_limits import TURNS, limit_turn, planar_force
from finlab.assets import shipped_layouts
from finlab.errors import CommandError
from finlab.forces.force_space import SETTLED
from finlab.layout import Layout, load_layout
from finlab.physics import Plant
from finlab.physics.objective import Name

TICKS = np.arange(200) * 0.1
"""20 s at 10 Hz."""
SLOW_PATH = np.array([0.98, 0.98, 1.4, 0.175, 0.175, 0.175])
"""Amplitudes of the path [N, N m], about 0.7 standard deviations of what random commands give."""
TARGET = [1.0, 0.5, 2.0, 0.0, 0.1, 0.1]


class Drive(NamedTuple):
    """Answers along a path."""

    command: np.ndarray
    """(T, n, 3)."""
    cost: np.ndarray
    """(T,), of the objective."""
    error: np.ndarray
    """(T,), by the plant."""

    @property
    def turns(self) -> np.ndarray:
        """What each fin turns from tick to tick (T - 1, n), the shorter way round [rad]."""
        return np.abs(difference(self.command[1:, :, 2], self.command[:-1, :, 2]))


def difference(new: np.ndarray, old: np.ndarray) -> np.ndarray:
    return (new - old + math.pi) % (2.0 * math.pi) - math.pi


def drive(method: SearchAllocator, layout: Layout, path: np.ndarray, *, steady: bool) -> Drive:
    previous, results = None, []
    for wrench in path:
        result = method.allocate(layout, wrench, previous=previous)
        previous = result.command if steady else None
        results.append(result)
    return Drive(
        np.array([result.command for result in results]),
        np.array([result.power if method.objective.name == "power" else result.energy for result in results]),
        np.array([result.err_norm for result in results]),
    )


def smooth_path(seed: int) -> np.ndarray:
    """Slow sines (T, 6) in all axes."""
    rng = np.random.default_rng(seed)
    return SLOW_PATH * np.sin(rng.uniform(0.15, 0.6, 6) * TICKS[:, None] + rng.uniform(0.0, 2.0 * math.pi, 6))


def limits(layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    return (
        layout.lower,
        layout.upper,
    )


@pytest.fixture(scope="module")
def penta() -> Layout:
    return load_layout(shipped_layouts()["penta"])


@pytest.fixture(scope="module", params=["power", "effort"])
def method(request: pytest.FixtureRequest) -> SearchAllocator:
    return load_allocator(objective=request.param)


@pytest.fixture(scope="module")
def free(method: SearchAllocator, penta: Layout) -> Drive:
    return drive(method, penta, smooth_path(0), steady=False)


@pytest.fixture(scope="module")
def steady(method: SearchAllocator, penta: Layout) -> Drive:
    return drive(method, penta, smooth_path(0), steady=True)


def test_fins_turn_much_less_far(method: SearchAllocator, free: Drive, steady: Drive) -> None:
    assert steady.turns.max() <= {"power": 0.3, "effort": 0.2}[method.objective.name] * free.turns.max()
    # Fins at rest turn ahead of need, so the turns need not add up to less; they are spread over the ticks.
    share = {"power": 0.75, "effort": 0.5}[method.objective.name]
    assert np.square(steady.turns).sum() < share * np.square(free.turns).sum()
    assert steady.turns.max() <= TURNS[1] + 1e-6
    assert (steady.turns.max(1) <= TURNS[0] + 1e-6).mean() > 0.95


@pytest.mark.parametrize(
    ("objective", "name"), [("power", "A"), ("power", "C"), ("effort", "A"), ("effort", "B")]
)
def test_fins_turn_before_their_force_passes_zero(objective: Name, name: str) -> None:
    """Free, their answers turn by up to half a circle from tick to tick."""
    layout = load_layout(shipped_layouts()[name])
    ride = drive(load_allocator(objective=objective), layout, 0.7 * smooth_path(3), steady=True)
    assert ride.turns.max() <= TURNS[1] + 1e-6
    assert ride.error.max() < 5e-3 and np.median(ride.error) < 1e-6


def test_the_path_is_still_tracked_at_about_the_same_cost(
    method: SearchAllocator, free: Drive, steady: Drive
) -> None:
    assert steady.error.max() < 1e-5 and free.error.max() < 1e-5
    assert steady.cost.mean() < {"power": 1.002, "effort": 1.05}[method.objective.name] * free.cost.mean()


@pytest.mark.parametrize("name", ["hexa", "octo"])
def test_many_fins_for_effort_track_at_about_the_same_cost(name: str) -> None:
    search, layout, path = load_allocator(objective="effort"), load_layout(name), smooth_path(0)[:100]
    free, steady = (drive(search, layout, path, steady=told) for told in (False, True))
    assert steady.error.max() < 1e-5
    assert steady.cost.mean() < 1.04 * free.cost.mean()


def test_commands_stay_inside_the_limits_across_the_seam(steady: Drive, penta: Layout) -> None:
    lower, upper = limits(penta)
    assert ((steady.command >= lower) & (steady.command <= upper)).all()
    jumps = np.abs(np.diff(steady.command[..., 2], axis=0)) > math.pi
    assert jumps.any()  # fins do pass the seam
    assert steady.turns[jumps].max() <= TURNS[1] + 1e-6


def test_a_fin_follows_a_turning_force_over_the_seam(search: SearchAllocator) -> None:
    layout = load_layout(shipped_layouts()["pair"])
    lower, upper = limits(layout)
    previous = None
    for angle in np.linspace(0.0, 4.0 * math.pi, 80):
        command = np.column_stack([np.full(2, 0.4), np.full(2, 1.5), np.full(2, angle)])
        command[:, 2] = difference(command[:, 2], np.zeros(2))
        result = search.allocate(layout, Plant(layout).wrench(command), previous=previous)
        assert result.err_norm < 1e-5
        assert ((result.command >= lower) & (result.command <= upper)).all()
        if previous is not None:
            assert np.abs(difference(result.command[:, 2], previous[:, 2])).max() < TURNS[0]
        previous = result.command


def test_arcs_are_kept(search: SearchAllocator) -> None:
    layout = load_layout(shipped_layouts()["restricted"])
    lower, upper = limits(layout)
    ride = drive(search, layout, smooth_path(1)[:60], steady=True)
    assert ((ride.command >= lower) & (ride.command <= upper)).all()


def test_a_previous_command_that_is_the_answer_stays(
    method: SearchAllocator, penta: Layout, free: Drive
) -> None:
    plant = Plant(penta)
    for tick in (0, 50, 120):
        before = free.command[tick]
        result = method.allocate(penta, smooth_path(0)[tick], previous=before)
        # The search ends where forces settle; asked again, the answer is the same.
        step = 2.0 * SETTLED[0] * method.pipeline.prepare(penta).planar.fins.maximum.max()
        np.testing.assert_allclose(result.fin_forces, plant.fin_forces(before), atol=step)
        again = method.allocate(penta, smooth_path(0)[tick], previous=result.command)
        np.testing.assert_allclose(again.fin_forces, result.fin_forces, atol=1e-3)
        cost = result.power if method.objective.name == "power" else result.energy
        assert cost < 1.005 * free.cost[tick]


def test_the_first_tick_knows_no_past(free: Drive, steady: Drive) -> None:
    np.testing.assert_array_equal(steady.command[0], free.command[0])


def test_what_nothing_is_known_of_is_free(search: SearchAllocator, penta: Layout) -> None:
    alone = search.allocate(penta, TARGET)
    unknown = search.allocate(penta, TARGET, previous=np.full((5, 3), np.nan))
    assert unknown.err_norm < 1e-5
    np.testing.assert_allclose(unknown.command, alone.command, rtol=1e-5)


def test_a_failed_fin_comes_back(search: SearchAllocator, penta: Layout) -> None:
    lost = search.allocate(penta, TARGET, failed=["port_back"])
    still = search.allocate(penta, TARGET, failed=["port_back"], previous=lost.command)
    assert np.isnan(still.command[2]).all() and np.isfinite(still.command[[0, 1, 3, 4]]).all()
    back = search.allocate(penta, TARGET, previous=lost.command)
    assert np.isfinite(back.command).all() and back.err_norm < 1e-5
    known = [0, 1, 3, 4]
    assert np.abs(difference(back.command[known, 2], lost.command[known, 2])).max() <= TURNS[0] + 1e-6


def test_a_target_that_needs_a_turn_gets_it(search: SearchAllocator, penta: Layout) -> None:
    target = np.array([0.0, 0.0, 12.0, 0.0, 0.0, 0.0])
    before = search.allocate(penta, target).command
    result = search.allocate(penta, -target, previous=before)
    assert result.err_norm < 1e-5
    assert np.abs(difference(result.command[:, 2], before[:, 2])).max() > 1.0


@pytest.mark.parametrize(
    ("previous", "sentence"),
    [
        (np.zeros((4, 3)), "previous: expected a command of shape (5, 3) for layout 'penta'"),
        (np.full((5, 3), np.inf), "previous: expected finite commands"),
        ("yesterday", "previous: expected a command of shape (5, 3)"),
    ],
)
def test_a_previous_that_is_no_command_is_refused(
    previous: object, sentence: str, search: SearchAllocator, penta: Layout
) -> None:
    with pytest.raises(CommandError) as caught:
        search.allocate(penta, TARGET, previous=previous)  # type: ignore[arg-type]
    assert sentence in str(caught.value)


def test_arcs_are_narrowed_around_where_the_fins_point(search: SearchAllocator) -> None:
    prepared = search.pipeline.prepare(load_layout(shipped_layouts()["restricted"]))
    previous = np.column_stack([np.full(4, 0.3), np.full(4, 1.0), [0.0, 1.6, np.nan, -0.6]])
    near = limit_turn(prepared, previous, np.zeros(4), 0.35)
    lower, upper = near.commands.lower[:, 2], near.commands.upper[:, 2]
    old_lower, old_upper = prepared.commands.lower[:, 2], prepared.commands.upper[:, 2]
    np.testing.assert_allclose(lower, [-0.35, old_lower[1], old_lower[2], -0.95])
    np.testing.assert_allclose(upper, [0.35, 1.95, old_upper[2], old_upper[3]])
    np.testing.assert_array_equal(near.commands.lower[:, :2], prepared.commands.lower[:, :2])
    for untouched in (np.full((4, 3), np.nan), previous):
        width = TURNS[-1] if untouched is previous else 0.1
        assert limit_turn(prepared, untouched, np.zeros(4), width) is prepared


def test_a_full_circle_that_starts_elsewhere_is_kept(search: SearchAllocator, penta: Layout) -> None:
    limits_of = replace(penta.fins[0].limits, zero_direction=(0.0, 2.0 * math.pi))
    turned = replace(penta, fins=tuple(replace(fin, limits=limits_of) for fin in penta.fins))
    previous = None
    for surge in (1.0, 0.5, -0.5, -1.0):
        result = search.allocate(turned, [surge, 0.3, 0.5, 0.0, 0.0, 0.1], previous=previous)
        previous = result.command
        assert ((previous[:, 2] >= 0.0) & (previous[:, 2] <= 2.0 * math.pi)).all()
        assert result.err_norm < 1e-5


def test_planar_forces_of_a_command(search: SearchAllocator, penta: Layout) -> None:
    command = np.tile([0.6, 2.1, 0.4], (5, 1))
    command[4] = np.nan
    force = planar_force(search.pipeline.prepare(penta), command)
    least, _ = limits(penta)
    command[4] = least[4]
    np.testing.assert_allclose(force.T, Plant(penta).forces(command)[:, 1:], rtol=1e-12)
    beyond = np.tile([9.0, 99.0, 0.4 + 2.0 * math.pi], (5, 1))
    strongest = planar_force(search.pipeline.prepare(penta), beyond)
    np.testing.assert_allclose(strongest, np.tile(force[:, :1], 5), rtol=1e-12)
