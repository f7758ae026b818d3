#!/usr/bin/env python3
"""Asks a ROS 2 node for many wrenches over DDS, and prints how long it takes for an answer.

`tools/ros_latency.py [ROBOT] [--count N] [--monitor]` starts a node in a process of its own, on the
loopback, sends each wrench when the one before is answered, compares commands with the library's,
and prints the node's own time (from the message in to the last one out), and the round trip.

With `--monitor` a second node has the fault monitor on, and hears the IMU with its accelerometer, a
velocity log, pressures and the drives of a robot that swims in this process as that node commands.
Both nodes are asked by turns, so that whatever else runs on the machine is the same for both. Their
clock is a simulated one, `/clock`, that goes on with each wrench, so that a slow machine gives the
monitor no other motion to judge. The wrenches are then those of a gentle path: random ones would
let the robot tumble, and a monitor takes commands to be in force for a while.
"""

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "ros2" / "finlab_allocator")]

import finlab  # noqa: E402
from finlab.arrays import Array  # noqa: E402
from finlab.layout import Layout  # noqa: E402
from finlab.physics import plant_of  # noqa: E402
from finlab.swim.vehicle import GRAVITY, STATE_SIZE  # noqa: E402
from finlab.swim.vehicle.actuator_motion import ActuatorMotion  # noqa: E402
from finlab.swim.vehicle.vehicle import vehicle_of  # noqa: E402
from tests.ros2.conftest import Listener, NodeProcess, forces, own_domain  # noqa: E402

SHARE = 0.2
"""Standard deviation of the wrenches along each axis, over the robot's scale."""
WATCHING = "watching"
"""Namespace of the node whose monitor is on."""
SENSORS = ("monitor:=true", "accelerometer:=true", "pressure:=true", "drives:=signed")
"""Its parameters."""
SIMULATED_TIME = "use_sim_time:=true"
"""Parameter of both nodes beside a robot that swims."""
AMPLITUDE = np.array([0.25, 0.2, 0.15, 0.0, 0.0, 0.3])
"""Of the velocities of the path, sines [m/s, rad/s]."""
PACE = np.array([0.5, 0.7, 0.6, 0.0, 0.0, 0.8])
"""Of the sines [rad/s]."""
GAIN = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 1.5])
"""Acceleration that is asked for, per error of the velocity [1/s]."""
STEP_S = 0.02
"""A step of the robot that swims, and simulated time between wrenches [s]."""
SAMPLE_STEPS = 5
"""Steps between samples of its sensors."""
START_S = 60.0
"""Longest time in which a node begins to answer [s]."""
DENSITY = 1000.0
"""Of the water [kg/m^3]."""
FULL_SPEED = 3000.0
"""Speed of a drive at its largest force [1/min]."""
FULL_CURRENT = 20.0
"""Its current there [A]."""


class Asked:
    """One node that is asked, and what its answers took."""

    def __init__(self, robot: str, namespace: str = "", parameters: tuple[str, ...] = ()) -> None:
        """Starts the node.

        Args:
            robot: a shipped name or a layout file.
            namespace: of the node; empty for none.
            parameters: more of its parameters.
        """
        self.listener = Listener(namespace)
        self.node = NodeProcess(
            f"robot:={robot}", "watchdog_s:=5.0", *parameters, namespace=namespace
        )
        self.allocator = finlab.Allocator(finlab.load_layout(robot))
        self.command: Any = None
        """The last answer."""
        self.unanswered = 0
        self.largest_difference = 0.0
        """From the library's answers [N]."""
        self._round_trips: list[float] = []
        layout = self.allocator.layout
        self._is_comparable = all(part.KIND.force_number == 0 for part in layout.actuators)

    def ask(self, wrench: Array) -> None:
        """Asks for a wrench (6,), and takes down how long it takes."""
        start = time.perf_counter()
        answer = self.listener.ask(wrench)
        self._round_trips.append(time.perf_counter() - start)
        self.listener.commands.clear()
        if answer is None:
            self.unanswered += 1
            return
        self.command = answer
        if self._is_comparable:
            expected = self.allocator.allocate(wrench).command[:, 0]
            names = self.allocator.layout.names
            difference = np.nan_to_num(np.abs(forces(answer, names) - expected), nan=np.inf)
            self.largest_difference = max(self.largest_difference, float(difference.max()))

    @property
    def is_wrong(self) -> bool:
        """Whether an answer did not come, or was not the library's."""
        return self.unanswered > 0 or self.largest_difference > 1e-6

    def report(self, title: str) -> float:
        """Prints the figures, and returns the 99th percentile of the node's own time [ms]."""
        values = self.listener.values
        print(f"{title}: {len(self._round_trips)} wrenches, {self.unanswered} unanswered")
        if self._is_comparable:
            print(f"  largest difference from the library: {self.largest_difference:.1e} N")
        for what in ("answer time", "processor time"):
            own_p50, own_p99 = values[f"{what} p50 [ms]"], values[f"{what} p99 [ms]"]
            print(f"  node, {what}: p50 {own_p50} ms, p99 {own_p99} ms")
        p50, p99 = 1e3 * np.quantile(self._round_trips, (0.5, 0.99))
        print(f"  round trip: p50 {p50:.3f} ms, p99 {p99:.3f} ms")
        if "found" in values:
            print(f"  the monitor has found: {values['found'] or 'nothing'}")
        return float(values["answer time p99 [ms]"])

    def end(self) -> None:
        """Ends the node."""
        self.node.end()


class SimulatedClock:
    """The time of nodes that take it from `/clock`."""

    def __init__(self, nodes: list[Asked]) -> None:
        """Begins at a second after 0, which counts as no time at all."""
        from rclpy.parameter import Parameter
        from rosgraph_msgs.msg import Clock

        self.now_s = 1.0
        """Now [s]."""
        self._message = Clock()
        for each in nodes:
            each.listener.node.set_parameters([Parameter("use_sim_time", value=True)])
        self._publisher = nodes[0].listener.node.create_publisher(Clock, "/clock", 10)

    def advance(self, seconds: float) -> None:
        """Goes on."""
        self.now_s += seconds
        self._message.clock.sec = int(self.now_s)
        self._message.clock.nanosec = int(1e9 * (self.now_s % 1.0))
        self._publisher.publish(self._message)


class SwimmingRobot:
    """A robot that swims as a node commands, and sends what its sensors say."""

    def __init__(self, asked: Asked) -> None:
        """Puts it at rest, a metre deep.

        Args:
            asked: the node.
        """
        from geometry_msgs.msg import TwistStamped
        from sensor_msgs.msg import FluidPressure, Imu, JointState

        self._asked = asked
        self._layout: Layout = asked.allocator.layout
        self._vehicle = vehicle_of(self._layout)
        self._plant = plant_of(self._layout)
        self._motion = ActuatorMotion(self._layout)
        self._state = np.zeros(STATE_SIZE)
        self._state[2] = -1.0
        self._state[3] = 1.0
        self._specific_force = np.array([0.0, 0.0, GRAVITY])
        self._steps = 0
        self._types = Imu, TwistStamped, FluidPressure, JointState
        publisher = asked.listener.node.create_publisher
        topics = ("imu", "velocity", "pressure", "drives")
        pairs = zip(self._types, topics, strict=True)
        self._publishers = [publisher(kind, topic, 1) for kind, topic in pairs]

    def wrench(self, time_s: float) -> Array:
        """Returns the wrench (6,) that the path takes at a time [s]; the robot rights itself."""
        angle = PACE * time_s
        wanted = AMPLITUDE * np.sin(angle)
        acceleration = AMPLITUDE * PACE * np.cos(angle) + GAIN * (wanted - self._state[7:])
        body = self._vehicle.dynamics
        damping = np.array(body.linear_damping) + np.array(body.quadratic_damping) * np.abs(wanted)
        wrench = np.array(body.inertia) * acceleration + damping * wanted
        wrench[3:5] = 0.0
        return wrench

    def step(self, clock: SimulatedClock) -> None:
        """Swims for a step, and lets the clock go on by it."""
        self._swim()
        self._steps += 1
        is_sampled = self._steps % SAMPLE_STEPS == 0
        if is_sampled:
            self._send_samples(clock.now_s + STEP_S)
        clock.advance(STEP_S)

    def _swim(self) -> None:
        """Swims for a step."""
        command = np.zeros((self._layout.n, 3))
        if self._asked.command is not None:
            command[:, 0] = np.nan_to_num(forces(self._asked.command, self._layout.names))
        self._motion.step(command, STEP_S)
        wrench = self._plant.wrench(self._motion.command)
        rates = self._vehicle.derivative(self._state, wrench)
        velocity, omega = self._state[7:10], self._state[10:]
        up = _rotation(self._state[3:7])[2]
        self._specific_force = rates[7:10] + np.cross(omega, velocity) + GRAVITY * up
        self._state = self._vehicle.step(self._state, wrench, STEP_S)

    def _send_samples(self, now_s: float) -> None:
        """Sends what all sensors say at a time [s]."""
        imu, twist, pressure, drives = (kind() for kind in self._types)
        for message in (imu, twist, pressure, drives):
            message.header.stamp.sec = int(now_s)
            message.header.stamp.nanosec = int(1e9 * (now_s % 1.0))
        imu.header.frame_id = twist.header.frame_id = "base_link"
        turn = imu.orientation
        turn.w, turn.x, turn.y, turn.z = self._state[3:7].tolist()
        _set(imu.linear_acceleration, self._specific_force)
        _set(imu.angular_velocity, self._state[10:])
        _set(twist.twist.linear, self._state[7:10])
        pressure.fluid_pressure = -DENSITY * GRAVITY * float(self._state[2])
        force = self._motion.command[:, 0]
        limit = np.where(force > 0.0, self._layout.upper[:, 0], -self._layout.lower[:, 0])
        share = np.copysign(np.sqrt(np.abs(force) / limit), force)
        drives.name = list(self._layout.names)
        drives.velocity = (FULL_SPEED * share).tolist()
        drives.effort = (FULL_CURRENT * np.abs(share) ** 3).tolist()
        for publisher, message in zip(
            self._publishers, (imu, twist, pressure, drives), strict=True
        ):
            publisher.publish(message)


def _set(vector: Any, values: Array) -> None:
    """Sets x, y, z of a message."""
    vector.x, vector.y, vector.z = values.tolist()


def _rotation(quaternion: Array) -> Array:
    """From the body frame to the world (3, 3)."""
    from finlab.swim.vehicle.attitude import rotation_of_quaternion

    return np.array(rotation_of_quaternion(*quaternion.tolist())).reshape(3, 3).T


def main() -> int:
    """Prints the figures; 1 where an answer differs from the library's, or does not come."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("robot", nargs="?", default="bluerov2_heavy")
    parser.add_argument("--count", type=int, default=10_000, help="wrenches")
    parser.add_argument(
        "--monitor", action="store_true", help="ask a node whose monitor is on, too, by turns"
    )
    options = parser.parse_args()
    layout = finlab.load_layout(options.robot)
    if options.monitor and any(part.type != "thruster" for part in layout.actuators):
        parser.error(f"--monitor: expected a robot of thrusters, got {options.robot}")
    with tempfile.TemporaryDirectory() as logs:
        os.environ.update(own_domain(Path(logs)))
        import rclpy

        rclpy.init()
        nodes: list[Asked] = []
        try:
            if not options.monitor:
                nodes.append(Asked(options.robot))
                return _measure_one(nodes[0], options.robot, options.count)
            nodes.append(Asked(options.robot, parameters=(SIMULATED_TIME,)))
            nodes.append(Asked(options.robot, WATCHING, (SIMULATED_TIME, *SENSORS)))
            return _measure_both(nodes, options.robot, options.count)
        finally:
            for each in nodes:
                each.end()
            rclpy.shutdown()


def _measure_one(node: Asked, robot: str, count: int) -> int:
    """Asks a node for random wrenches, and prints."""
    node.listener.until_answered()
    scale = node.allocator.scale * SHARE
    for wrench in np.random.default_rng(0).normal(size=(count, 6)) * scale:
        node.ask(wrench)
    node.listener.next_status()
    node.report(robot)
    return int(node.is_wrong)


def _measure_both(nodes: list[Asked], robot: str, count: int) -> int:
    """Asks a node whose monitor is off and one whose monitor is on by turns, and prints."""
    plain, watching = nodes
    clock = SimulatedClock(nodes)
    swimmer = SwimmingRobot(watching)
    for each in nodes:
        _until_answered(each, clock)
    start_s = clock.now_s
    for _ in range(count):
        swimmer.step(clock)
        wrench = swimmer.wrench(clock.now_s - start_s)
        for each in nodes:
            each.ask(wrench)
    _until_answered(plain, clock)
    _until_answered(watching, clock)
    p99 = plain.report(f"{robot}, monitor off")
    p99_watching = watching.report(f"{robot}, monitor on")
    print(f"p99 of the node's own time, with the monitor over without: {p99_watching / p99:.2f}")
    return int(plain.is_wrong or watching.unanswered > 0)


def _until_answered(asked: Asked, clock: SimulatedClock) -> None:
    """Asks for nothing until a node answers and has sent a new status of it."""
    end_s = time.monotonic() + START_S
    asked.listener.status.clear()
    while time.monotonic() < end_s:
        clock.advance(STEP_S)
        answer = asked.listener.ask(np.zeros(6), wait_s=0.25)
        is_said = answer is not None and len(asked.listener.status) > 0
        if is_said and asked.listener.values["state"] == "answering":
            return
    raise SystemExit(f"no node answers for {START_S:g} s")


if __name__ == "__main__":
    sys.exit(main())
