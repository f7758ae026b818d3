"""Messages of every shipped robot hold what the library's typed commands say."""

import math
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: no wheel for this Python or machine")

from builtin_interfaces.msg import Time
from finlab_allocator import messages
from finlab_allocator.status_report import WARN, Report
from geometry_msgs.msg import TwistStamped, WrenchStamped
from sensor_msgs.msg import FluidPressure, Imu, JointState
from visualization_msgs.msg import Marker

import finlab
from finlab.assets import shipped_layouts

STAMP = Time(sec=12, nanosec=500_000_000)


def entries(message: Any) -> dict[str, tuple[float, float]]:
    """Position and effort by name."""
    return dict(zip(message.name, zip(message.position, message.effort, strict=True), strict=True))


@pytest.mark.parametrize("robot", sorted(shipped_layouts()))
def test_a_command_holds_each_number_by_its_name(robot: str) -> None:
    layout = finlab.load_layout(robot)
    lost = [layout.names[0]] if layout.n > 1 else []
    answer = finlab.Allocator(layout).allocate([1.0, 0.3, 0.5, 0, 0.1, 0.1], lost=lost)
    sizes = np.linalg.norm(answer.forces, axis=1)
    states = messages.JointStates(layout)
    assert states.needs_forces == any(part.type in ("fin", "rudder") for part in layout.actuators)
    message = states.message(answer.command, sizes, STAMP)
    assert message.name[: layout.n] == list(layout.names)
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (12, 500_000_000)
    entry = entries(message)
    for name, command in answer.commands.items():
        if command is None:
            assert math.isnan(entry[name][1])
            continue
        kind = type(command).__name__
        size = sizes[layout.index(name)]
        if kind == "ThrusterCommand":
            assert entry[name] == (0.0, command.force)
        elif kind == "AzimuthCommand":
            assert entry[name] == (command.angle, command.force)
        elif kind == "RudderCommand":
            assert entry[name] == (command.deflection, size)
        else:
            assert entry[name] == (command.zero_direction, size)
            assert entry[f"{name}/amplitude"] == (command.amplitude, 0.0)
            assert entry[f"{name}/frequency"] == (command.frequency, 0.0)


def test_a_propeller_with_a_rudder_has_its_angle_and_its_thrust_in_one_entry() -> None:
    layout = finlab.Layout("boat", (finlab.PropellerRudder.sample(),), axes=("Fx",))
    states = messages.JointStates(layout)
    assert not states.needs_forces
    message = states.message(np.array([[0.2, 7.0, 0.0]]), None, STAMP)
    assert entries(message) == {"propeller_rudder": (0.2, 7.0)}
    lost = states.message(np.full((1, 3), math.nan), None, STAMP)
    assert math.isnan(entries(lost)["propeller_rudder"][1])


def test_numbers_go_in_and_out_in_order() -> None:
    out = messages.wrench_stamped(range(1, 7), "base_link", STAMP)
    back = messages.wrench_of(out)
    np.testing.assert_array_equal(back.numbers, [1, 2, 3, 4, 5, 6])
    assert back.frame == "base_link" and back.stamp_s == 12.5
    twist = TwistStamped()
    twist.twist.linear.x, twist.twist.angular.z = 1.0, 2.0
    np.testing.assert_array_equal(messages.velocity_of(twist).numbers, [1, 0, 0, 0, 0, 2])
    assert messages.wrench_of(WrenchStamped()).stamp_s == 0.0


def test_samples_of_drives_are_speeds_and_currents_by_name() -> None:
    """What a driver of ESCs leaves out is no number."""
    message = JointState(name=["a", "b"], velocity=[1200.0, -300.0], effort=[2.5])
    message.header.stamp = STAMP
    sample = messages.drives_of(message)
    assert sample.names == ("a", "b") and sample.stamp_s == 12.5
    np.testing.assert_array_equal(sample.speed, [1200.0, -300.0])
    np.testing.assert_array_equal(sample.current, [2.5, math.nan])
    assert messages.pressure_of(FluidPressure(fluid_pressure=2e5)) == (2e5, 0.0)


def test_an_imu_without_an_accelerometer_says_so() -> None:
    message = Imu()
    message.linear_acceleration.z = 9.8
    np.testing.assert_array_equal(messages.imu_of(message).acceleration, [0.0, 0.0, 9.8])
    message.linear_acceleration_covariance[0] = -1.0
    assert np.isnan(messages.imu_of(message).acceleration).all()


def test_arrows_begin_at_the_actuators_and_show_their_forces() -> None:
    layout = finlab.load_layout("bluerov2_heavy")
    forces = finlab.Allocator(layout).allocate([40, 0, 0, 0, 0, 0], lost=["front_left"]).forces
    arrows = messages.arrows(layout, forces, "base_link", STAMP).markers
    assert [arrow.id for arrow in arrows] == list(range(layout.n))
    lost = layout.index("front_left")
    assert arrows[lost].action == Marker.DELETE
    for k, arrow in enumerate(arrows):
        if arrow.action == Marker.DELETE:
            continue
        start, end = (np.array([point.x, point.y, point.z]) for point in arrow.points)
        np.testing.assert_allclose(start, layout.position[k])
        direction = (end - start) / np.linalg.norm(end - start)
        np.testing.assert_allclose(direction, forces[k] / np.linalg.norm(forces[k]), atol=1e-9)
        assert arrow.type == Marker.ARROW and arrow.color.a == 1.0
    assert len({round(arrow.color.r, 6) for arrow in arrows}) > 1


def test_a_report_is_a_status() -> None:
    report = Report("name", WARN, "words", (("a", "1"), ("b", "2")))
    message = messages.diagnostics([report], "robot", STAMP)
    (status,) = message.status
    assert (status.name, status.message, status.hardware_id) == ("name", "words", "robot")
    assert int.from_bytes(status.level, "little") == WARN
    assert [(each.key, each.value) for each in status.values] == [("a", "1"), ("b", "2")]
