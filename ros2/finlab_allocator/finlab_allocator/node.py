"""The node: turns messages into calls of `Commander`, and what it answers into messages.

It is a lifecycle node. Unconfigured it has no robot, inactive it keeps the robot at neutral, active
it answers. With `autostart` it goes there by itself.
"""

import math
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped, WrenchStamped
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import FluidPressure, Imu, JointState
from std_msgs.msg import Float64
from visualization_msgs.msg import MarkerArray

from finlab.actuators.actuator import Actuator
from finlab.arrays import Array
from finlab.deploy.command_stream import unanswered
from finlab.errors import FinlabError
from finlab.physics.plant import plant_of
from finlab_allocator import messages
from finlab_allocator.commander import Commander, Sent
from finlab_allocator.frames import StaticFrames
from finlab_allocator.parameters import Parameters, descriptions
from finlab_allocator.status_report import AuthorityLeft, status_report
from finlab_allocator.topics import NumberTopic, number_topics, values_to_send

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # not every installation has it; frames other than the robot's are then refused
    TFMessage = None

NODE_NAME = "finlab_allocator"
"""Name of the node."""
STATUS_S = 0.2
"""Period of `status` and `markers` [s]."""
WATCHDOG_TICKS = 4
"""How often silence is looked for within `watchdog_s`."""
ACKNOWLEDGED_S = 0.5
"""Time that the last commands are given to arrive [s]."""
NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
"""Of wrenches: the newest alone counts."""
NEWEST_OF_SENSOR = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Of samples of the IMU."""
LATCHED = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
"""Of what seldom changes: a late subscriber gets the last message."""
ALL_FRAMES = QoSProfile(
    depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
"""Of `/tf_static`, as tf2 publishes it."""


class RobotTopics:
    """The publishers of one robot's commands."""

    def __init__(self, node: LifecycleNode, commander: Commander) -> None:
        """Makes them."""
        self._node = node
        self.layout = commander.layout
        self._plant = plant_of(commander.layout)
        self._joint_states = messages.JointStates(self.layout)
        self._with_table = [
            index
            for index, actuator in enumerate(self.layout.actuators)
            if _input(actuator, actuator.neutral()) is not None
        ]
        self._numbers: list[tuple[NumberTopic, Any]] = [
            (topic, node.create_publisher(Float64, topic.name, 1))
            for topic in number_topics(self.layout)
        ]
        self._pwm = node.create_publisher(JointState, "pwm", 1) if self._with_table else None
        self.command = node.create_publisher(JointState, "command", 10)
        """Publishes all commands in one message."""

    def publish(self, command: Array) -> None:
        """Sends commands (n, 3), NaN for lost actuators."""
        stamp = self._node.get_clock().now().to_msg()
        sent = values_to_send(self.layout, command)
        sizes: Array | None = None
        if self._joint_states.needs_forces:
            sizes = np.linalg.norm(self.forces(command), axis=1)
        self.command.publish(self._joint_states.message(command, sizes, stamp))
        for topic, publisher in self._numbers:
            if topic.number is None:
                value = 0.0 if sizes is None else float(sizes[topic.actuator])
            else:
                value = float(sent[topic.actuator, topic.number])
            if not math.isnan(value):  # the angle of a lost one is not sent
                publisher.publish(Float64(data=value))
        if self._pwm is not None:
            names: list[str] = []
            inputs: list[float] = []
            for index in self._with_table:
                actuator = self.layout.actuators[index]
                names.append(actuator.name)
                inputs.append(_input(actuator, sent[index]) or 0.0)
            self._pwm.publish(messages.inputs_message(names, inputs, stamp))

    def forces(self, command: Array) -> Array:
        """Returns the forces (n, 3) [N] of commands (n, 3), body frame; 0 of lost actuators."""
        is_lost = np.asarray(np.isnan(command).any(axis=1))
        forces = self._plant.body_forces(np.nan_to_num(command))
        return np.where(is_lost[:, None], 0.0, forces)

    def flush(self) -> None:
        """Waits until what was sent has arrived, for `ACKNOWLEDGED_S` at most."""
        end_s = time.monotonic() + ACKNOWLEDGED_S
        for publisher in self._publishers():
            left_s = max(end_s - time.monotonic(), 0.0)
            publisher.wait_for_all_acked(Duration(seconds=left_s))

    def destroy(self) -> None:
        """Takes the publishers away, once what they have sent has arrived."""
        self.flush()
        for publisher in self._publishers():
            self._node.destroy_publisher(publisher)

    def _publishers(self) -> list[Any]:
        """All of them, that of all commands first."""
        publishers = [self.command, *(publisher for _, publisher in self._numbers)]
        if self._pwm is not None:
            publishers.append(self._pwm)
        return publishers


def _input(actuator: Actuator, row: Array) -> float | None:
    """The input for a command (3,) by the actuator's table; None of one without."""
    command = actuator.command(np.nan_to_num(row))
    value = getattr(command, "input", None)
    return None if value is None else float(value)


class AllocatorNode(LifecycleNode):
    """See above."""

    def __init__(self, **options: Any) -> None:
        """Declares the parameters; the robot is read when the node is configured.

        Args:
            **options: of `rclpy.node.Node`.

        Raises:
            FinlabError: a parameter has a value that is not acceptable.
        """
        super().__init__(NODE_NAME, **options)
        self.commander: Commander | None = None
        """What commands the robot; None while unconfigured."""
        self._robot_topics: RobotTopics | None = None
        self._watchdog: Any = None
        self._sensors: list[Any] = []
        self._watch_timer: Any = None
        self._authority_of: object = None
        self.frames = StaticFrames()
        """Static transforms that are known."""
        self.settings = Parameters().changed(self._declared())
        """Values of all parameters while there is no commander, which then has them."""
        self._is_simulated = bool(self.get_parameter("use_sim_time").value)
        self._timer_clock = (
            self.get_clock() if self._is_simulated else Clock(clock_type=ClockType.STEADY_TIME)
        )
        self._wrenches = self.create_subscription(
            WrenchStamped,
            "wrench",
            self._on_wrench,
            NEWEST,
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )
        self.create_subscription(TwistStamped, "velocity", self._on_velocity, NEWEST)
        self._status = self.create_publisher(DiagnosticArray, "status", 10)
        self._markers = self.create_publisher(MarkerArray, "markers", 1)
        self._authority = self.create_publisher(DiagnosticArray, "authority", LATCHED)
        self._least = self.create_publisher(WrenchStamped, "authority/least", LATCHED)
        self._largest = self.create_publisher(WrenchStamped, "authority/largest", LATCHED)
        if TFMessage is not None:
            self.create_subscription(TFMessage, "/tf_static", self._on_frames, ALL_FRAMES)
        self.create_timer(STATUS_S, self._on_status_time, clock=self._timer_clock)
        self.add_on_set_parameters_callback(self._on_parameters)

    def _declared(self) -> dict[str, Any]:
        """Declares all parameters, and returns their values by name."""
        defaults = Parameters()
        values = {}
        for name, (description, read_only) in descriptions().items():
            # What has no value of its own, such as an empty list of names, is not set.
            value = getattr(defaults, name)
            descriptor = ParameterDescriptor(
                description=description, read_only=read_only, dynamic_typing=True
            )
            declared = self.declare_parameter(name, None if value == () else value, descriptor)
            values[name] = declared.value
        return values

    # The states of a lifecycle node.

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Reads the robot and goes to neutral."""
        try:
            self.commander = Commander(self.settings, self.frames)
        except FinlabError as error:
            self.get_logger().error(str(error))
            return TransitionCallbackReturn.FAILURE
        self._robot_topics = RobotTopics(self, self.commander)
        layout = self.commander.layout
        method = self.commander.robot.allocator.method
        self.get_logger().info(f"{layout.name}: {layout.counts_in_words}, method {method}")
        self._start_watchdog()
        self._start_watch()
        self._guarded(self._keep_time)
        self._guarded(self._publish_status)  # what is computed at first keeps no wrench waiting
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begins to answer wrenches."""
        if self.commander is not None:
            self.commander.activate()
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Goes to neutral."""
        if self.commander is not None:
            self.commander.deactivate()
        self._guarded(self._keep_time)
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Rests the robot and forgets it."""
        self.stop()
        if self.commander is not None:
            self.settings = self.commander.parameters
        if self._watchdog is not None:
            self.destroy_timer(self._watchdog)
        self._stop_watch()
        if self._robot_topics is not None:
            self._robot_topics.destroy()
        self.commander = None
        self._robot_topics = None
        self._watchdog = None
        self._authority_of = None
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Rests the robot."""
        self.stop()
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Rests the robot and begins anew."""
        return self.on_cleanup(state)

    def stop(self) -> None:
        """Sends the last commands, neutral, and waits until they have arrived."""
        if self.commander is None or self._robot_topics is None:
            return
        self._robot_topics.publish(self.commander.stop().command)
        self._robot_topics.flush()

    # What comes in.

    def _on_wrench(self, message: WrenchStamped) -> None:
        self._guarded(partial(self._answer, message))

    def _on_velocity(self, message: TwistStamped) -> None:
        if self.commander is None:
            return
        given = messages.velocity_of(message)
        self._guarded(partial(self.commander.on_velocity, given, self._now_s(), self._clock_s()))

    def _on_imu(self, message: Imu) -> None:
        if self.commander is None:
            return
        sample = messages.imu_of(message)
        self._guarded(partial(self.commander.on_imu, sample, self._now_s(), self._clock_s()))

    def _on_pressure(self, message: FluidPressure) -> None:
        if self.commander is None:
            return
        pressure_pa, stamp_s = messages.pressure_of(message)
        now_s = self._now_s()
        self._guarded(
            partial(self.commander.on_pressure, pressure_pa, stamp_s, now_s, self._clock_s())
        )

    def _on_drives(self, message: JointState) -> None:
        if self.commander is None:
            return
        sample = messages.drives_of(message)
        self._guarded(partial(self.commander.on_drives, sample, self._now_s(), self._clock_s()))

    def _answer(self, message: WrenchStamped) -> None:
        """Answers a wrench."""
        if self.commander is None:
            return
        start_s = time.perf_counter()
        processor_start_s = time.thread_time()
        given = messages.wrench_of(message)
        sent = self.commander.on_wrench(given, self._now_s(), self._clock_s())
        self._send(sent)
        if sent is not None and sent.answer is not None:
            passed_s = time.perf_counter() - start_s
            self.commander.times.add(passed_s, time.thread_time() - processor_start_s)

    def _on_frames(self, message: Any) -> None:
        """Takes static transforms."""
        for each in message.transforms:
            origin = each.transform.translation
            turn = each.transform.rotation
            try:
                self.frames.add(
                    each.header.frame_id,
                    each.child_frame_id,
                    (origin.x, origin.y, origin.z),
                    (turn.x, turn.y, turn.z, turn.w),
                )
            except FinlabError as error:
                self.get_logger().warning(str(error))

    def _on_parameters(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        """Changes parameters, or says why not."""
        own = descriptions()
        values = {each.name: each.value for each in parameters if each.name in own}
        for name, value in values.items():
            if value is None:  # ROS would forget that there is such a parameter
                reason = (
                    f"{name}: cannot be deleted; set it to another value, a list to one empty text"
                )
                return SetParametersResult(successful=False, reason=reason)
        try:
            if self.commander is None:
                self.settings = self.settings.changed(values)
            else:
                self._change(self.commander, values)
        except FinlabError as error:
            return SetParametersResult(successful=False, reason=str(error))
        except Exception as error:  # such as too little memory for a robot
            self._fail(unanswered(error))
            return SetParametersResult(successful=False, reason=unanswered(error))
        return SetParametersResult(successful=True)

    def _change(self, commander: Commander, values: dict[str, Any]) -> None:
        """Changes parameters of a robot that is commanded."""
        rest_before = commander.change(values)
        if rest_before is not None and self._robot_topics is not None:
            self._robot_topics.publish(rest_before)
            self._robot_topics.destroy()
            self._robot_topics = RobotTopics(self, commander)
        if {"period_s", "watchdog_s"} & set(values):
            self._start_watchdog()
        if {"robot", "monitor", "period_s", "pressure", "drives"} & set(values):
            self._start_watch()

    # What goes out.

    def _keep_time(self) -> None:
        """Keeps the watchdog."""
        if self.commander is not None:
            has_sender = self.count_publishers(self._wrenches.topic_name) > 0
            self._send(self.commander.on_time(self._now_s(), has_sender))

    def _send(self, sent: Sent | None) -> None:
        if sent is not None and self._robot_topics is not None:
            self._robot_topics.publish(sent.command)

    def _on_status_time(self) -> None:
        self._guarded(self._publish_status)

    def _publish_status(self) -> None:
        """Sends what is said of the state, arrows, and of the authority where it has changed."""
        commander = self.commander
        topics = self._robot_topics
        if commander is None or topics is None:
            return
        stamp = self.get_clock().now().to_msg()
        report = status_report(commander, self._warnings(topics))
        name = commander.layout.name
        self._status.publish(messages.diagnostics([report], name, stamp))
        if self._markers.get_subscription_count() and commander.command is not None:
            answer = commander.answer
            forces = topics.forces(commander.command) if answer is None else answer.forces
            frame = commander.parameters.frame
            self._markers.publish(messages.arrows(commander.layout, forces, frame, stamp))
        of_what = (commander.layout, commander.lost, commander.damage)
        if of_what != self._authority_of:
            self._publish_authority(commander)
            self._authority_of = of_what

    def _publish_authority(self, commander: Commander) -> None:
        """Sends what each axis can still give."""
        stamp = self.get_clock().now().to_msg()
        left = AuthorityLeft.of(commander.layout, commander)
        frame = commander.parameters.frame
        name = commander.layout.name
        self._authority.publish(messages.diagnostics(left.reports(), name, stamp))
        self._least.publish(messages.wrench_stamped(left.least, frame, stamp))
        self._largest.publish(messages.wrench_stamped(left.largest, frame, stamp))

    def _warnings(self, topics: RobotTopics) -> list[str]:
        """Sentences about what is around the node."""
        warnings = []
        others = self.count_publishers(topics.command.topic_name) - 1
        if others > 0:
            warnings.append(
                f"{others} more publish {topics.command.topic_name}, too; stop them, or start each "
                "node in a namespace of its own"
            )
        wrench = self._wrenches.topic_name
        if not self.count_publishers(wrench):
            warnings.append(f"nobody publishes {wrench}")
        return warnings

    # What both need.

    def _now_s(self) -> float:
        """Now [s]: by a clock that is never set, or by that of the simulation."""
        return self._clock_s() if self._is_simulated else time.monotonic()

    def _clock_s(self) -> float:
        """Now, by the clock of stamps [s]."""
        return 1e-9 * float(self.get_clock().now().nanoseconds)

    def _start_watchdog(self) -> None:
        """Starts the timer that looks for silence, anew where its period has changed."""
        if self._watchdog is not None:
            self.destroy_timer(self._watchdog)
        assert self.commander is not None
        parameters = self.commander.parameters
        period_s = min(parameters.period_s, parameters.watchdog_s / WATCHDOG_TICKS)
        self._watchdog = self.create_timer(
            period_s, partial(self._guarded, self._keep_time), clock=self._timer_clock
        )

    def _start_watch(self) -> None:
        """Listens to the IMU and looks for faults, where the monitor is on."""
        self._stop_watch()
        if self.commander is None or self.commander.watch is None:
            return
        parameters = self.commander.parameters
        heard: list[tuple[type, str, Callable[[Any], None]]] = [(Imu, "imu", self._on_imu)]
        if parameters.pressure:
            heard.append((FluidPressure, "pressure", self._on_pressure))
        if parameters.drives != "off":
            heard.append((JointState, "drives", self._on_drives))
        for kind, topic, callback in heard:
            self._sensors.append(self.create_subscription(kind, topic, callback, NEWEST_OF_SENSOR))
        self._watch_timer = self.create_timer(
            self.commander.watch.period_s,
            partial(self._guarded, self._look_for_faults),
            clock=self._timer_clock,
        )

    def _stop_watch(self) -> None:
        """Ends both."""
        for subscription in self._sensors:
            self.destroy_subscription(subscription)
        self._sensors = []
        if self._watch_timer is not None:
            self.destroy_timer(self._watch_timer)
        self._watch_timer = None

    def _look_for_faults(self) -> None:
        """Lets the monitor look, and tells of what it has found."""
        commander = self.commander
        if commander is None or commander.watch is None:
            return
        before = commander.damage
        sent = commander.on_watch(self._now_s())
        self._send(sent)
        if commander.damage != before:
            found = "; ".join(commander.watch.phrases()) or "all whole"
            self.get_logger().warning(f"monitor: {found}")

    def _guarded(self, work: Callable[[], None]) -> None:
        """Does some work; an unforeseen error leads the robot to neutral, and the node goes on."""
        try:
            work()
        except Exception as error:
            self._fail(unanswered(error))

    def _fail(self, sentence: str) -> None:
        """Leads the robot to neutral after an unforeseen error."""
        self.get_logger().error(sentence)
        if self.commander is None:
            return
        try:
            self._send(self.commander.fail(sentence, self._now_s()))
        except Exception as error:
            self.get_logger().error(unanswered(error))
