"""Robots with rudders that move: exact with the drag, and cheapest with its price."""

import math

import numpy as np
import pytest

import finlab
from finlab import Allocator
from finlab.actuators.rudder import Rudder
from finlab.actuators.thrust_model import PowerLaw
from finlab.allocation.dual.compiled import Compiled
from finlab.layout import Actuator, Thruster, load_layout
from finlab.layout.layout import Layout
from finlab.physics.plant import Plant
from tests.random_robots import load, random_flow, random_plant, random_robot, within


def test_answers_of_robots_with_rudders_are_exact_and_above_a_bound_that_is_met() -> None:
    gaps = []
    for number in (0, 2, 5):
        robot = load(random_robot("rudders", number, 7))
        flow = random_flow("rudders", number, 7)
        oracle = random_plant("rudders", number, 7)
        allocator = finlab.Allocator(robot)
        rng = np.random.default_rng(number)
        for _ in range(4):
            wrench = within(oracle, rng)
            answer = allocator.allocate(wrench, flow=flow)
            assert answer.err_norm <= 1e-6
            np.testing.assert_allclose(
                Plant(robot).wrench(answer.command, flow=flow), wrench, atol=1e-4
            )
            assert answer.bound is not None
            gaps.append(1.0 - answer.bound / answer.power)
    assert min(gaps) > -1e-5
    assert np.median(gaps) < 1e-3


def test_rudders_alone_give_nothing_at_rest_and_something_in_a_flow() -> None:
    rudder = Rudder("r", (-0.5, 0, 0), (0, 0, 1), (1, 0, 0), 0.01, (-0.3, 0.3), 2.0, lift_slope=3.0)
    allocator = finlab.Allocator(Layout("rudder", (rudder,)))
    rest = allocator.allocate([0, 1, 0, 0, 0, -0.5])
    assert not rest.wrench.any() and rest.power == 0.0
    moving = allocator.allocate([0, 1, 0, 0, 0, -0.5], flow=[1.5, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(moving.wrench[[1, 5]], [1, -0.5], rtol=0.05)


def test_rudders_at_rest_turn_back_no_faster_than_their_drives() -> None:
    rudder = Rudder(
        "r", (-0.5, 0, 0), (0, 0, 1), (1, 0, 0), 0.01, (-0.3, 0.3), 2.0, lift_slope=3.0, rate=0.5
    )
    result = finlab.Allocator(Layout("rudder", (rudder,))).allocate(
        [0, 1, 0, 0, 0, -0.5], previous=[[0.3, 0.0, 0.0]]
    )
    assert 0.25 - 1e-12 <= result.command[0, 0] <= 0.3


def test_many_wrenches_at_once_are_answered_as_one_by_one() -> None:
    robot = load(random_robot("rudders", 1, 7))
    flow = random_flow("rudders", 1, 7)
    oracle = random_plant("rudders", 1, 7)
    rng = np.random.default_rng(0)
    wrenches = np.array([within(oracle, rng) for _ in range(3)])
    allocator = finlab.Allocator(robot)
    together = allocator.allocate_batch(wrenches, flow=flow)
    alone = [allocator.allocate(wrench, flow=flow).power for wrench in wrenches]
    np.testing.assert_allclose(together.power, alone, rtol=1e-9)


FLOW_FROM_AHEAD = np.array([1.5, 0.0, 0.0, 0.0, 0.0, 0.0])
"""Flow of a robot that moves straight ahead: (6,) [m/s, rad/s]."""


def frame_of_foils(rng: np.random.Generator) -> Layout:
    """Two to four foils whose shafts lie across the way ahead, and two or three thrusters."""
    parts: list[Actuator] = []
    for i in range(rng.integers(2, 5)):
        turn = rng.uniform(0.0, 2.0 * math.pi)
        most = rng.uniform(0.3, 0.7)
        position = tuple(rng.uniform(-1.0, 1.0, 3))
        shaft = (0.0, math.cos(turn), math.sin(turn))
        stall = rng.uniform(0.35, 0.6)
        area = 10.0 ** rng.uniform(-2.3, -1.0)
        foil = Rudder(
            f"f{i}",
            position,
            shaft,
            (1, 0, 0),
            area,
            (-most, most),
            rng.uniform(1.0, 6.0),
            stall=stall,
        )
        parts.append(foil)
    for i in range(rng.integers(2, 4)):
        axis = rng.normal(size=3) if rng.random() < 0.5 else np.array([1.0, 0.0, 0.0])
        axis = axis / np.linalg.norm(axis)
        position = tuple(rng.uniform(-1.0, 1.0, 3))
        parts.append(Thruster(f"t{i}", position, tuple(axis), (-40.0, 50.0), PowerLaw(1.0)))
    return Layout("foils", tuple(parts))


def at_work(layout: Layout, plant: Plant, rng: np.random.Generator) -> np.ndarray:
    """A uniform command (n, 3) whose foils do not stall."""
    command = plant.sample(rng, ())
    for i, part in enumerate(layout.actuators):
        if isinstance(part, Rudder):
            command[i, 0] = np.clip(command[i, 0], -0.8 * part.stall, 0.8 * part.stall)
    return command


@pytest.mark.parametrize("seed", range(8))
def test_what_foils_at_work_give_is_found_at_no_more_power(seed: int) -> None:
    rng = np.random.default_rng(seed)
    layout = frame_of_foils(rng)
    allocator = Allocator(layout)
    plant = Plant(layout)
    for _ in range(5):
        command = at_work(layout, plant, rng)
        wrench = plant.wrench(command, flow=FLOW_FROM_AHEAD)
        answer = allocator.allocate(wrench, flow=FLOW_FROM_AHEAD)
        assert answer.reachable and answer.err_norm <= 1e-6
        np.testing.assert_allclose(
            plant.wrench(answer.command, flow=FLOW_FROM_AHEAD), wrench, atol=1e-4
        )
        assert answer.power <= 1.01 * plant.power(command, flow=FLOW_FROM_AHEAD).sum()
        assert answer.bound is not None and answer.bound <= answer.power


@pytest.mark.parametrize("number", range(3))
def test_a_direction_is_kept_with_the_drag_at_rest_and_beats_a_share_that_is_known(
    number: int,
) -> None:
    layout = load(random_robot("rudders", number, 21))
    flow = random_flow("rudders", number, 21)
    allocator = Allocator(layout)
    plant = Plant(layout)
    rng = np.random.default_rng(number)
    for _ in range(4):
        wrench = plant.wrench(plant.sample(rng, ()), flow=flow)
        for times in (1.5, 4.0):
            answer = allocator.allocate(times * wrench, policy="direction", flow=flow)
            ray_share = answer.wrench @ wrench / (wrench @ wrench)
            np.testing.assert_allclose(
                answer.wrench, ray_share * wrench, atol=1e-6 * np.abs(wrench).max()
            )
            assert ray_share >= 1.0 - 1e-3


@pytest.mark.parametrize("policy", ["closest", "direction", "priority"])
def test_a_torpedo_that_loses_actuators_has_an_answer_and_a_bound_below_it(policy: str) -> None:
    layout = load_layout("torpedo")
    allocator = Allocator(layout)
    rng = np.random.default_rng(3)
    names = [part.name for part in layout.actuators]
    for lost in [(), *[(name,) for name in names], tuple(names[:-1]), tuple(names[1:])]:
        for flow in (None, FLOW_FROM_AHEAD):
            target = rng.normal(size=6) * [60.0, 20.0, 20.0, 5.0, 20.0, 20.0]
            previous = Plant(layout).sample(rng, ()) if rng.random() < 0.5 else None
            answer = allocator.allocate(
                target, policy=policy, lost=lost, flow=flow, previous=previous
            )
            assert np.isfinite(answer.power)
            assert answer.bound is None or answer.bound <= answer.power + 1e-9


def test_a_foil_whose_drag_is_welcome_answers_with_the_dearest_lift() -> None:
    """Power counts U newtons of drag; where each is paid more, the conjugate is that of the law."""
    rudder = Rudder("r", (-0.5, 0, 0), (0, 0, 1), (1, 0, 0), 0.05, (-0.3, 0.3), 2.0)
    layout = Layout("rudder", (rudder,))
    plant = Plant(layout)
    compiled = Compiled.of(layout).at(plant.at(FLOW_FROM_AHEAD).inflow(None))
    group = compiled.groups[0][1]
    deflections = np.linspace(-0.3, 0.3, 20_001)[:, None, None] * [1.0, 0.0, 0.0]
    wrenches = plant.wrench(deflections, flow=FLOW_FROM_AHEAD)
    power = plant.power(deflections, flow=FLOW_FROM_AHEAD).sum(axis=-1)
    rest = plant.wrench(np.zeros((1, 3)), flow=FLOW_FROM_AHEAD)
    for price in np.random.default_rng(0).normal(size=(40, 6)) * [6.0, 2.0, 2.0, 2.0, 2.0, 2.0]:
        net_value = ((wrenches - rest) @ price - power).max()
        assert group.conjugate_bound(price[None])[0, 0] == pytest.approx(
            net_value, rel=1e-6, abs=1e-6
        )
