"""Robots of few actuators with foils: what they give is a curved sheet, met exactly, near the
stall, too."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from finlab import Allocator
from finlab.actuators.rudder import Rudder
from finlab.actuators.thrust_model import PowerLaw
from finlab.arrays import Array
from finlab.layout import Actuator, Thruster
from finlab.layout.layout import Layout
from finlab.physics.plant import Plant

FLOW = np.array([1.5, 0.1, 0.05, 0.0, 0.0, 0.0])
"""A velocity through the water [m/s, rad/s]."""
N_ROBOTS = 50
"""How many random robots there are in each test."""
N_WRENCHES = 4
"""How many wrenches are asked of each robot."""


def robot(rng: np.random.Generator, limit: float) -> Layout:
    """Two to four foils that turn by a limit [rad], shafts across the way ahead, and as many
    thrusters."""
    parts: list[Actuator] = []
    for i in range(rng.integers(2, 5)):
        turn = rng.uniform(0.0, 2.0 * math.pi)
        position = rng.uniform(-1.0, 1.0, 3) * [1.0, 0.3, 0.3]
        shaft = 0.0, math.cos(turn), math.sin(turn)
        parts.append(Rudder(f"f{i}", tuple(position), shaft, (1, 0, 0), 0.01, (-limit, limit), 2.0))
    for i in range(rng.integers(2, 5)):
        axis = rng.normal(size=3) if rng.random() < 0.5 else np.array([1.0, 0.0, 0.0])
        position = rng.uniform(-1.0, 1.0, 3) * [1.0, 0.3, 0.3]
        unit = tuple(axis / np.linalg.norm(axis))
        parts.append(Thruster(f"t{i}", tuple(position), unit, (-30.0, 40.0), PowerLaw(1.0)))
    return Layout("foils", tuple(parts))


def questions(seed: int, limit: float, turned: float) -> Iterator[tuple[Allocator, Array, float]]:
    """Robots whose foils turn by a limit, wrenches (6,) of deflections up to `turned` [deg], their
    power."""
    rng = np.random.default_rng(seed)
    for _ in range(N_ROBOTS):
        layout = robot(rng, math.radians(limit))
        allocator = Allocator(layout)
        plant = Plant(layout)
        for _ in range(N_WRENCHES):
            command = plant.sample(rng, ())
            for i, part in enumerate(layout.actuators):
                if isinstance(part, Rudder):
                    command[i, 0] = math.radians(turned) * rng.uniform(-1.0, 1.0)
            power = float(plant.power(command, flow=FLOW).sum())
            yield allocator, plant.wrench(command, flow=FLOW), power


@pytest.mark.parametrize(
    ("seed", "limit", "turned", "most"),
    [(411, 24.0, 24.0, 1), (412, 30.0, 24.0, 1), (413, 30.0, 30.0, 3)],
)
def test_what_foils_give_near_the_stall_is_given(
    seed: int, limit: float, turned: float, most: int
) -> None:
    missed = 0
    dearer = 0
    exact = []
    for allocator, wrench, power in questions(seed, limit, turned):
        answer = allocator.allocate(wrench, flow=FLOW)
        missed += not answer.reachable
        dearer += answer.power > 1.01 * power
        if answer.reachable:
            exact.append(answer.err_norm)
        assert answer.bound is None or answer.bound <= answer.power * (1.0 + 1e-6)
    assert missed <= most
    assert dearer <= 2 + most
    assert np.quantile(exact, 0.98) <= 1e-6


def test_policies_of_a_sheet_answer_wrenches_beside_it() -> None:
    """Four actuators and a wrench that no commands of theirs give: each policy has an answer."""
    rng = np.random.default_rng(414)
    layout = next(each for each in iter(lambda: robot(rng, 0.5), None) if each.n == 4)
    allocator = Allocator(layout)
    for policy in ("closest", "direction", "priority"):
        for _ in range(4):
            wrench = rng.normal(size=6) * [20.0, 5.0, 5.0, 2.0, 5.0, 5.0]
            answer = allocator.allocate(wrench, policy=policy, flow=FLOW)
            assert not answer.reachable and np.isfinite(answer.power)
            wrench_of_plant = Plant(layout).wrench(answer.command, flow=FLOW)
            np.testing.assert_allclose(wrench_of_plant, answer.wrench, atol=1e-9)
