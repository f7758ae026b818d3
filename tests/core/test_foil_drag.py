"""Power and forces of commands, on which the search of robots whose foils drag steps from one to
the next."""

import ctypes

import numpy as np
import pytest

from finlab.arrays import Array
from tests.core.internal_functions import FIN, MOST, ROBOTS, Robot, at, functions, robot_of


def told(robot: Robot, command: Array, lost: Array) -> tuple[float, Array]:
    """Power [W] and forces (n, 2) along the rows of commands (n, 3), some actuators (n,) lost."""
    work = robot.work()
    gone = lost.astype(np.uint8)
    state = ctypes.c_void_p(gone.ctypes.data), None
    assert functions().fl_span_of_question(at(robot.block), work, *state)
    commands = np.zeros((MOST, 3))
    commands[: robot.n] = command
    force = np.zeros((MOST, 2))
    power = functions().fl_power_of_commands
    power.restype = ctypes.c_double
    cost = power(at(robot.block), work, at(commands), at(force))
    return float(cost), force[: robot.n]


@pytest.mark.parametrize("name", ROBOTS)
def test_power_and_forces_of_commands_are_those_of_the_plant(name: str) -> None:
    for number in range(2):
        robot = robot_of(name, number)
        rng = np.random.default_rng([1, number])
        for command in robot.plant.sample(rng, (6,)):
            lost = np.arange(robot.n) == rng.integers(2 * robot.n)
            power, force = told(robot, command, lost)
            plant_power = robot.plant.power(command)
            # A law has no power in its dead band, where the core has that of the force.
            gives_force = np.abs(robot.plant.force(command)).max(axis=1) > 0.0
            if gives_force[~lost].all():
                # A fin has many beats for one force, of which the core knows the cheapest.
                most = plant_power[~lost].sum()
                assert power <= most * (1.0 + 2e-3) + 1e-6
                if not (robot.actuators["command_kind"] == FIN).any():
                    assert power == pytest.approx(most, rel=2e-3, abs=1e-6)
            assert not force[lost].any()
            for i in np.flatnonzero(~lost).tolist():
                law, _ = robot.force(i, np.ascontiguousarray(command[i]))
                rows = law[1:] if robot.is_plane(i) else law[:2]
                sign = (
                    robot.actuators[i]["command_sign"]
                    if robot.actuators[i]["command_kind"] == 0.0
                    else 1.0
                )
                np.testing.assert_allclose(force[i], sign * rows, atol=1e-12)


@pytest.mark.parametrize("number", range(3))
def test_foils_of_a_flow_cost_their_drag_at_the_speed_of_the_flow(number: int) -> None:
    robot = robot_of("rudders", number)
    rng = np.random.default_rng([2, number])
    foils = robot.actuators["flow_speed"] > 0.0
    assert foils.any()
    command = robot.plant.sample(rng, (1,))[0]
    power, force = told(robot, command, np.zeros(robot.n, bool))
    others, _ = told(robot, command, foils)
    rest = robot.actuators["pressure_area"] * robot.actuators["zero_lift_drag"]
    drag = robot.actuators["flow_speed"] * (force[:, 1] + rest)
    assert power - others == pytest.approx(drag[foils].sum(), rel=1e-9)
