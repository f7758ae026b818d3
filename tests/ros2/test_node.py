"""The node in a process of its own, asked over DDS."""

import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.deploy.bundle import make_bundle
from tests.ros2.conftest import Listener, NodeProcess, forces

pytest.importorskip("rclpy", reason="rclpy is not installed: no wheel for this Python or machine")

ROBOT = "bluerov2_heavy"
PUSH = (20.0, 0.0, 5.0, 0.0, 0.0, 1.0)
"""A wrench within reach of it."""
WATCHDOG_S = 0.3


@pytest.fixture(scope="module")
def layout() -> finlab.Layout:
    """Its layout."""
    return finlab.load_layout(ROBOT)


@pytest.fixture(scope="module")
def allocator(layout: finlab.Layout) -> finlab.Allocator:
    """The library, which says what is right."""
    return finlab.Allocator(layout)


@pytest.fixture(scope="module")
def process(listener: Listener) -> Iterator[NodeProcess]:
    """One node for most tests."""
    started = NodeProcess(f"robot:={ROBOT}", f"watchdog_s:={WATCHDOG_S}", "policy:=direction")
    listener.until_answered()
    yield started
    started.end()


@pytest.fixture
def node(process: NodeProcess, listener: Listener) -> Iterator[NodeProcess]:
    """The same, which answers before a test and after it."""
    yield process
    assert process.lives, process.end()[1]
    assert listener.ask(PUSH) is not None


def test_commands_are_those_of_the_library(
    node: NodeProcess, listener: Listener, allocator: finlab.Allocator, layout: finlab.Layout
) -> None:
    scale = allocator.scale
    rng = np.random.default_rng(4)
    for wrench in rng.normal(size=(100, 6)) * scale * 0.4:
        answer = listener.ask(wrench)
        expected = allocator.allocate(wrench, policy="direction").command[:, 0]
        np.testing.assert_allclose(forces(answer, layout.names), expected, atol=1e-6)
    assert len(answer.position) == len(answer.name) == len(answer.effort) == layout.n
    assert answer.header.stamp.sec > 0


def test_each_actuator_has_a_topic(
    node: NodeProcess, listener: Listener, layout: finlab.Layout
) -> None:
    for name in layout.names:
        listener.listen_to(f"{name}/force")
    heard = listener.numbers.values
    assert listener.until(lambda: listener.ask(PUSH) is not None and all(heard()))
    listener.spin(0.1)
    values = [listener.numbers[f"{name}/force"][-1] for name in layout.names]
    np.testing.assert_array_equal(values, forces(listener.commands[-1][1], layout.names))


def test_silence_leads_to_neutral(
    node: NodeProcess, listener: Listener, layout: finlab.Layout
) -> None:
    listener.ask(PUSH)
    sent_at = listener.commands[-1][0]
    assert listener.until(lambda: listener.commands[-1][0] > sent_at, 2.0)
    at, command = next(each for each in listener.commands if each[0] > sent_at)
    assert not forces(command, layout.names).any()
    assert at - sent_at + 0.02 >= WATCHDOG_S and at - sent_at < 2 * WATCHDOG_S
    status = listener.next_status(lambda: listener.values["state"] == "silent")
    assert int.from_bytes(status.level, "little") == 1


@pytest.mark.parametrize(
    ("wrench", "given", "words"),
    [
        ((1.0, math.nan, 0, 0, 0, 0), {}, "Fy is NaN"),
        ((1.0, math.inf, 0, 0, 0, 0), {}, "Fy is infinite"),
        ((1e300, 0, 0, 0, 0, 0), {}, "Fx must be a number of at most"),
        (PUSH, {"frame": "map"}, "frame 'map': no static transform leads from it to 'base_link'"),
        (PUSH, {"frame": "\n\u2028" + 300 * "å"}, "no static transform"),
        (PUSH, {"age_s": 5.0}, "s old, expected at most watchdog_s = 0.3 s"),
        (PUSH, {"age_s": -5.0}, "s ahead of this computer's clock"),
    ],
)
def test_a_refused_wrench_commands_nothing(
    wrench: Any, given: dict[str, Any], words: str, node: NodeProcess, listener: Listener
) -> None:
    listener.ask(PUSH)
    listener.spin(0.1)  # what comes late from before
    before = len(listener.commands)
    listener.send(wrench, **given)
    status = listener.next_status(lambda: words in listener.words)
    assert int.from_bytes(status.level, "little") == 1 and listener.values["last refusal"]
    for _, command in listener.commands[before:]:
        assert not np.any(command.effort), "only neutral, by the watchdog"


def test_parameters_change_under_way(
    node: NodeProcess, listener: Listener, allocator: finlab.Allocator, layout: finlab.Layout
) -> None:
    assert listener.set(lost=["front_left"], free=["Ty"]) == (True, "")
    answer = listener.ask(PUSH)
    expected = allocator.allocate(PUSH, lost=["front_left"], free=("Ty",)).command[:, 0]
    np.testing.assert_allclose(forces(answer, layout.names), expected, atol=1e-6)
    ok, reason = listener.set(lost=["nobody"], free=[])
    assert not ok and reason.startswith("lost: layout bluerov2_heavy has no actuator 'nobody'")
    assert listener.set(lost=[], free=[]) == (True, "")
    for name, value in (("policy", "best"), ("period_s", 0.0), ("nan", 1), ("robot", "nowhere")):
        ok, reason = listener.set(**{name: value})
        assert not ok and reason, name
    answer = listener.ask(PUSH)
    expected = allocator.allocate(PUSH).command[:, 0]
    np.testing.assert_allclose(forces(answer, layout.names), expected, atol=1e-6)


def test_nan_may_free_its_axis(
    node: NodeProcess, listener: Listener, allocator: finlab.Allocator, layout: finlab.Layout
) -> None:
    assert listener.set(nan="free")[0]
    answer = listener.ask([20, 0, 5, math.nan, 0, 1])
    expected = allocator.allocate([20, 0, 5, 0, 0, 1], free=("Tx",)).command[:, 0]
    np.testing.assert_allclose(forces(answer, layout.names), expected, atol=1e-6)
    assert listener.set(nan="refuse")[0]


def test_authority_and_arrows(node: NodeProcess, listener: Listener, layout: finlab.Layout) -> None:
    assert listener.until(lambda: len(listener.authority) > 0 and len(listener.largest) > 0)
    whole = listener.largest[-1].wrench.force.x
    before = len(listener.largest)
    assert listener.set(lost=["front_left"])[0]
    assert listener.until(lambda: len(listener.largest) > before)
    assert 0.0 < listener.largest[-1].wrench.force.x < whole
    listener.spin(0.1)
    surge = listener.authority[-1].status[0]
    assert "Fx" in surge.name and "% is left" in surge.message
    assert listener.set(lost=[])[0]
    listener.markers.clear()
    for _ in range(8):
        listener.ask(PUSH)
        listener.spin(0.05)
    assert listener.until(lambda: len(listener.markers) > 0)
    arrows = listener.markers[-1].markers
    assert len(arrows) == layout.n and {each.header.frame_id for each in arrows} == {"base_link"}
    drawn = [each for each in arrows if each.action == each.ADD]
    assert drawn and all(len(each.points) == 2 for each in drawn)


def test_garbage_on_the_wire_is_survived(node: NodeProcess, listener: Listener) -> None:
    from geometry_msgs.msg import WrenchStamped
    from rclpy.serialization import serialize_message

    message = WrenchStamped()
    message.header.frame_id = "base_link"
    good = serialize_message(message)
    rng = np.random.default_rng(5)
    for k in range(30):
        raw = bytearray(good)
        if k % 3 == 0:
            raw = raw[: rng.integers(4, len(raw))]
        else:
            for place in rng.integers(4, len(raw), size=8):
                raw[place] = rng.integers(256)
        listener.wrenches.publish(bytes(raw))
        listener.spin(0.005)
    assert node.lives


def test_200_hz_and_a_flood(
    node: NodeProcess, listener: Listener, allocator: finlab.Allocator, layout: finlab.Layout
) -> None:
    sent = np.zeros((200, 6))
    sent[:, 0] = np.linspace(5.0, 45.0, 200)
    expected = allocator.allocate_batch(sent).command[:, :, 0]
    before = len(listener.commands)
    for wrench in sent:
        listener.send(wrench)
        listener.spin(0.005)
    listener.spin(0.1)
    answered: list[int] = []
    for _, command in listener.commands[before:]:
        differences = np.abs(expected - forces(command, layout.names)).max(axis=1)
        if differences.min() < 1e-6:
            answered.append(int(differences.argmin()))
    # On a busy machine some were replaced by newer ones before they were looked at.
    assert len(answered) > 40 and answered == sorted(set(answered))
    rng = np.random.default_rng(6)
    for _ in range(500):
        listener.send(rng.normal(size=6))
    listener.send([30, 0, 0, 0, 0, 0])
    newest = allocator.allocate([30, 0, 0, 0, 0, 0]).command[:, 0]

    def is_answered() -> bool:
        last = [forces(command, layout.names) for _, command in listener.commands[-50:]]
        return any(np.allclose(each, newest, atol=1e-6) for each in last)

    assert listener.until(is_answered, 2.0)


def test_the_sender_is_killed(node: NodeProcess, listener: Listener, layout: finlab.Layout) -> None:
    program = (
        "import rclpy, time\n"
        "from geometry_msgs.msg import WrenchStamped\n"
        "rclpy.init(); node = rclpy.create_node('sender')\n"
        "out = node.create_publisher(WrenchStamped, 'wrench', 1); m = WrenchStamped()\n"
        "m.wrench.force.x = 25.0\n"
        "while True: out.publish(m); time.sleep(0.02)\n"
    )
    sender = subprocess.Popen([sys.executable, "-c", program])
    try:
        before = len(listener.commands)

        def pushes() -> bool:
            return len(listener.commands) > before + 5 and any(listener.commands[-1][1].effort)

        assert listener.until(pushes)
    finally:
        sender.send_signal(signal.SIGKILL)
        sender.wait()
    killed_at = time.monotonic()
    assert listener.until(lambda: not any(listener.commands[-1][1].effort), 3.0)
    assert listener.commands[-1][0] - killed_at < WATCHDOG_S + 1.0


def test_lifecycle(node: NodeProcess, listener: Listener) -> None:
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    def change(transition: int) -> bool:
        request = ChangeState.Request(transition=Transition(id=transition))
        return bool(listener.call(ChangeState, "finlab_allocator/change_state", request).success)

    listener.ask(PUSH)
    assert change(Transition.TRANSITION_DEACTIVATE)
    listener.until(lambda: not any(listener.commands[-1][1].effort), 2.0)
    before = len(listener.commands)
    for _ in range(5):
        listener.send(PUSH)
        listener.spin(0.05)
    assert not any(any(command.effort) for _, command in listener.commands[before:])
    listener.next_status(lambda: listener.values["state"] == "inactive")
    assert change(Transition.TRANSITION_CLEANUP)
    assert listener.set(robot="nowhere")[0], "it is read when the node is configured"
    assert not change(Transition.TRANSITION_CONFIGURE)
    assert listener.set(robot=ROBOT)[0]
    assert change(Transition.TRANSITION_CONFIGURE) and change(Transition.TRANSITION_ACTIVATE)
    assert listener.until(lambda: listener.ask(PUSH, wait_s=0.2) is not None)


def test_another_robot_under_way(
    node: NodeProcess, listener: Listener, layout: finlab.Layout
) -> None:
    listener.ask(PUSH)
    assert listener.set(robot="turtle_hybrid")[0]

    def last_of_old() -> np.ndarray:
        old = [m for _, m in listener.commands if set(m.name) == set(layout.names)]
        return forces(old[-1], layout.names)

    assert listener.until(lambda: not last_of_old().any(), 3.0), "the old robot is left at neutral"
    wrench = [1.0, 0, 20.0, 0, 0, 0.1]
    answer = listener.ask(wrench)
    while set(answer.name) == set(layout.names):
        answer = listener.ask(wrench)
    hybrid = finlab.load_layout("turtle_hybrid")
    assert answer.name[: hybrid.n] == list(hybrid.names)
    numbers = dict(zip(answer.name, answer.position, strict=True))
    assert 0.0 < numbers["front_right/amplitude"] <= hybrid.upper[0, 0]
    assert 0.0 < numbers["front_right/frequency"] <= hybrid.upper[0, 1]
    assert abs(numbers["front_right"]) <= math.pi
    assert listener.set(robot=ROBOT)[0]
    assert listener.until(lambda: set(listener.ask(PUSH).name) == set(layout.names))


def test_the_monitor_hears_the_imu(node: NodeProcess, listener: Listener) -> None:
    from sensor_msgs.msg import Imu

    assert listener.set(monitor=True)[0]
    listener.next_status(lambda: "no sample of the IMU yet" in listener.words)
    publisher = listener.node.create_publisher(Imu, "imu", 10)
    sample = Imu()
    sample.header.frame_id = "base_link"

    def is_heard() -> bool:
        publisher.publish(sample)
        listener.ask([0] * 6, wait_s=0.05)
        return "found" in listener.values and "sample of the IMU" not in listener.words

    assert listener.until(is_heard)
    sample.orientation.w = 0.0
    publisher.publish(sample)
    assert listener.until(lambda: "imu: expected finite rates" in listener.values["last refusal"])
    assert listener.set(monitor=False)[0]
    listener.next_status(lambda: "found" not in listener.values)
    listener.node.destroy_publisher(publisher)


def test_the_monitor_hears_pressures_and_drives(node: NodeProcess, listener: Listener) -> None:
    """On topics that are there where parameters say so; what is wrong with a sample is said."""
    from sensor_msgs.msg import FluidPressure, JointState

    subscribers = listener.node.count_subscribers
    assert not subscribers("pressure") and not subscribers("drives")
    assert listener.set(monitor=True, pressure=True, drives="signed")[0]
    no_sample = "the monitor has no sample of the pressure yet; the monitor has no sample of the"
    listener.next_status(lambda: f"{no_sample} drives yet" in listener.words)
    pressures = listener.node.create_publisher(FluidPressure, "pressure", 10)
    drives = listener.node.create_publisher(JointState, "drives", 10)
    pressure = FluidPressure(fluid_pressure=29430.0)
    telemetry = JointState(name=["front_left", "rear_right"], velocity=[900.0, -700.0])
    telemetry.effort = [1.5, 1.2]

    def said(key: str, value: str) -> bool:
        """Sends both, and a wrench, and looks."""
        pressures.publish(pressure)
        drives.publish(telemetry)
        listener.ask([0] * 6, wait_s=0.05)
        return value in listener.values.get(key, "")

    assert listener.until(lambda: said("depth [m]", "3.000"))
    assert listener.until(lambda: said("drives heard", "front_left, rear_right"))
    assert "the pressure yet" not in listener.words and "the drives yet" not in listener.words
    telemetry.header.stamp = (listener.node.get_clock().now()).to_msg()
    telemetry.header.stamp.sec -= 60
    assert listener.until(lambda: said("last refusal", "drives: its stamp is 6"))
    telemetry = JointState(name=["bow"], velocity=[1.0], effort=[1.0])
    assert listener.until(lambda: said("last refusal", "drives: no actuator 'bow', expected names"))
    telemetry = JointState()
    pressure.fluid_pressure = math.nan
    assert listener.until(lambda: said("last refusal", "pressure: expected a finite number of Pa"))
    assert listener.values["depth [m]"] == "3.000", "a bad sample changes nothing"

    assert listener.set(pressure=False, drives="off")[0]
    assert listener.until(lambda: not subscribers("pressure") and not subscribers("drives"))
    listener.next_status(lambda: "depth [m]" not in listener.values)
    assert listener.set(monitor=False)[0]
    for publisher in (pressures, drives):
        listener.node.destroy_publisher(publisher)


def test_a_second_node_is_told_of(node: NodeProcess, listener: Listener) -> None:
    """Then SIGTERM ends it with a neutral command."""
    second_robot = finlab.load_layout("A")
    second = NodeProcess("robot:=A")
    of_second: list[dict[str, float]] = []

    def is_heard() -> bool:
        if second.lives:
            listener.send([1.0, 0, 0, 0, 0, 0])
        for _, message in listener.commands:
            if message.name[: second_robot.n] == list(second_robot.names):
                of_second.append(dict(zip(message.name, message.position, strict=True)))
        listener.commands.clear()
        return "1 more publish /command" in listener.words and len(of_second) > 0

    try:
        listener.commands.clear()
        assert listener.until(is_heard)
        assert "namespace of its own" in listener.words
        of_second.clear()
        code, errors = second.end(signal.SIGTERM)
        assert code == 0, errors
    finally:
        second.process.kill()
    listener.next_status(lambda: "1 more" not in listener.words)
    listener.spin(0.3)  # each spin takes one message, and some have waited
    is_heard()
    for name in second_robot.names:
        assert of_second[-1][f"{name}/amplitude"] == second_robot.lower[0, 0]


def test_a_bundle_its_end_and_a_start_in_three_seconds(ros: None, tmp_path: Path) -> None:
    """In a namespace, beside the other node: a bundle is answered from, may go while the node runs,
    and a node that is to begin without it says so."""
    folder = tmp_path / "robot"
    layout = finlab.load_layout("bluerov2")  # whose thrusters have a table
    make_bundle(finlab.Allocator(layout)).write(folder)
    own = Listener("auv")
    start = time.monotonic()
    first = NodeProcess(f"robot:={folder}", namespace="auv")
    try:
        own.until_answered()
        seconds = time.monotonic() - start
        lost = layout.names[0]
        assert own.set(lost=[lost])[0]
        own.ask([10, 0, 0, 0, 0, 0])
        own.spin(0.1)
        inputs = dict(zip(own.pwm[-1].name, own.pwm[-1].position, strict=True))
        assert set(inputs) == set(layout.names) and inputs.pop(lost) == pytest.approx(1500, abs=20)
        sent = dict(zip(own.commands[-1][1].name, own.commands[-1][1].effort, strict=True))
        for name, value in inputs.items():
            command = layout.actuator(name).command(np.array([sent[name], 0.0, 0.0]))
            assert value == command.input, name
        assert len({round(value) for value in inputs.values()}) > 2
        for file in sorted(folder.rglob("*"), reverse=True):
            file.unlink() if file.is_file() else file.rmdir()
        folder.rmdir()
        assert own.ask([12, 0, 0, 0, 0, 0]) is not None
        own.ask([10, 0, 0, 0, 0, 0])
        code, errors = first.end(signal.SIGINT)
        own.spin(0.2)
        assert code == 0, errors
        assert not np.nan_to_num(own.commands[-1][1].effort).any()
        again = NodeProcess(f"robot:={folder}", namespace="auv")
        code, errors = again.end(signal.SIGCONT, wait_s=15.0)
        assert code == 2 and "robot" in errors and "Traceback" not in errors
    finally:
        first.process.kill()
        own.node.destroy_node()
    assert seconds < 3.0 or os.getloadavg()[0] > os.cpu_count(), f"{seconds:.1f} s"
