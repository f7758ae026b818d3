"""The pseudo-inverse of forces: of least size among those that give a wrench, turned into commands
whose forces are the nearest within each arc."""

import math
from dataclasses import replace

import numpy as np
import pytest

from finlab import Allocator, load_layout
from finlab.actuators.thrust_model import PowerLaw
from finlab.allocation.baselines.pseudo_inverse import PseudoInverse, pushed_axes
from finlab.arrays import Array
from finlab.layout import Azimuth, Fin, Layout, Limits, Thruster
from finlab.layout.load import parse_layout
from finlab.physics import plant_of
from finlab.physics.objective import wrench_scale_of
from tests.random_robots import random_flow, random_robot

ROBOTS = ("thrusters", "azimuths", "fins", "fins uneven", "wide arcs", "rudders", "mixed")
ORIGIN = (0.0, 0.0, 0.0)


def inverse_of(name: str, number: int = 1) -> PseudoInverse:
    """The pseudo-inverse of a random robot of a kind, in its flow."""
    layout = parse_layout(random_robot(name, number, 71))
    plant = plant_of(layout).at(random_flow(name, number, 71))
    return PseudoInverse(plant, 0.1 * wrench_scale_of(layout))


@pytest.mark.parametrize("name", ROBOTS)
def test_the_largest_force_is_that_of_all_commands(name: str) -> None:
    inverse = inverse_of(name)
    plant = inverse.plant
    share = np.random.default_rng(1).random((4000, plant.n, 3))
    share[:2000] = np.round(share[:2000])
    size = np.linalg.norm(plant.force(plant.lower + share * plant.width), axis=-1).max(axis=0)
    for i, actuator in enumerate(plant.layout.actuators):
        if not actuator.KIND.driven_by_flow:  # of foils it is the lift alone
            assert inverse.largest[i] == pytest.approx(size[i], rel=0.03)


@pytest.mark.parametrize("name", ["thrusters", "azimuths", "fins", "mixed"])
def test_forces_give_the_wrench_and_are_the_least_of_all_that_do(name: str) -> None:
    """Over their largest ones, squares summed: no direction that gives no wrench is in them."""
    inverse = inverse_of(name)
    rng = np.random.default_rng(2)
    columns = np.repeat(inverse.largest, 2)
    targets = inverse.wrench_offset + rng.normal(size=(5, 2 * inverse.plant.n)) * columns @ (
        inverse.effectiveness.T
    )
    force = inverse.force(targets).reshape(5, -1)
    given = inverse.wrench_offset + force @ inverse.effectiveness.T
    scale = wrench_scale_of(inverse.plant.layout)
    np.testing.assert_allclose(given / scale, targets / scale, atol=1e-9)
    _, size, directions = np.linalg.svd(inverse.effectiveness * columns)
    idle = directions[int((size > 1e-9 * size[0]).sum()) :]
    np.testing.assert_allclose(force / columns @ idle.T, 0.0, atol=1e-9)


@pytest.mark.parametrize("half_angle", [0.0, 0.4, 1.2, 2.5, math.pi])
def test_a_force_outside_of_its_arc_is_projected_on_the_nearer_end(half_angle: float) -> None:
    center = 0.7
    arc = (center - half_angle, center + half_angle)
    model = PowerLaw(1.0)
    pod = Azimuth("pod", ORIGIN, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 40.0), model, arc)
    layout = Layout("pod", (pod,), axes=("Fx", "Fy"))
    inverse = PseudoInverse(plant_of(layout), wrench_scale_of(layout))
    rng = np.random.default_rng(3)
    for _ in range(40):
        angle = rng.uniform(-math.pi, math.pi)
        size = rng.uniform(1.0, 60.0)
        wanted = size * np.array([math.cos(angle), math.sin(angle)])
        command = inverse.command_of(wanted[None, None])
        force = plant_of(layout).wrench(command)[0, :2]
        off = math.remainder(angle - center, 2.0 * math.pi)
        nearest = center + np.clip(off, -half_angle, half_angle)
        along = np.array([math.cos(nearest), math.sin(nearest)])
        expected = min(max(wanted @ along, 0.0), 40.0) * along
        np.testing.assert_allclose(force, expected, atol=0.02)


def test_what_is_fixed_is_made_up_for() -> None:
    """A thruster that hangs at a force pushes whatever is asked: the others give the remainder."""
    layout = load_layout("bluerov2_heavy")
    hangs = replace(layout.actuators[0], force=(10.0, 10.0), hangs=True)
    fixed = replace(layout, actuators=(hangs, *layout.actuators[1:]))
    inverse = PseudoInverse(plant_of(fixed), wrench_scale_of(layout))
    np.testing.assert_array_equal(inverse.is_fixed, np.arange(layout.n) == 0)
    rest = plant_of(fixed).lower.copy()
    np.testing.assert_allclose(
        inverse.wrench_offset, plant_of(layout).wrench(np.where(np.arange(8)[:, None], 0.0, rest))
    )
    target = np.array([20.0, 5.0, -10.0, 0.0, 0.0, 1.0])
    given = plant_of(fixed).wrench(Allocator(fixed, "analytic").allocate(target).command)
    np.testing.assert_allclose(given, target, atol=0.02)


@pytest.mark.parametrize("rank", [1, 3, 6])
def test_the_directions_in_which_columns_push_are_those_of_their_range(rank: int) -> None:
    rng = np.random.default_rng(rank)
    columns = rng.normal(size=(6, rank)) @ rng.normal(size=(rank, 9))
    columns[:, -1] += 1e-9 * rng.normal(size=6)  # a trace is no direction
    axes = pushed_axes(columns)
    assert axes.shape == (rank, 6)
    np.testing.assert_allclose(axes @ axes.T, np.eye(rank), atol=1e-12)
    np.testing.assert_allclose(axes.T @ (axes @ columns), columns, atol=1e-7)


def two_fins(frequency: tuple[float, float]) -> Layout:
    """Fins of which the second one beats within narrower limits."""
    return Layout(
        "two",
        (
            Fin("first", (0.0, 0.2, 0.0), math.pi / 2),
            Fin("second", (0.0, -0.2, 0.0), -math.pi / 2, Limits((0.05, 0.6), frequency)),
        ),
    )


@pytest.mark.parametrize(
    ("limits", "beats"), [((0.1, 1.5), 1.5), ((2.0, 2.1), 2.0), ((0.1, 2.1), 1.8)]
)
def test_on_board_each_fin_beats_as_near_to_the_frequency_as_it_may(
    limits: tuple[float, float], beats: float
) -> None:
    allocator = Allocator(two_fins(limits), "fixed_frequency", frequency=1.8)
    # The first pushes back and the second ahead: each gives half of the torque.
    command = allocator.allocate([0.0, 0.0, 0.0, 0.0, 0.0, 0.3]).command
    np.testing.assert_allclose(command[:, 1], [1.8, beats])


def test_on_board_a_fin_stops_that_is_asked_for_less_than_its_least_amplitude_gives() -> None:
    allocator = Allocator(load_layout("A"), "fixed_frequency")
    inverse = allocator._whole.method._inverse  # type: ignore[attr-defined]
    lower: Array = allocator.layout.lower
    stopped = 0
    rng = np.random.default_rng(5)
    for size in 10.0 ** rng.uniform(-3.0, 0.5, 20):
        target = size * rng.normal(size=6) * [1.0, 1.0, 1.0, 0.2, 0.2, 0.2]
        force = np.linalg.norm(inverse.force(target[None])[0], axis=-1)
        least = 4.73741 * (2.1 * np.sin(lower[:, 0])) ** 2
        command = allocator.allocate(target).command
        stops = force < least
        np.testing.assert_allclose(command[stops, :2], lower[stops, :2])
        np.testing.assert_allclose(command[~stops, 1], 2.1)
        assert (command[~stops, 0] > lower[~stops, 0] - 1e-3).all()
        stopped += int(stops.sum())
    assert 5 < stopped < 75


def test_a_thruster_of_one_way_alone_counts_its_own_way() -> None:
    layout = Layout(
        "one",
        (
            Thruster("ahead", ORIGIN, (1.0, 0.0, 0.0), (0.0, 30.0), PowerLaw(1.0)),
            Thruster("both", ORIGIN, (0.0, 1.0, 0.0), (-50.0, 20.0), PowerLaw(1.0, 1.0)),
        ),
    )
    inverse = PseudoInverse(plant_of(layout), wrench_scale_of(layout))
    np.testing.assert_allclose(inverse.largest, [30.0, 50.0])
