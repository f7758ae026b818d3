"""Answers to prices: worth as much as any command within the limits, and the commands that give
them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from finlab.actuators.azimuth import Azimuth, AzimuthLaw
from finlab.actuators.fin.fin import Fin
from finlab.actuators.kinds import groups_of
from finlab.actuators.response import Line
from finlab.actuators.rudder import Rudder, RudderGroup, RudderLaw
from finlab.actuators.thrust_model import PowerLaw, PowerTable
from finlab.actuators.thruster import Thruster, ThrusterLaw
from finlab.allocation.dual.compiled import Compiled
from finlab.arrays import Array
from finlab.layout.effectiveness import own_effectiveness
from finlab.layout.layout import Layout
from finlab.physics.plant import Plant
from tests.core.internal_functions import dual_function
from tests.t200 import t200_rows

T200 = PowerTable(t200_rows(16), "us")
"""A measured thruster at 16 V, whose input is a width of pulse [us]."""
UP = (0.0, 0.0, 1.0)
AHEAD = (1.0, 0.0, 0.0)


def thruster(force: tuple[float, float], model: Any, **more: Any) -> Thruster:
    """A thruster with limits of force [N] and a law, in a direction that no axis of the body
    has."""
    return Thruster(
        f"t{force}{model.type}{more}"[:60], (0.1, 0.2, 0.3), (0.0, 0.6, 0.8), force, model, **more
    )


THRUSTERS = [
    thruster((-39.0, 51.0), PowerLaw(0.997, 1.449)),
    thruster((0.0, 5.0), PowerLaw(2.0, exponent=2.0)),
    thruster((-8.0, 0.0), PowerLaw(2.0, 3.0, 1.3)),
    thruster((-39.0, 51.0), T200),
    thruster((-2.0, 0.0), T200, torque_per_newton=0.02),
]
"""Either way and one way only, by a law and by a table."""
AZIMUTHS = [
    Azimuth("full", (0, 0, 0), UP, AHEAD, (0.0, 40.0), PowerLaw(1.0)),
    Azimuth("arc", (0, 0.2, 0), AHEAD, UP, (0.0, 20.0), T200, arc=(-0.2, 1.1)),
    Azimuth("runs", (0.3, 0, 0), UP, AHEAD, (2.0, 20.0), PowerLaw(1.0), arc=(1.0, 1.5)),
]
"""Any angle; an arc and a table; an arc and a least force that is above zero."""
RUDDERS = [
    Rudder("wide", (-0.6, 0, 0), UP, AHEAD, 0.01, (-0.5, 0.5), aspect_ratio=2.21),
    Rudder(
        "one side", (-0.6, 0, 0), (0, 1, 0), AHEAD, 0.02, (0.0, 0.3), aspect_ratio=1.0, stall=0.6
    ),
]
"""Deflections either way, and to one side only with a stall of its own."""


def effectiveness_of(actuators: Sequence[Any]) -> Array:
    """Effectiveness (m, 3, 6) of actuators, along their own axes."""
    return own_effectiveness(Layout("robot", tuple(actuators)))


def random_multipliers(top: float) -> Array:
    """Multipliers (6, 40) of the wrench, with a standard deviation of `top` [W/N, W/(N m)]."""
    return np.random.default_rng(0).normal(0.0, top, (6, 40))


def compiled_of(actuators: Sequence[Any], inflow: Array | None = None) -> Compiled:
    """A robot of these m actuators alone, which meet the water with velocities (m, 3)."""
    layout = Layout("robot", tuple(actuators))
    return Compiled(layout, Plant(layout), np.ones(6)).at(inflow)


def answer(robot: Compiled, price: Array) -> tuple[Array, float]:
    """Forces (m, 2) at multipliers (6,) of the wrench, and what they are worth less their power."""
    spanned = robot.basis.T @ (robot.axis_scale * price)
    lambda_reduced = np.pad(spanned, (0, 6 - len(spanned)))
    force, dual_value = dual_function(robot.block, robot.wrench_offset, lambda_reduced)
    return force, -dual_value


def check(actuators: Sequence[Any], law: Any) -> None:
    """No command is worth more at random multipliers (6, N) than the answer, and its own command
    gives it."""
    wrench = effectiveness_of(actuators)
    low, high = (np.array([getattr(part, end) for part in actuators]) for end in ("lower", "upper"))
    multipliers = random_multipliers(5.0)
    m = len(actuators)
    robot = compiled_of(actuators)
    force = np.array([answer(robot, price)[0] for price in multipliers.T])
    command = robot.core.commands(force)
    assert (command >= low).all() and (command <= high).all()
    given = law.force(command)
    net_value = np.einsum("nma,maw,wn->nm", given, wrench, multipliers) - law.power(command)
    tried = low + np.random.default_rng(1).uniform(size=(400, m, 3)) * (high - low)
    others = np.einsum("tma,maw,wn->tnm", law.force(tried), wrench, multipliers)
    others -= law.power(tried)[:, None]
    scale = np.abs(net_value).max(axis=0) + 1e-9
    assert (net_value >= others.max(axis=0) - 5e-4 * scale).all()
    most = [answer(robot, price)[1] for price in multipliers.T]
    np.testing.assert_allclose(most, net_value.sum(axis=1), atol=5e-4 * scale.sum())


def test_thrusters_answer_with_what_is_worth_most() -> None:
    for part in THRUSTERS:
        check([part], ThrusterLaw([part]))


def test_thrusters_of_one_model_answer_together() -> None:
    parts = [THRUSTERS[i] for i in (0, 1, 2)]
    check(parts, ThrusterLaw(parts))
    np.testing.assert_allclose(compiled_of(parts).ends, [[-39, 51], [0, 5], [0, 8]], rtol=1e-12)


def test_azimuths_answer_with_what_is_worth_most() -> None:
    for part in AZIMUTHS:
        check([part], AzimuthLaw([part]))


@pytest.mark.parametrize(
    "flow", [(1.5, 0.0, 0.0), (1.2, 0.2, -0.1), (-0.8, 0.1, 0.0), (1.0, 1.0, 0.3)]
)
def test_rudders_answer_with_a_lift_that_their_deflections_give(
    flow: tuple[float, float, float],
) -> None:
    wrench = effectiveness_of(RUDDERS)
    frames = np.array([part.frame for part in RUDDERS])
    inflow = frames @ np.array(flow)
    group = RudderGroup(RUDDERS, wrench).at(inflow)
    law = RudderLaw(RUDDERS)
    low, high = (np.array([getattr(part, end) for part in RUDDERS]) for end in ("lower", "upper"))
    robot = compiled_of(RUDDERS, inflow)
    met = law.flow_at(inflow, inflow.shape)
    across = np.stack([0.0 * met.course, -np.sin(met.course), np.cos(met.course)], axis=-1)
    for fraction in (0.0, 0.3, 1.0):
        force = np.zeros((1, 2, 2))
        force[0, :, 0] = robot.ends[:, 0] + fraction * (robot.ends[:, 1] - robot.ends[:, 0])
        command = robot.core.commands(force)[0]
        assert (command >= low).all() and (command <= high).all()
        given = law.force(command, inflow)
        most = met.pressure * 0.03
        np.testing.assert_allclose((given * across).sum(-1), force[0, :, 0], atol=most.max() * 1e-2)
        drag = np.einsum("ma,maw->w", given - force[0, :, :1] * across, wrench)
        np.testing.assert_allclose(group.wrench_offset_of(force)[0], drag, atol=most.max() * 1e-2)
    np.testing.assert_allclose(
        group.wrench_offset_at_rest.sum(axis=0),
        group.wrench_offset_of(np.zeros((1, 2, 2)))[0],
        atol=1e-12,
    )


def test_a_rudder_answers_a_price_with_the_lift_whose_drag_it_pays() -> None:
    part = RUDDERS[0]
    inflow = np.array([[0.0, 1.5, 0.1]])
    law = RudderLaw([part])
    robot = compiled_of([part], inflow)
    price = np.linspace(-3.0, 3.0, 31)
    rows = np.linalg.pinv(
        robot.effectiveness[0]
    )  # multipliers at which lift has a price, and drag none
    dual_values = [answer(robot, rows @ [own, 0.0])[1] for own in price]
    delta = np.linspace(-0.5, 0.5, 4001)[:, None, None] * [1.0, 0.0, 0.0]
    course = law.flow_at(inflow, inflow.shape).course[0]
    lift = law.force(delta, inflow)[:, 0] @ [0.0, -np.sin(course), np.cos(course)]
    net_value = price * lift[:, None] - law.power(delta, inflow)
    np.testing.assert_allclose(dual_values, net_value.max(axis=0), rtol=0.02, atol=0.02)


def test_a_price_of_drag_counts_in_the_answer_of_a_rudder() -> None:
    part = RUDDERS[0]
    inflow = np.array([[0.0, 1.5, 0.1]])
    wrench = effectiveness_of([part])
    law = RudderLaw([part])
    multipliers = np.array([2.0, 3.0, 0.0, 0.0, 0.0, 0.5])
    robot = compiled_of([part], inflow)
    command = robot.core.commands(answer(robot, multipliers)[0][None])
    tried = np.linspace(-0.5, 0.5, 4001)[:, None, None] * [1.0, 0.0, 0.0]
    found, best = (
        np.einsum("nma,maw,w->n", law.force(each, inflow), wrench, multipliers)
        - law.power(each, inflow)[:, 0]
        for each in (command, tried)
    )
    assert found[0] >= best.max() - 1e-3 * abs(best).max()


def test_a_rudder_at_rest_offers_nothing() -> None:
    group = RudderGroup(RUDDERS, effectiveness_of(RUDDERS))
    lines = [line for line in group.responses if isinstance(line, Line)]
    assert [(line.low, line.high) for line in lines] == [(0.0, 0.0)] * 2
    assert not group.wrench_offset_of(np.zeros((3, 2, 2))).any()


def test_an_azimuth_keeps_its_angle_where_no_force_is_asked_for() -> None:
    core = compiled_of(AZIMUTHS).core
    rest = np.zeros((1, 3, 2))
    before = np.array([[3.0, 5.0, 0.0], [0.9, 0.0, 0.0], [1.2, 2.0, 0.0]])
    for previous, angles in (
        (before, [3.0, 0.9, 1.2]),
        (None, [0, 0, 1]),
        (np.nan * before, [0, 0, 1]),
    ):
        np.testing.assert_allclose(core.commands(rest, previous)[0, :, 0], angles, atol=1e-12)


def test_every_actuator_of_a_mixed_robot_is_in_one_group() -> None:
    robot = Layout(
        "robot", (RUDDERS[0], *THRUSTERS[:2], *AZIMUTHS, Fin("fin", (0.1, 0, 0), 0.3), RUDDERS[1])
    )
    groups = groups_of(robot.actuators, own_effectiveness(robot))
    assert sorted(np.concatenate([places for places, _ in groups])) == list(range(robot.n))
    assert [len(group.responses) == len(group.forms) == len(places) for places, group in groups]
    plant = Plant(robot)
    command = Compiled(robot, plant, np.ones(6)).core.commands(np.zeros((2, robot.n, 2)))
    np.testing.assert_array_equal(plant.feasible(command), command)
