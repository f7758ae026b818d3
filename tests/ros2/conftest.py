"""Nodes in processes of their own, over DDS on the loopback, and one in this process that asks and
listens."""

import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
START_S = 20.0
"""Time in which a node has to answer, on a machine that is busy [s]."""
SLICE_S = 0.02
"""Longest wait at once [s]."""


def own_domain(log: Path) -> dict[str, str]:
    """Environment of processes that hear each other and nobody else, with a folder for logs."""
    folders = [str(ROOT / "ros2" / "finlab_allocator"), str(ROOT)]
    return {
        "ROS_DOMAIN_ID": str(1 + os.getpid() % 100),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_LOG_DIR": str(log),
        "OMP_NUM_THREADS": "1",
        "PYTHONPATH": os.pathsep.join([*folders, os.environ.get("PYTHONPATH", "")]),
    }


class NodeProcess:
    """A node in a process of its own."""

    def __init__(self, *parameters: str, namespace: str = "") -> None:
        """Starts it with parameters such as `robot:=A`."""
        arguments: list[str] = []
        for parameter in parameters:
            arguments += ["-p", parameter]
        if namespace:
            arguments += ["-r", f"__ns:=/{namespace}"]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "finlab_allocator", "--ros-args", *arguments],
            stderr=subprocess.PIPE,
            text=True,
        )

    @property
    def lives(self) -> bool:
        """Whether it has not ended."""
        return self.process.poll() is None

    def end(self, number: int = signal.SIGKILL, wait_s: float = 10.0) -> tuple[int, str]:
        """Sends a signal, and returns the exit code and what was said on standard error."""
        if self.lives:
            self.process.send_signal(number)
        try:
            _, errors = self.process.communicate(timeout=wait_s)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
        return self.process.returncode, errors


class Listener:
    """A node in this process: sends wrenches, keeps what comes."""

    def __init__(self, namespace: str = "") -> None:
        """Subscribes to all that a node of that namespace sends."""
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import WrenchStamped
        from rclpy.qos import DurabilityPolicy, QoSProfile
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Float64
        from visualization_msgs.msg import MarkerArray

        self._rclpy = rclpy
        self._float64 = Float64
        self._wrench_type = WrenchStamped
        latched = QoSProfile(depth=5, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.node = rclpy.create_node("listener", namespace=namespace or None)
        self.commands: list[tuple[float, Any]] = []
        """Commands with the times at which they came."""
        self.status: list[Any] = []
        self.markers: list[Any] = []
        self.authority: list[Any] = []
        self.largest: list[Any] = []
        self.pwm: list[Any] = []
        self.numbers: dict[str, list[float]] = {}
        """Values of topics of single actuators, by the topic."""
        listen = self.node.create_subscription
        listen(JointState, "command", lambda m: self.commands.append((time.monotonic(), m)), 50)
        listen(JointState, "pwm", self.pwm.append, 10)
        listen(DiagnosticArray, "status", self.status.append, 10)
        listen(MarkerArray, "markers", self.markers.append, 10)
        listen(DiagnosticArray, "authority", self.authority.append, latched)
        listen(WrenchStamped, "authority/largest", self.largest.append, latched)
        self.wrenches = self.node.create_publisher(WrenchStamped, "wrench", 50)

    def listen_to(self, topic: str) -> None:
        """Keeps the numbers of a topic."""
        values = self.numbers.setdefault(topic, [])
        self.node.create_subscription(self._float64, topic, lambda m: values.append(m.data), 10)

    def spin(self, seconds: float) -> None:
        """Listens for a time."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self._rclpy.spin_once(self.node, timeout_sec=min(left, SLICE_S))

    def until(self, is_there: Callable[[], bool], seconds: float = START_S) -> bool:
        """Listens until something is there, for a time at most."""
        end = time.monotonic() + seconds
        while not is_there() and time.monotonic() < end:
            self._rclpy.spin_once(self.node, timeout_sec=SLICE_S)
        return is_there()

    def send(self, wrench: Any, frame: str = "base_link", age_s: float = 0.0) -> None:
        """Sends a wrench, with a stamp of that age."""
        message = self._wrench_type()
        message.header.frame_id = frame
        stamp_ns = self.node.get_clock().now().nanoseconds - round(1e9 * age_s)
        message.header.stamp.sec = stamp_ns // 1_000_000_000
        message.header.stamp.nanosec = stamp_ns % 1_000_000_000
        force, torque = message.wrench.force, message.wrench.torque
        force.x, force.y, force.z, torque.x, torque.y, torque.z = (float(w) for w in wrench)
        self.wrenches.publish(message)

    def ask(self, wrench: Any, wait_s: float = 2.0, **given: Any) -> Any:
        """Sends a wrench, and returns the next command; None where none comes in time."""
        before = len(self.commands)
        self.send(wrench, **given)
        if self.until(lambda: len(self.commands) > before, wait_s):
            return self.commands[-1][1]
        return None

    def until_answered(self, wrench: Any = (0, 0, 0, 0, 0, 0)) -> Any:
        """Asks until a node answers, as one that has just been started does after a while."""
        end = time.monotonic() + START_S
        while time.monotonic() < end:
            answer = self.ask(wrench, wait_s=0.25)
            if answer is not None and self.status and self.values["state"] == "answering":
                return answer
        raise AssertionError("no node answers")

    def next_status(self, is_it: Callable[[], bool] = lambda: True) -> Any:
        """Returns the next status that came after now, or the first one of some kind."""
        before = len(self.status)
        assert self.until(lambda: len(self.status) > before and is_it(), 3.0), self.words
        return self.status[-1].status[0]

    @property
    def values(self) -> dict[str, str]:
        """Values of the last status."""
        return {each.key: each.value for each in self.status[-1].status[0].values}

    @property
    def words(self) -> str:
        """The sentence of the last status."""
        return str(self.status[-1].status[0].message) if self.status else ""

    def set(self, **values: Any) -> tuple[bool, str]:
        """Sets parameters of the node together, and returns whether it took them, and why not."""
        from rcl_interfaces.srv import SetParametersAtomically
        from rclpy.parameter import Parameter

        request = SetParametersAtomically.Request()
        for name, value in values.items():
            kind = Parameter.Type.STRING_ARRAY if value == [] else None
            request.parameters.append(Parameter(name, kind, value).to_parameter_msg())
        result = self.call(
            SetParametersAtomically, "finlab_allocator/set_parameters_atomically", request
        ).result
        return result.successful, result.reason

    def call(self, kind: Any, name: str, request: Any) -> Any:
        """Calls a service, and returns what it answers."""
        client = self.node.create_client(kind, name)
        try:
            assert client.wait_for_service(timeout_sec=5.0), name
            future = client.call_async(request)
            assert self.until(future.done, 5.0), name
            return future.result()
        finally:
            self.node.destroy_client(client)


def forces(message: Any, names: tuple[str, ...]) -> np.ndarray:
    """Forces (n,) [N] of actuators in a message `command`."""
    effort = dict(zip(message.name, message.effort, strict=True))
    return np.array([effort.get(name, math.nan) for name in names])


@pytest.fixture(scope="session")
def ros(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """ROS in this process and in those that it starts, in a domain of their own."""
    import rclpy

    with pytest.MonkeyPatch.context() as patch:
        for name, value in own_domain(tmp_path_factory.mktemp("ros_log")).items():
            patch.setenv(name, value)
        rclpy.init()
        yield
        rclpy.shutdown()


@pytest.fixture(scope="module")
def listener(ros: None) -> Iterator[Listener]:
    """A listener without a namespace."""
    own = Listener()
    yield own
    own.node.destroy_node()
