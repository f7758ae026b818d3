"""Commands as users see them: of each type of actuator, of tables, and of a robot that pushes
nothing."""

import math

import numpy as np
import pytest
from msgspec import to_builtins

from finlab.actuators.azimuth import Azimuth, AzimuthCommand, Tilt
from finlab.actuators.fin.fin import FinCommand
from finlab.actuators.propeller import input_of
from finlab.actuators.rudder import Rudder, RudderCommand
from finlab.actuators.thrust_model import PowerLaw, PowerTable
from finlab.actuators.thruster import Thruster, ThrusterCommand
from finlab.layout import Fin

AHEAD = (1.0, 0.0, 0.0)
"""Unit vector forward."""
UP = (0.0, 0.0, 1.0)
"""Unit vector upward."""
LAW = PowerLaw(2.0)
"""Power over force of actuators that are not measured."""
ROWS = ((1100, -40, 390), (1470, 0, 0), (1480, 0, 0), (1530, 0, 0), (1700, 10, 30), (1900, 50, 380))
"""Width of pulse [us], force [N] and power [W]; of some widths the force is zero."""
TABLE = PowerTable(tuple(tuple(map(float, row)) for row in ROWS), "us")
"""A thruster by these rows."""
FIN = Fin("fin", (0.1, 0.2, 0.3), 0.4)
"""A fin."""
THRUSTER = Thruster("thruster", (0.0, 0.1, 0.0), AHEAD, (-40.0, 50.0), TABLE)
"""A measured thruster."""
AZIMUTH = Azimuth("azimuth", (0.0, 0.0, 0.2), UP, AHEAD, (0.0, 20.0), LAW)
"""A pod that turns all round."""
TILT = Tilt("tilt", (0.0, 0.0, 0.2), UP, AHEAD, (3.0, 20.0), LAW, arc=(0.2, 0.7))
"""A pod that turns within an arc and cannot rest."""
RUDDER = Rudder("rudder", (-1.0, 0.0, 0.0), UP, AHEAD, 0.03, (-0.7, 0.5), 3.0)
"""A rudder that turns farther to one side."""


def test_each_type_has_a_command_of_its_own() -> None:
    row = np.array([0.3, 1.2, -0.5])
    assert FIN.command(row) == FinCommand(0.3, 1.2, -0.5)
    assert THRUSTER.command(np.array([10.0, 0.0, 0.0])) == ThrusterCommand(10.0, 1700.0)
    assert AZIMUTH.command(np.array([0.3, 12.0, 0.0])) == AzimuthCommand(0.3, 12.0, None)
    assert RUDDER.command(np.array([0.1, 0.0, 0.0])) == RudderCommand(0.1)
    assert THRUSTER.command(np.full(3, math.nan)) is None


def test_keys_of_files_carry_the_units() -> None:
    assert to_builtins(FinCommand(1.0, 2.0, 3.0)) == {
        "amplitude_rad": 1.0,
        "frequency_hz": 2.0,
        "zero_direction_rad": 3.0,
    }
    assert to_builtins(ThrusterCommand(1.0, 1500.0)) == {"force_n": 1.0, "input": 1500.0}
    assert to_builtins(AzimuthCommand(0.5, 2.0)) == {"angle_rad": 0.5, "force_n": 2.0}
    assert to_builtins(RudderCommand(0.5)) == {"deflection_rad": 0.5}


@pytest.mark.parametrize(
    ("force", "sent"),
    [
        (0.0, 1500.0),
        (-40.0, 1100.0),
        (-20.0, 1285.0),
        (5.0, 1615.0),
        (30.0, 1800.0),
        (1e-9, 1530.0),
        (-1e-9, 1470.0),
    ],
)
def test_a_table_says_what_to_send(force: float, sent: float) -> None:
    assert input_of(TABLE, force) == pytest.approx(sent, abs=1e-4)


def test_neutral_pushes_least_and_an_azimuth_keeps_its_angle() -> None:
    for actuator, row in (
        (FIN, [0.05, 0.1, 0.0]),
        (THRUSTER, [0.0] * 3),
        (AZIMUTH, [0.0] * 3),
        (TILT, [0.2, 3.0, 0.0]),
        (RUDDER, [0.0] * 3),
    ):
        np.testing.assert_array_equal(actuator.neutral(None), row)
    np.testing.assert_array_equal(AZIMUTH.neutral(np.array([1.5, 9.0, 0.0])), [1.5, 0.0, 0.0])
    np.testing.assert_array_equal(AZIMUTH.neutral(np.full(3, math.nan)), [0.0] * 3)
    np.testing.assert_array_equal(THRUSTER.neutral(np.array([9.0, 0.0, 0.0])), [0.0] * 3)
