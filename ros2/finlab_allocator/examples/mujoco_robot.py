#!/usr/bin/env python3
"""A robot in MuJoCo that loses a thruster, to be commanded by the node.

`mujoco_robot.py [--robot NAME] [--lose THRUSTER] [--at S] [--until S]` writes a shipped layout as a
model of MuJoCo and swims it in real time: it publishes `imu` and `velocity` as sensors do, sends
the `wrench` of a gentle path, and does what `command` says. After a while one thruster gives
nothing any more, which nobody is told. What `status` and `authority` say is printed as it changes.
The node is started by itself, with `robot:=NAME` and `monitor:=true`.
"""

import argparse
import math
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import mujoco
import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped, WrenchStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import Imu, JointState

from finlab.arrays import Array
from finlab.exchange import Exchange, convert
from finlab.layout import Layout
from finlab.swim.vehicle.fossen import complete_body

STEP_S = 0.01
"""A step of MuJoCo [s]."""
PERIOD_S = 0.1
"""Time between wrenches, and between samples of the IMU [s]."""
VELOCITY_EVERY = 2
"""Periods between samples of the velocity log."""
WAIT_S = 20.0
"""How long the node is waited for [s]."""
CURRENT = np.array([0.08, -0.05, 0.0])
"""Velocity of the water in the world [m/s]."""
RATE_NOISE = 0.005
"""Of the gyroscope [rad/s]."""
VELOCITY_NOISE = 0.005
"""Of the velocity log [m/s]."""
TILT_NOISE = 0.005
"""Of roll, pitch and heading [rad]."""
AMPLITUDE = np.array([0.25, 0.2, 0.15, 0.0, 0.0, 0.3])
"""Of the path's velocities [m/s, rad/s]."""
PACE = np.array([0.5, 0.7, 0.6, 0.0, 0.0, 0.8])
"""Of its sines [rad/s]."""
PHASE = np.array([0.0, 1.0, 2.0, 0.0, 0.0, 3.0])
"""Of its sines [rad]."""
GAIN = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 1.5])
"""Acceleration that is asked for, per error of the velocity [1/s]."""


class MujocoRobot:
    """A robot of thrusters in MuJoCo, in water."""

    def __init__(self, robot: str) -> None:
        """Writes the model of a shipped layout, or of a layout file, and loads it."""
        with TemporaryDirectory() as folder:
            path = str(Path(folder) / "robot.xml")
            self.layout: Layout = convert(robot, path, None, Exchange())[0]
            self.model = mujoco.MjModel.from_xml_path(path)
        if any(part.type != "thruster" for part in self.layout.actuators):
            sys.exit(f"{robot}: has more than thrusters, expected a robot such as bluerov2_heavy")
        self.model.opt.timestep = STEP_S
        self.data = mujoco.MjData(self.model)
        body = complete_body(self.layout)
        zeros = (0.0,) * 6
        self.linear = np.array(body.linear_damping or zeros)
        self.quadratic = np.array(body.quadratic_damping or zeros)
        added = np.array(body.added_mass or zeros)
        # MuJoCo's armature stands for the added mass: of a free joint it is along the world's
        # axes, so that both horizontal ones get their mean.
        armature = added.copy()
        armature[:2] = added[:2].mean()
        self.model.dof_armature[:6] = armature
        assert body.mass_kg is not None and body.inertia_kgm2 is not None
        self.mass = np.array([body.mass_kg] * 3 + list(body.inertia_kgm2)) + added
        self.weight = body.mass_kg * 9.81
        self.center_of_buoyancy = np.array(body.center_of_buoyancy_m or (0.0, 0.0, 0.0))
        self.lag_s = np.array(
            [getattr(part, "time_constant", 0.0) for part in self.layout.actuators]
        )
        self.asked = np.zeros(self.layout.n)
        """Forces (n,) [N] that are commanded."""
        self.works = np.ones(self.layout.n)
        """1 of each thruster that pushes, 0 of one that does not (n,)."""

    @property
    def rotation(self) -> Array:
        """From the body frame to the world (3, 3)."""
        matrix = np.zeros(9)
        mujoco.mju_quat2Mat(matrix, self.data.qpos[3:7])
        return matrix.reshape(3, 3)

    @property
    def motion(self) -> Array:
        """Velocity over ground and rates (6,), body frame [m/s, rad/s]."""
        return np.concatenate([self.rotation.T @ self.data.qvel[:3], self.data.qvel[3:6]])

    def step(self) -> None:
        """Swims for a step."""
        rotation = self.rotation
        water = self.motion
        water[:3] -= rotation.T @ CURRENT
        drag = (self.linear + self.quadratic * np.abs(water)) * water
        lift = self.weight * rotation[2]  # of the buoyancy, body frame
        righting = np.cross(self.center_of_buoyancy, lift)
        self.data.qfrc_applied[:3] = -rotation @ drag[:3]
        self.data.qfrc_applied[3:6] = righting - drag[3:]
        share = 1.0 - np.exp(-STEP_S / np.maximum(self.lag_s, 1e-6))
        force = self.data.ctrl + share * (self.asked - self.data.ctrl)
        self.data.ctrl[:] = self.works * force
        mujoco.mj_step(self.model, self.data)


class RobotNode(Node):
    """The robot's sensors and drives, and who sends wrenches."""

    def __init__(self, robot: MujocoRobot) -> None:
        """Prepares its topics."""
        super().__init__("mujoco_robot")
        self.robot = robot
        self.rng = np.random.default_rng(0)
        self.ticks = 0
        self.start_s = math.nan
        """When the node's first answer came, by the computer's clock [s]."""
        self.errors: list[tuple[float, float]] = []
        """Times and errors of the velocity [s, m/s]."""
        self.said: dict[str, str] = {}
        self.imu = self.create_publisher(Imu, "imu", qos_profile_sensor_data)
        self.velocity = self.create_publisher(TwistStamped, "velocity", 1)
        self.wrench = self.create_publisher(WrenchStamped, "wrench", 1)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(JointState, "command", self.on_command, 1)
        self.create_subscription(DiagnosticArray, "status", self.on_status, 10)
        self.create_subscription(DiagnosticArray, "authority", self.on_authority, latched)

    @property
    def now_s(self) -> float:
        """Time since the node's first answer [s]; NaN before."""
        return time.monotonic() - self.start_s

    def tick(self) -> None:
        """Swims for a period; sends samples and a wrench."""
        for _ in range(round(PERIOD_S / STEP_S)):
            self.robot.step()
        stamp = self.get_clock().now().to_msg()
        motion = self.robot.motion
        measured = motion.copy()
        measured[:3] += VELOCITY_NOISE * self.rng.normal(size=3)
        measured[3:] += RATE_NOISE * self.rng.normal(size=3)
        imu = Imu()
        imu.header.frame_id = "base_link"
        imu.header.stamp = stamp
        tilted = self.robot.data.qpos[3:7].copy()
        mujoco.mju_quatIntegrate(tilted, TILT_NOISE * self.rng.normal(size=3), 1.0)
        turn = imu.orientation
        turn.w, turn.x, turn.y, turn.z = tilted.tolist()
        rates = imu.angular_velocity
        rates.x, rates.y, rates.z = measured[3:].tolist()
        self.imu.publish(imu)
        if self.ticks % VELOCITY_EVERY == 0:
            twist = TwistStamped()
            twist.header.frame_id = "base_link"
            twist.header.stamp = stamp
            linear = twist.twist.linear
            linear.x, linear.y, linear.z = measured[:3].tolist()
            self.velocity.publish(twist)
        self.send_wrench(measured)
        self.ticks += 1

    def send_wrench(self, measured: Array) -> None:
        """Sends what the path takes, by the layout's body and the velocity as measured."""
        angle = PACE * PERIOD_S * self.ticks + PHASE
        wanted = AMPLITUDE * np.sin(angle)
        acceleration = AMPLITUDE * PACE * np.cos(angle) + GAIN * (wanted - measured)
        drag = (self.robot.linear + self.robot.quadratic * np.abs(wanted)) * wanted
        numbers = self.robot.mass * acceleration + drag
        numbers[3:5] = 0.0  # it rights itself
        message = WrenchStamped()
        message.header.frame_id = "base_link"
        message.header.stamp = self.get_clock().now().to_msg()
        force = message.wrench.force
        torque = message.wrench.torque
        force.x, force.y, force.z, torque.x, torque.y, torque.z = numbers.tolist()
        self.wrench.publish(message)
        error = float(np.linalg.norm((wanted - self.robot.motion)[:3]))
        self.errors.append((self.now_s, error))

    def on_command(self, message: JointState) -> None:
        """Does what the node commands; a lost thruster has NaN."""
        efforts = dict(zip(message.name, message.effort, strict=True))
        forces = [efforts[name] for name in self.robot.layout.names]
        self.robot.asked = np.nan_to_num(np.array(forces))

    def on_status(self, message: DiagnosticArray) -> None:
        """Prints what the node says of faults, where it says something else."""
        status = message.status[0]
        values = {each.key: each.value for each in status.values}
        if math.isnan(self.start_s) and values["state"] == "answering":
            self.start_s = time.monotonic()
        kinds = {key: value for key, value in values.items() if key.endswith(": kind")}
        kinds |= {"state": values["state"], "unknown": values.get("unknown", "no monitor")}
        if kinds != self.said and not math.isnan(self.start_s):
            self.said = kinds
            self.say(f"status: {values['state']}; {status.message}")

    def on_authority(self, message: DiagnosticArray) -> None:
        """Prints what is left of each axis, where that is not all."""
        for status in message.status:
            share = {each.key: each.value for each in status.values}["share left"]
            if float(share) < 1.0:
                self.say(f"authority: {status.name.split(': ')[1]}: {status.message}")

    def say(self, sentence: str) -> None:
        """Prints a sentence with the time."""
        print(f"{self.now_s:6.1f} s  {sentence}", flush=True)

    def error_between(self, start_s: float, end_s: float) -> float:
        """Root mean square of the velocity's error in a while [m/s]."""
        errors = [error for at_s, error in self.errors if start_s <= at_s < end_s]
        return float(np.sqrt(np.mean(np.square(errors)))) if errors else math.nan


def main() -> int:
    """Swims; 0 where the node has named the thruster, and nothing else."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--robot", default="bluerov2_heavy")
    parser.add_argument("--lose", default="front_left", help="the thruster")
    parser.add_argument("--at", type=float, default=15.0, help="when it is lost [s]")
    parser.add_argument("--until", type=float, default=30.0, help="the end [s]")
    options, of_ros = parser.parse_known_args()
    robot = MujocoRobot(options.robot)
    index = robot.layout.index(options.lose)
    rclpy.init(args=of_ros)
    node = RobotNode(robot)
    begun_s = time.monotonic()
    next_s = begun_s
    while not node.now_s >= options.until:
        if math.isnan(node.start_s) and time.monotonic() - begun_s > WAIT_S:
            sys.exit(f"no node has answered for {WAIT_S:g} s; start it with robot:={options.robot}")
        if node.now_s >= options.at and robot.works[index]:
            robot.works[index] = 0.0
            node.say(f"{options.lose} gives nothing any more")
        node.tick()
        next_s += PERIOD_S
        while (left_s := next_s - time.monotonic()) > 0.0:
            rclpy.spin_once(node, timeout_sec=left_s)
    before = node.error_between(options.at - 5.0, options.at)
    after = node.error_between(options.until - 5.0, options.until)
    print(f"error of the velocity: {before:.3f} m/s before, {after:.3f} m/s at the end")
    named = {key.removesuffix(": kind"): kind for key, kind in node.said.items() if ": kind" in key}
    node.destroy_node()
    rclpy.shutdown()
    return int(named != {options.lose: "lost"})


if __name__ == "__main__":
    sys.exit(main())
