"""Rows of finlab/core/src/command_form.c: what the core knows of a kind of command is what the
actuator's class says of it."""

import ctypes

import pytest

from finlab.core.fields import struct
from tests.core.internal_functions import FIN, ROBOTS, STEERED, CommandForm, functions, robot_of

NO_NUMBER = -1
"""NO_NUMBER: no number of the command is one."""


def form_of(actuators_address: int, i: int) -> CommandForm:
    address = actuators_address + i * struct("fl_actuator").itemsize
    form: CommandForm = functions().fl_form_of(ctypes.c_void_p(address)).contents
    return form


def number_or_none(index: int | None) -> int:
    return NO_NUMBER if index is None else index


@pytest.mark.parametrize("name", ROBOTS)
def test_both_languages_agree_on_the_numbers_of_a_command(name: str) -> None:
    robot = robot_of(name)
    address = robot.block.ctypes.data + struct("fl_head").itemsize
    for i, actuator in enumerate(robot.layout.actuators):
        form = form_of(address, i)
        assert form.numbers == len(actuator.KIND.numbers)
        assert form.angle_number == number_or_none(actuator.KIND.aiming_number)
        assert form.force_number == number_or_none(actuator.KIND.force_number)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_command_has_a_table_and_a_grid_where_its_form_says_so(name: str) -> None:
    robot = robot_of(name)
    address = robot.block.ctypes.data + struct("fl_head").itemsize
    for i, own in enumerate(robot.actuators):
        form = form_of(address, i)
        assert (form.command_table != 0) == (own["command_table"] > 0)
        assert bool(form.has_law_grid) == (own["law_grid"] > 0)
        is_fin = own["command_kind"] == FIN
        is_steered = own["command_kind"] == STEERED
        has_law_of_foil = bool(form.has_law_grid) and not is_fin and not is_steered
        assert bool(form.has_drag) == has_law_of_foil
        assert bool(form.reverses_straight) == is_steered
