"""Outer iterations in the core for robots whose actuators act on each other by made-up formulas:
exact by the whole model, at the conditions of Karush, Kuhn and Tucker, within what a question
says."""

from typing import Any

import numpy as np
import pytest

from finlab.actuators.thrust_model import PowerLaw
from finlab.allocation import Allocator
from finlab.allocation.dual.compiled import core_policy
from finlab.allocation.policy import CLOSEST
from finlab.arrays import ROUNDS, Array
from finlab.core.calls import NOMINAL, Conditions
from finlab.core.coupled_core import CoupledCore, OuterResult, WrenchOffset
from finlab.layout import Layout, Thruster
from finlab.layout.load import parse_layout
from tests.random_robots import bluerov2_heavy, random_flow, random_robot

SMOOTH = ("thrusters", "azimuths", "fins", "fins any shaft", "rudders", "mixed")
"""Robots whose answers are exact; what has gaps is left out."""


class Coupled:
    """A robot with a made-up offset o(y) = A y + y' Q y of its forces y in the body frame, and what
    the core asked it for."""

    def __init__(self, layout: Layout, flow: Array | None, strength: float, bend: float) -> None:
        """Makes up a formula.

        Args:
            layout: the robot.
            flow: (6,), or None at rest.
            strength: of the linear part, over the effectiveness of the actuators themselves.
            bend: of the squared part, over the linear one at the largest wrenches.
        """
        self.layout = layout
        method = Allocator(layout)._whole.method.at(flow)  # type: ignore[attr-defined]
        self.plant = method.plant
        self.scale: Array = method.scale
        self.counts = np.array(self.plant.counts)
        rng = np.random.default_rng(5)
        size = np.abs(self.plant.effectiveness).max(axis=(0, 1)) + 1e-3
        self.linear = strength * size * rng.normal(size=(layout.n, 3, 6))
        largest = float(np.abs(method.compiled.row_force_max).max())
        bent = rng.normal(size=(layout.n, 3, layout.n, 3, 6))
        bent = bent + bent.transpose(2, 3, 0, 1, 4)
        self.bent = bend * strength * size * bent / (2.0 * largest * layout.n)
        self.asked: list[Array] = []
        robot = method.compiled
        offset = WrenchOffset(
            frames=robot.axes @ layout.frames,
            counts=self.counts,
            inflow=None,
            core_constants=None,
            effect=self.effect,
        )
        self.core = CoupledCore(robot.block, offset)
        self.method = method

    def effect(self, force: Array, _: Array | None = None) -> tuple[Array, Array]:
        """The offset (6,) of forces (n, 3) [N], body frame, and its derivatives (n, 3, 6)."""
        self.asked.append(force.copy())
        slope = self.linear + 2.0 * np.einsum("nambw,mb->naw", self.bent, force)
        bent = np.einsum("nambw,na,mb->w", self.bent, force, force)
        return np.einsum("naw,na->w", self.linear, force) + bent, slope

    def wrench(self, command: Array) -> Array:
        """Wrench (6,) of commands (n, 3) by the whole model, 0 along axes that do not count."""
        force = self.plant.body_forces(command)
        offset, _ = self.effect(force)
        return np.asarray(self.plant.wrench(command) + np.where(self.counts, offset, 0.0))

    def missing(self, command: Array, wrench: Array) -> Array:
        """What commands miss of a wrench (6,), over the scale, along the axes that count."""
        return np.where(self.counts, (self.wrench(command) - wrench) / self.scale, 0.0)

    def within(self, rng: np.random.Generator, share: float = 0.5) -> Array:
        """A wrench (6,) within reach: of random commands, nearer to those at rest."""
        command = self.plant.lower + rng.random(self.plant.lower.shape) * self.plant.width
        rest = self.plant.rested(self.plant.feasible(np.zeros_like(command)))
        return share * (self.wrench(command) - self.wrench(rest)) + self.wrench(rest)

    def iterated(
        self, wrench: Array, most: int = ROUNDS, conditions: Conditions = NOMINAL, **more: Any
    ) -> OuterResult:
        """What iterations come to from the forces by the laws alone."""
        begin = self.method.compiled.forces(wrench[None], CLOSEST, None, conditions)
        return self.core.iterate(
            wrench,
            begin.force[0],
            most,
            core_policy(CLOSEST),
            begin.multipliers[0],
            conditions,
            **more,
        )


def coupled(name: str, number: int = 1, strength: float = 0.1, bend: float = 0.5) -> Coupled:
    """A random robot of a kind, in its flow."""
    layout = parse_layout(random_robot(name, number, 71))
    return Coupled(layout, random_flow(name, number, 71), strength, bend)


@pytest.mark.parametrize("name", SMOOTH)
def test_commands_give_the_wrench_by_the_whole_model(name: str) -> None:
    robot = coupled(name)
    rng = np.random.default_rng(1)
    for _ in range(2):
        wrench = robot.within(rng)
        result = robot.iterated(wrench)
        assert result.answer is not None
        command = result.answer.command[0]
        # The core's grids stand for the laws: that is their error.
        missing = np.linalg.norm(robot.missing(command, wrench))
        assert missing == pytest.approx(result.error, abs=2e-4)
        assert result.error <= (2e-3 if name == "rudders" else 1e-6)
        assert (command >= robot.plant.lower - 1e-9).all()
        assert (command <= robot.plant.upper + 1e-9).all()
        power = robot.plant.power(command).sum()
        assert result.power == pytest.approx(power, rel=5e-3, abs=1e-3)


@pytest.mark.parametrize("name", ["thrusters", "azimuths", "fins uneven", "rudders", "mixed"])
def test_the_formula_is_asked_for_the_forces_of_the_commands(name: str) -> None:
    """In the body frame, a foil's drag at rest included, and 0 of an actuator that is lost."""
    robot = coupled(name, bend=0.0)
    wrench = robot.within(np.random.default_rng(2), 0.3)
    lost = np.arange(robot.layout.n) == 1
    for conditions in (NOMINAL, Conditions(lost=lost)):
        works = np.ones_like(lost) if conditions.lost is None else ~lost
        robot.asked.clear()
        result = robot.iterated(wrench, conditions=conditions)
        assert result.answer is not None
        command = np.where(works[:, None], result.answer.command[0], robot.plant.lower)
        force = np.where(works[:, None], robot.plant.body_forces(command), 0.0)
        largest = max(np.abs(force).max(), 1e-3)
        apart = min(np.abs(asked - force).max() for asked in robot.asked[-8:])
        assert apart <= 2e-3 * largest


def ways_of_thrusters(robot: Coupled) -> Array:
    """Axes (n, 3) of thrusters in the body frame."""
    return np.array([actuator.axis for actuator in robot.layout.actuators])  # type: ignore[attr-defined]


@pytest.mark.parametrize("bend", [0.0, 0.5])
@pytest.mark.parametrize("strength", [0.05, 0.2])
def test_the_gradient_of_the_power_is_that_of_multipliers_on_the_whole_model(
    bend: float, strength: float
) -> None:
    """dP/dF = J' lambda, J the slope of the whole model, of all thrusters off their limits."""
    robot = Coupled(parse_layout(bluerov2_heavy()), None, strength, bend)
    axes = ways_of_thrusters(robot)
    rng = np.random.default_rng(3)
    for _ in range(3):
        wrench = robot.within(rng, 0.4)
        result = robot.iterated(wrench)
        assert result.answer is not None
        command = result.answer.command[0]
        force = command[:, 0]
        step = 1e-4
        gradient = np.empty(len(force))
        for i in range(len(force)):
            change = np.zeros_like(command)
            change[i, 0] = step
            ahead, back = robot.plant.power(command + change), robot.plant.power(command - change)
            gradient[i] = (ahead.sum() - back.sum()) / (2.0 * step)
        _, slope = robot.effect(force[:, None] * axes)
        whole = np.einsum("na,naw->nw", axes, slope) + robot.plant.effectiveness[:, 0]
        J = whole / robot.scale
        free = (force > robot.plant.lower[:, 0] + 0.1) & (force < robot.plant.upper[:, 0] - 0.1)
        multipliers, *_ = np.linalg.lstsq(J[free], gradient[free], rcond=None)
        left = gradient[free] - J[free] @ multipliers
        assert free.sum() >= 7
        assert np.linalg.norm(left) <= 0.03 * np.linalg.norm(gradient[free])
        # And they are the answer's own, which weigh an error more than its worth.
        np.testing.assert_allclose(
            result.answer.multipliers[0] * robot.scale,
            multipliers,
            atol=0.05 * np.abs(multipliers).max(),
        )
        assert result.penalty >= 1.9 * np.linalg.norm(multipliers)


def test_where_the_offset_is_linear_one_iteration_finds_the_least_power() -> None:
    """As that of thrusters whose axes are those of the whole model."""
    robot = Coupled(parse_layout(bluerov2_heavy()), None, 0.1, 0.0)
    wrench = robot.within(np.random.default_rng(4), 0.4)
    once = robot.iterated(wrench, most=1)
    many = robot.iterated(wrench)
    assert once.power == pytest.approx(many.power, rel=1e-5)
    assert once.error <= 1e-6 and many.error <= 1e-6


def test_steps_bound_the_iterations_but_for_the_first() -> None:
    robot = coupled("azimuths", bend=1.0, strength=0.3)
    wrench = robot.within(np.random.default_rng(5), 0.5)
    once = robot.iterated(wrench, most=1)
    bounded = robot.iterated(wrench, most_steps=0.0)
    free = robot.iterated(wrench)
    assert bounded.power == once.power and bounded.steps == once.steps
    assert free.steps > once.steps
    assert free.power <= once.power * (1.0 + 1e-6)


@pytest.mark.parametrize("name", ["thrusters", "fins"])
def test_without_an_iteration_forces_are_near_to_those_given_and_meet_the_wrench(name: str) -> None:
    robot = coupled(name)
    wrench = robot.within(np.random.default_rng(6), 0.4)
    begin = robot.method.compiled.forces(wrench[None], CLOSEST, None, NOMINAL).force[0]
    nearest = robot.core.iterate(wrench, begin, 0)
    settled = robot.iterated(wrench)
    assert nearest.answer is None and nearest.error <= 1e-3
    assert nearest.power >= settled.power * (1.0 - 1e-3)
    again = robot.core.iterate(wrench, settled.force, 0)
    # The forces of the iterations are exact already: no step is taken from there.
    np.testing.assert_allclose(again.force, settled.force, atol=1e-2 * np.abs(settled.force).max())


@pytest.mark.parametrize("name", ["thrusters", "azimuths", "fins", "mixed"])
def test_in_a_tick_commands_stay_within_the_rates_and_come_to_the_wrench(name: str) -> None:
    robot = coupled(name)
    rng = np.random.default_rng(7)
    wrench = robot.within(rng, 0.3)
    first = robot.iterated(wrench)
    assert first.answer is not None
    previous = robot.plant.feasible(first.answer.command[0])
    near = 1.01 * wrench
    result = robot.core.iterate(
        near,
        None,
        2,
        core_policy(CLOSEST),
        first.answer.multipliers[0],
        Conditions(previous, calm=2.0),
    )
    assert result.answer is not None
    command = result.answer.command[0]
    assert robot.method.rates.allow(previous, command * (1.0 - 1e-12))
    assert np.linalg.norm(robot.missing(command, near)) <= 2e-3


def test_an_axis_that_does_not_count_takes_any_wrench() -> None:
    """Of the offset, too: what it gives there changes nothing."""
    actuators = parse_layout(bluerov2_heavy()).actuators
    layout = Layout("three", actuators, axes=("Fx", "Fy", "Tz"))
    robot = Coupled(layout, None, 0.1, 0.2)
    wrench = np.array([20.0, -5.0, 0.0, 0.0, 0.0, 1.0])
    result = robot.iterated(wrench)
    assert result.answer is not None and result.error <= 1e-6
    assert np.linalg.norm(robot.missing(result.answer.command[0], wrench)) <= 1e-5
    robot.linear[..., ~robot.counts] *= 3.0
    again = robot.iterated(wrench)
    assert again.power == result.power


def test_a_thruster_that_is_lost_gives_nothing_and_the_others_make_up_for_it() -> None:
    parts = parse_layout(bluerov2_heavy()).actuators
    idle = Thruster("idle", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (-30.0, 30.0), PowerLaw(1.0))
    robot = Coupled(Layout("nine", (*parts, idle)), None, 0.1, 0.2)
    lost = np.arange(9) == 8
    rng = np.random.default_rng(8)
    command = robot.plant.sample(rng, ())
    command[8] = 0.0
    wrench = 0.3 * robot.wrench(command)
    result = robot.iterated(wrench, conditions=Conditions(lost=lost))
    assert result.answer is not None
    given = result.answer.command[0].copy()
    given[8] = 0.0
    assert np.linalg.norm(robot.missing(given, wrench)) <= 1e-4
    assert result.power == pytest.approx(robot.plant.power(given).sum(), rel=1e-3)
