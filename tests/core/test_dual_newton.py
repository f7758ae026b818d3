"""Newton's method on the dual: its gradient is that of its value, and it takes few steps, whatever
the robot, beyond reach and from tick to tick."""

import numpy as np
import pytest

from finlab.allocation import Policy
from finlab.arrays import Array
from finlab.core.calls import _policy_record
from tests.core.parts import ROBOTS, Robot, at, functions, robot_of

NUMBERS = range(2)
"""Of each kind of robot."""
STEPS = {
    "thrusters": (191, 877, 76),
    "azimuths": (86, 588, 38),
    "fins": (100, 909, 95),
    "fins any shaft": (70, 971, 66),
    "fins uneven": (81, 1092, 30),
    "wide arcs": (258, 2067, 69),
    "holes": (508, 2549, 38),
    "rudders": (1744, 4872, 722),
    "mixed": (132, 2227, 77),
    "all": (134, 1905, 122),
    "pods either way": (465, 3741, 333),
}
"""Steps of all questions of a kind within reach, beyond it by the three policies, and in ticks:
what they took when this was written, and a tenth more. A fault of a slope costs steps, where it
costs nothing else."""


def wrenches(robot: Robot, number: int, times: float, count: int) -> Array:
    """Wrenches (count, 6) of random commands, some times as large."""
    rng = np.random.default_rng([7, number])
    return np.asarray(times * robot.plant.wrench(robot.plant.sample(rng, (count,))))


def looked_at(robot: Robot, wrench: Array, inner: Array) -> tuple[float, Array]:
    """The dual value [W] at multipliers (6,), and the forces (n, 2)."""
    force = np.zeros((robot.n, 2))
    value = functions().fl_dual_value(
        at(robot.block), robot.work(), at(wrench), at(inner), at(force)
    )
    return float(value), force


@pytest.mark.parametrize("name", ROBOTS)
def test_the_gradient_of_the_dual_is_what_is_left_of_the_wrench(name: str) -> None:
    for number in NUMBERS:
        robot = robot_of(name, number)
        rng = np.random.default_rng([3, number])
        rank = int(robot.head["rank"])
        for wrench in wrenches(robot, number, 1.0, 4):
            found = robot.answer(wrench)
            inner: Array = found["lambda_reduced"].copy()
            size = np.abs(inner).max()
            inner[:rank] += 0.3 * size * rng.normal(size=rank)
            _, force = looked_at(robot, wrench, inner)
            target = robot.head["basis"].T @ (wrench / robot.head["axis_scale"])
            residual = target - np.einsum(
                "nr,nrj->j", force, robot.actuators["effectiveness_reduced"]
            )
            for j in range(rank):
                change = 1e-5 * size * np.eye(6)[j]
                ahead, back = (
                    looked_at(robot, wrench, inner + one)[0] for one in (change, -change)
                )
                slope = (ahead - back) / (2e-5 * size)
                assert slope == pytest.approx(residual[j], abs=2e-3 * np.linalg.norm(target))


def steps_of(name: str) -> tuple[int, int, int]:
    """Steps within reach, beyond it by each policy, and in ticks, of all robots of a kind."""
    within = beyond = ticks = 0
    for number in NUMBERS:
        robot = robot_of(name, number)
        within += sum(
            int(robot.answer(wrench)["newton_steps"]) for wrench in wrenches(robot, number, 1.0, 8)
        )
        for policy in ("closest", "direction", "priority"):
            record = _policy_record(Policy(policy))
            for wrench in wrenches(robot, number, 3.0, 4):
                beyond += int(robot.answer(wrench, policy=record.ctypes.data)["newton_steps"])
        previous = None
        for wrench in wrenches(robot, number, 1.0, 8):
            asked = {} if previous is None else {"previous": previous, "calm": 2.0}
            answer = robot.answer(wrench, **asked)
            previous = answer["command"][: robot.n].copy()
            ticks += int(answer["newton_steps"])
    return within, beyond, ticks


@pytest.mark.parametrize("name", ROBOTS)
def test_answers_take_few_steps(name: str) -> None:
    for took, most in zip(steps_of(name), STEPS[name], strict=True):
        assert took <= most


@pytest.mark.parametrize("name", ["azimuths", "fins", "fins any shaft", "fins uneven"])
def test_from_the_multipliers_of_an_answer_nothing_is_left_to_do(name: str) -> None:
    for number in NUMBERS:
        robot = robot_of(name, number)
        for wrench in wrenches(robot, number, 1.0, 6):
            first = robot.answer(wrench)
            again = robot.answer(wrench, prices=first["prices"].copy())
            assert again["newton_steps"] <= 1
            near = robot.answer(1.001 * wrench, prices=first["prices"].copy())
            assert near["newton_steps"] <= max(4, first["newton_steps"])
