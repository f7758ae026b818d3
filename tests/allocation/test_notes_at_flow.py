"""What an answer says of rudders at rest, and how a robot of several types of actuator is shown."""

import numpy as np

from finlab.allocation.notes import fin_notes
from finlab.allocation.tables import in_words
from finlab.layout import Layout, load_layout
from finlab.layout.commands import AzimuthCommand, FinCommand, RudderCommand, ThrusterCommand
from finlab.layout.propellers import Thruster
from finlab.layout.rudder import Rudder
from finlab.layout.thrust_model import PowerTable


def test_rudders_at_rest_are_told() -> None:
    rudder = Rudder("tail", (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.03, (-0.5, 0.5), 3.0)
    robot = Layout("torpedo", (*load_layout("turtle_hybrid").actuators, rudder))
    assert fin_notes(robot) == (
        "rudder tail gives nothing at rest; tell how the robot moves through the water (flow)",
    )
    assert fin_notes(robot, np.array([1.0, 0, 0, 0, 0, 0])) == ()
    assert fin_notes(load_layout("turtle_hybrid")) == ()
    assert "the flow is without effect" in fin_notes(load_layout("turtle_hybrid"), np.ones(6))[-1]


def test_commands_in_words() -> None:
    assert in_words(FinCommand(0.5, 1.0, np.pi / 2)) == "0.500 rad, 1.000 Hz, 90.0 deg"
    assert in_words(ThrusterCommand(10.0, 1700.0)) == "10.000 N, input 1700"
    assert in_words(AzimuthCommand(np.pi, 10.0)) == "10.000 N at 180.0 deg"
    assert in_words(RudderCommand(-0.5)) == "-28.6 deg"


def test_tables_hold_forces_at_rest() -> None:
    rudder = Rudder("tail", (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.03, (-0.5, 0.5), 3.0)
    rows = tuple((float(u), float(u), float(abs(u) ** 1.5)) for u in range(-20, 21))
    pusher = Thruster("stern", (-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (-20.0, 20.0), PowerTable(rows))
    robot = Layout("torpedo", (pusher, rudder))
    assert fin_notes(robot, np.array([1.0, 0, 0, 0, 0, 0])) == (
        "the tables of stern hold forces at rest; what speed changes is not known",
    )
