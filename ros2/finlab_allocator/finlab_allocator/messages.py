"""Messages of ROS from values, and values from messages."""

import math
from collections.abc import Sequence

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, TwistStamped, Vector3, WrenchStamped
from sensor_msgs.msg import FluidPressure, Imu, JointState
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from finlab.arrays import Array
from finlab.layout import Layout
from finlab_allocator.input_checks import NO_STAMP, DriveSample, ImuSample, StampedInput
from finlab_allocator.status_report import Report
from finlab_allocator.topics import number_names

ARROW_SHARE = 0.6
"""Length of the arrow of the largest force, over the size of the robot."""
LEAST_SIZE_M = 0.1
"""Size that a robot has at least, for its arrows [m]."""
LEAST_ARROW = 1e-3
"""Share of the largest force below which no arrow is drawn."""


def wrench_of(message: WrenchStamped) -> StampedInput:
    """Returns a wrench as the node takes it."""
    return _stamped(message.header, message.wrench.force, message.wrench.torque)


def velocity_of(message: TwistStamped) -> StampedInput:
    """Returns a velocity as the node takes it."""
    return _stamped(message.header, message.twist.linear, message.twist.angular)


def imu_of(message: Imu) -> ImuSample:
    """Returns a sample as the node takes it."""
    rates = message.angular_velocity
    turn = message.orientation
    orientation = np.array([turn.x, turn.y, turn.z, turn.w])
    if message.orientation_covariance[0] < 0.0:  # by sensor_msgs: it has none
        orientation[:] = 0.0
    force = message.linear_acceleration
    acceleration = np.array([force.x, force.y, force.z])
    if message.linear_acceleration_covariance[0] < 0.0:
        acceleration[:] = math.nan
    return ImuSample(
        np.array([rates.x, rates.y, rates.z]),
        orientation,
        message.header.frame_id,
        _stamp_s(message.header),
        acceleration,
    )


def drives_of(message: JointState) -> DriveSample:
    """Returns what drives say as the node takes it: `velocity` are speeds, `effort` currents; those
    that are missing are NaN."""
    n = len(message.name)
    return DriveSample(
        tuple(message.name),
        _padded(message.velocity, n),
        _padded(message.effort, n),
        _stamp_s(message.header),
    )


def pressure_of(message: FluidPressure) -> tuple[float, float]:
    """Returns a pressure [Pa] and its stamp [s]."""
    return float(message.fluid_pressure), _stamp_s(message.header)


def _padded(numbers: Sequence[float], n: int) -> Array:
    """The first n of some numbers, NaN where there are fewer."""
    result = np.full(n, math.nan)
    given = np.asarray(numbers[:n], float)
    result[: len(given)] = given
    return result


def _stamp_s(header: Header) -> float:
    """The stamp of a message [s]; `NO_STAMP` where it has none."""
    stamp_s = float(header.stamp.sec) + 1e-9 * float(header.stamp.nanosec)
    return stamp_s if stamp_s else NO_STAMP


def _stamped(header: Header, first: Vector3, second: Vector3) -> StampedInput:
    """Six numbers with their frame and stamp."""
    numbers = np.array([first.x, first.y, first.z, second.x, second.y, second.z])
    return StampedInput(numbers, header.frame_id, _stamp_s(header))


def wrench_stamped(wrench: Sequence[float], frame: str, stamp: Time) -> WrenchStamped:
    """Returns a wrench (6,) [N, N m] as a message."""
    message = WrenchStamped()
    message.header.frame_id = frame
    message.header.stamp = stamp
    numbers = [float(value) for value in wrench]
    message.wrench.force = Vector3(x=numbers[0], y=numbers[1], z=numbers[2])
    message.wrench.torque = Vector3(x=numbers[3], y=numbers[4], z=numbers[5])
    return message


class JointStates:
    """Makes the message `command` of a robot.

    An entry for each actuator, by its name: `effort` is its force [N], along the axis of a
    thruster, of kinds whose command holds no force its size; NaN for a lost one. `position` is
    its angle [rad], 0 of what does not turn. What else its command holds is in entries of its
    own, such as `NAME/frequency`, whose `position` is the number.
    """

    def __init__(self, layout: Layout) -> None:
        """Prepares the entries of a robot."""
        self._names: list[str] = list(layout.names)
        self._forces: list[int | None] = []
        self._angles: list[int | None] = []
        self._extra: list[tuple[int, int]] = []
        for index, actuator in enumerate(layout.actuators):
            kind = actuator.KIND
            angle = kind.aiming_number
            if angle is None and kind.sticks_at_angle:
                angle = kind.stuck_number  # a rudder's deflection, with a propeller or without
            self._forces.append(kind.force_number)
            self._angles.append(angle)
            for number, name in enumerate(number_names(actuator)):
                if number not in (kind.force_number, angle):
                    self._names.append(f"{actuator.name}/{name}")
                    self._extra.append((index, number))

    @property
    def needs_forces(self) -> bool:
        """Whether a command does not hold the force of each actuator."""
        return None in self._forces

    def message(self, command: Array, sizes: Array | None, stamp: Time) -> JointState:
        """Returns the message of a command.

        Args:
            command: (n, 3), NaN for lost actuators.
            sizes: size of each force (n,) [N]; None where no force is needed.
            stamp: time of the message.
        """
        rows = command.tolist()
        effort: list[float] = []
        position: list[float] = []
        for index, row in enumerate(rows):
            number = self._forces[index]
            angle = self._angles[index]
            if number is not None:
                effort.append(row[number])
            elif math.isnan(row[0]) or sizes is None:
                effort.append(math.nan)
            else:
                effort.append(float(sizes[index]))
            position.append(0.0 if angle is None else row[angle])
        for index, number in self._extra:
            position.append(rows[index][number])
            effort.append(0.0)
        message = JointState(name=self._names, position=position, effort=effort)
        message.header.stamp = stamp
        return message


def inputs_message(names: Sequence[str], inputs: Sequence[float], stamp: Time) -> JointState:
    """Returns the message `pwm`: inputs by the tables of thrust, in their unit, as `position`.

    Args:
        names: of the actuators that have a table.
        inputs: theirs.
        stamp: time of the message.
    """
    message = JointState(name=list(names), position=list(inputs))
    message.header.stamp = stamp
    return message


def diagnostics(reports: Sequence[Report], hardware: str, stamp: Time) -> DiagnosticArray:
    """Returns reports as a message.

    Args:
        reports: one for each status.
        hardware: name of the robot.
        stamp: time of the message.
    """
    message = DiagnosticArray()
    message.header.stamp = stamp
    for report in reports:
        status = DiagnosticStatus()
        status.level = bytes([report.level])
        status.name = report.name
        status.message = report.message
        status.hardware_id = hardware
        status.values = [KeyValue(key=key, value=value) for key, value in report.values]
        message.status.append(status)
    return message


def arrows(layout: Layout, forces: Array, frame: str, stamp: Time) -> MarkerArray:
    """Returns an arrow for each actuator, from where it pushes along its force; one that does not
    push has its arrow deleted. Green at no force, red at the largest of the robot.

    Args:
        layout: the robot of n actuators.
        forces: (n, 3) [N], in the robot's frame.
        frame: name of that frame.
        stamp: time of the message.
    """
    position = layout.position
    size_m = max(float(np.ptp(position, axis=0).max()), LEAST_SIZE_M)
    largest = max(actuator.largest(1.0) for actuator in layout.actuators)
    message = MarkerArray()
    for index, (start, force) in enumerate(zip(position, forces, strict=True)):
        share = float(np.linalg.norm(force)) / max(largest, 1e-9)
        marker = Marker(ns="thrust", id=index, type=Marker.ARROW)
        marker.header.frame_id = frame
        marker.header.stamp = stamp
        marker.action = Marker.ADD if share > LEAST_ARROW else Marker.DELETE
        end = start + force * (ARROW_SHARE * size_m / max(largest, 1e-9))
        marker.points = [_point(start), _point(end)]
        shaft_m = 0.02 * size_m
        marker.scale = Vector3(x=shaft_m, y=2.0 * shaft_m, z=3.0 * shaft_m)
        marker.pose.orientation.w = 1.0
        red = min(share, 1.0)
        marker.color = ColorRGBA(r=red, g=1.0 - red, b=0.1, a=1.0)
        message.markers.append(marker)
    return message


def _point(place: Array) -> Point:
    x, y, z = place.tolist()
    return Point(x=x, y=y, z=z)
