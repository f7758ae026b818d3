"""What the robot is commanded, and when: answers to wrenches while they come, else neutral.

Needs no ROS: times come in as arguments, commands go out as return values.

==========  =======================================================================
state       what is commanded
==========  =======================================================================
inactive    neutral; wrenches are left unanswered
waiting     neutral: no wrench has come yet
answering   an answer to each wrench
silent      neutral: no good wrench for `watchdog_s`
failed      neutral: the last wrench met an error that is no fault of it
==========  =======================================================================

Neutral is repeated every `watchdog_s` where the node is inactive, or nobody is there to send
wrenches: drives may have been started later, or have missed it. A sender that is there and silent
is sent nothing that it might take for an answer.

A wrench that is refused commands nothing and keeps no robot from going to neutral. On the way to
neutral commands change within the drives' rates, too; `stop` alone, the last command of all, is
neutral at once, since nothing could follow it.
"""

import math
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.deploy.command_stream import REFUSED, CommandStream, unanswered
from finlab.deploy.deployed_robot import DeployedRobot
from finlab.errors import CommandError
from finlab.layout import Damage, Layout
from finlab.layout.damage import NO_DAMAGE
from finlab_allocator.answer_times import AnswerTimes
from finlab_allocator.fault_watch import FaultWatch
from finlab_allocator.frames import StaticFrames
from finlab_allocator.input_checks import (
    DriveSample,
    ImuSample,
    StampedInput,
    Target,
    age_of,
    target_of,
    velocity_of,
)
from finlab_allocator.parameters import Parameters
from finlab_allocator.robot_source import read_robot
from finlab_allocator.ticks import Ticks

State = Literal["inactive", "waiting", "answering", "silent", "failed"]
"""See above."""


class Sent(NamedTuple):
    """Commands to send."""

    command: Array
    """(n, 3), NaN for lost actuators."""
    answer: Allocation | None
    """What they come from; None on the way to neutral."""


class Commander:
    """Commands of one robot."""

    def __init__(self, parameters: Parameters, frames: StaticFrames) -> None:
        """Reads the robot of the parameters; nothing has been commanded yet.

        Args:
            parameters: of the node.
            frames: static transforms, to which others may be added later.

        Raises:
            FinlabError: the robot cannot be read, or does not fit the parameters.
        """
        self.parameters = parameters
        """The node's parameters."""
        self._frames = frames
        self.damage: Damage | None = None
        """What the fault monitor has found beside `lost`; None for nothing."""
        self.watch: FaultWatch | None = None
        """Feeds the fault monitor; None where it is off."""
        self.state: State = "inactive"
        """What is commanded now."""
        self.failure = ""
        """The error of state `failed`, in a sentence."""
        self.refusals = 0
        """How many wrenches were refused."""
        self.last_refusal = ""
        """Why the last of them was, in a sentence; empty where none was."""
        self.is_refused = False
        """Whether the newest wrench was refused."""
        self.times = AnswerTimes()
        """Times of answers, which whoever sends them takes down."""
        self._robot = read_robot(parameters.robot)
        self.ticks = self._prepared(self._robot, parameters)
        """The robot, prepared for ticks of several lengths."""
        self._stream = CommandStream(self.ticks.whole)
        self._stream.lost = parameters.lost
        self._watch_as(parameters)
        self._flow: Array | None = None
        self._flow_at_s = -math.inf
        self._commanded: Array | None = None  # weak ones are asked for more than they give
        self._target: Target | None = None  # that of the answer in force
        self._good_at_s = 0.0  # when the last wrench came that was answered
        self._sent_at_s = 0.0

    @property
    def layout(self) -> Layout:
        """The robot's layout."""
        return self.ticks.whole.layout

    @property
    def robot(self) -> DeployedRobot:
        """The robot as it answers."""
        return self.ticks.whole

    @property
    def lost(self) -> tuple[str, ...]:
        """Actuators that are lost, by the parameters or by the bundle."""
        named = self.parameters.lost
        return (*self._robot.lost, *(name for name in named if name not in self._robot.lost))

    @property
    def answer(self) -> Allocation | None:
        """The answer that is in force; None at neutral."""
        last = self._stream.last
        return last if isinstance(last, Allocation) else None

    @property
    def command(self) -> Array | None:
        """The commands (n, 3) that were sent last; None where there are none."""
        return self._commanded

    def change(self, values: Mapping[str, Any]) -> Array | None:
        """Changes parameters, all of them or none.

        Args:
            values: new values by name.

        Returns:
            Where the robot is another one now: neutral commands (n, 3) for the one before.

        Raises:
            FinlabError: a value is not acceptable, or a robot cannot be read; nothing has changed.
        """
        parameters = self.parameters.changed(values)
        robot = self._robot
        if "robot" in values:  # a file may have changed under the same name
            robot = read_robot(parameters.robot)
        of_ticks = (parameters.period_s, parameters.calm)
        if robot is self._robot and of_ticks == (self.parameters.period_s, self.parameters.calm):
            ticks = self.ticks
            self._check(ticks.whole, parameters)
        else:
            ticks = self._prepared(robot, parameters)
        is_other = ticks.whole.layout != self.layout
        rest_before = self._stream.neutral()
        before = self.parameters
        self.parameters = parameters
        self._robot = robot
        self.ticks = ticks
        self._stream.robot = ticks.whole
        self._stream.lost = parameters.lost
        if is_other:  # what was sent to another robot says nothing of this one
            self._stream = CommandStream(ticks.whole)
            self._stream.lost = parameters.lost
            self.damage = None
            self._flow_at_s = -math.inf
            self._commanded = None
            self._target = None
            if self.state != "inactive":
                self.state = "waiting"
        if is_other or _of_watch(before) != _of_watch(parameters):
            self._watch_as(parameters)
        elif self.watch is not None and before.lost != parameters.lost:
            self._tell_watch(self.watch, before.lost)
        return rest_before if is_other else None

    def activate(self) -> None:
        """Answers wrenches from now on."""
        self.state = "waiting"

    def deactivate(self) -> None:
        """Leaves wrenches unanswered from now on; the next ticks lead to neutral."""
        self.state = "inactive"

    def _watch_as(self, parameters: Parameters) -> None:
        """Begins to look for faults anew, or ends it."""
        self.watch = None
        self.damage = None
        if not parameters.monitor:
            return
        self.watch = FaultWatch(self.layout, parameters, self._frames)
        for name in self.lost:
            self.watch.tell(name, is_lost=True)

    def _tell_watch(self, watch: FaultWatch, lost_before: tuple[str, ...]) -> None:
        """Tells the monitor what parameter `lost` says now."""
        lost = self.parameters.lost
        for name in set(lost_before) ^ set(lost):
            watch.tell(name, is_lost=name in lost)
        if self.damage is not None and self._is_all_lost(self.damage):
            self._watch_as(self.parameters)

    def _is_all_lost(self, found: Damage) -> bool:
        """Whether no actuator would be left with what the monitor has found."""
        return set(self.layout.names) <= {*found.lost, *self.lost}

    @property
    def reads_velocity(self) -> bool:
        """Whether the robot's forces depend on its velocity through the water."""
        return bool(self.layout.flow_driven) or self.layout.interaction is not None

    def on_imu(self, sample: ImuSample, now_s: float, clock_s: float) -> None:
        """Takes a sample of the IMU.

        Args:
            sample: as it came.
            now_s: now, by a clock that is never set [s].
            clock_s: now, by the clock of stamps [s].
        """
        if self.watch is None:
            return
        try:
            age_s = age_of("imu", sample.stamp_s, clock_s, self.parameters.watchdog_s)
            self.watch.on_imu(sample, now_s - age_s)
        except CommandError as error:
            self.refuse(str(error))

    def on_pressure(self, pressure_pa: float, stamp_s: float, now_s: float, clock_s: float) -> None:
        """Takes a pressure of the water.

        Args:
            pressure_pa: [Pa].
            stamp_s: when it was measured, by the clock of stamps [s]; `NO_STAMP` where that is
                unknown.
            now_s: now, by a clock that is never set [s].
            clock_s: now, by the clock of stamps [s].
        """
        if self.watch is None or not self.parameters.pressure:
            return
        try:
            age_s = age_of("pressure", stamp_s, clock_s, self.parameters.watchdog_s)
            self.watch.on_pressure(pressure_pa, now_s - age_s)
        except CommandError as error:
            self.refuse(str(error))

    def on_drives(self, sample: DriveSample, now_s: float, clock_s: float) -> None:
        """Takes what drives say of themselves; arguments as of `on_imu`."""
        if self.watch is None or self.parameters.drives == "off":
            return
        try:
            age_s = age_of("drives", sample.stamp_s, clock_s, self.parameters.watchdog_s)
            self.watch.on_drives(sample, now_s - age_s)
        except CommandError as error:
            self.refuse(str(error))

    def on_watch(self, now_s: float) -> Sent | None:
        """Looks for faults; to be called once in the watch's period.

        Args:
            now_s: now, by a clock that is never set [s].

        Returns:
            Where something else is broken now, and a wrench is in force: a new answer to it.
        """
        if self.watch is None or not self.watch.hears(now_s, self.parameters.watchdog_s):
            return None
        found = self.watch.step()
        if found is None or found == (self.damage or NO_DAMAGE):
            return None
        if self._is_all_lost(found):
            return None  # then it is the body that moves otherwise, and not its actuators
        self.damage = None if found == NO_DAMAGE else found
        if self.state != "answering" or self._target is None:
            return None
        try:
            return self._answered(self._target, now_s)
        except Exception as error:  # the node goes on, whatever is wrong
            return self.fail(unanswered(error), now_s)

    def on_velocity(self, given: StampedInput, now_s: float, clock_s: float) -> None:
        """Takes the velocity of the robot relative to the water.

        Args:
            given: as it came.
            now_s: now, by a clock that is never set [s].
            clock_s: now, by the clock of stamps [s].
        """
        if not self.reads_velocity and self.watch is None:
            return
        try:
            velocity = velocity_of(given, clock_s, self.parameters, self._frames)
            age_s = age_of("velocity", given.stamp_s, clock_s, self.parameters.watchdog_s)
        except CommandError as error:
            self.refuse(str(error))
            return
        if self.watch is not None:
            self.watch.on_velocity(velocity, now_s - age_s)
        self._flow = velocity
        self._flow_at_s = now_s

    def _flow_of(self, now_s: float) -> Array | None:
        """The velocity (6,) relative to the water [m/s, rad/s]; None at rest, and where the last
        one is older than `watchdog_s`."""
        if not self.reads_velocity:
            return None
        is_new = 0.0 <= now_s - self._flow_at_s <= self.parameters.watchdog_s
        return self._flow if is_new else None

    def on_wrench(self, given: StampedInput, now_s: float, clock_s: float) -> Sent | None:
        """Answers a wrench.

        Args:
            given: as it came.
            now_s: now, by a clock that is never set [s].
            clock_s: now, by the clock of stamps [s].

        Returns:
            What to send; None where the wrench is refused or left unanswered.
        """
        if self.state == "inactive":
            return None
        try:
            target = target_of(given, clock_s, self.parameters, self._frames)
            sent = self._answered(target, now_s)
        except REFUSED as error:
            self.refuse(str(error))
            return None
        except Exception as error:  # the node goes on, whatever is wrong
            return self.fail(unanswered(error), now_s)
        self.is_refused = False
        self.state = "answering"
        self._good_at_s = now_s
        self._target = target
        return sent

    def _answered(self, target: Target, now_s: float) -> Sent:
        """The answer to a target with what is known to be broken.

        Args:
            target: what is asked for.
            now_s: now, by a clock that is never set [s].

        Raises:
            FinlabError: one of `REFUSED` where the target is at fault; other exceptions are none
                of it.
        """
        length_s, self._stream.robot = self.ticks.spend(now_s)
        answer = self._stream.answer(
            target.wrench,
            lost=self.parameters.lost,
            free=target.free,
            policy=self.parameters.policy,
            power=self.parameters.power_w,
            damage=self.damage,
            flow=self._flow_of(now_s),
        )
        command = answer.command
        if self.watch is not None:
            asked = self.watch.sent(command)
            if not np.array_equal(asked, command, equal_nan=True):
                # More of a weak one, or a lost one that is tried: within the rates, too.
                asked = self.ticks.towards(asked, self._commanded, length_s)
            command = asked
        return self._sent(answer, command, now_s)

    def refuse(self, sentence: str) -> None:
        """Notes a message that is not answered.

        Args:
            sentence: why.
        """
        self.refusals += 1
        self.last_refusal = sentence
        self.is_refused = True

    def fail(self, sentence: str, now_s: float) -> Sent | None:
        """Begins the way to neutral after an error.

        Args:
            sentence: the error.
            now_s: now [s].

        Returns:
            What to send.
        """
        self.failure = sentence
        if self.state != "inactive":
            self.state = "failed"
        return self.on_time(now_s)

    def on_time(self, now_s: float, has_sender: bool = True) -> Sent | None:
        """Keeps the watchdog, and the robot at neutral where it does not answer; to be called a few
        times in `watchdog_s`, and once in `period_s`.

        Args:
            now_s: now, by a clock that is never set [s].
            has_sender: whether somebody is there who may send wrenches.

        Returns:
            What to send; None where nothing is due.
        """
        if self.state == "answering":
            silence_s = now_s - self._good_at_s  # negative where a simulation's clock went back
            if 0.0 <= silence_s <= self.parameters.watchdog_s:
                return None
            self.state = "silent"
        neutral = self._stream.neutral()
        last = self._stream.command
        is_there = last is not None and np.array_equal(last, neutral, equal_nan=True)
        is_recent = 0.0 <= now_s - self._sent_at_s < self.parameters.watchdog_s
        is_repeated = self.state == "inactive" or not has_sender
        if is_there and (is_recent or not is_repeated):
            return None
        length_s, _ = self.ticks.spend(now_s)
        command = self.ticks.towards(neutral, last, length_s)
        return self._sent(command, command, now_s)

    def stop(self) -> Sent:
        """Returns the last commands of all: neutral at once."""
        self.state = "inactive"
        neutral = self._stream.neutral()
        return self._sent(neutral, neutral, self._sent_at_s)

    def _sent(self, noted: Allocation | Array, command: Array, now_s: float) -> Sent:
        """Takes down what is sent now."""
        found = () if self.damage is None else self.damage.lost
        self._stream.note(noted, (*self.parameters.lost, *found))
        self._sent_at_s = now_s
        self._commanded = command
        if self.watch is not None:
            self.watch.on_command(command, now_s)
        return Sent(command, noted if isinstance(noted, Allocation) else None)

    def _prepared(self, robot: DeployedRobot, parameters: Parameters) -> Ticks:
        """A robot prepared for its ticks. Raises FinlabError: it does not fit the parameters."""
        ticks = Ticks(robot, parameters.period_s, parameters.calm)
        self._check(ticks.whole, parameters)
        return ticks

    def _check(self, robot: DeployedRobot, parameters: Parameters) -> None:
        """Refuses parameters that name what a robot has not, by a first question; what is prepared
        at a first question, such as tables, then waits for none later."""
        all_lost = {*robot.lost, *parameters.lost}
        if all_lost >= set(robot.layout.names):
            raise CommandError(
                f"lost: names each actuator of {robot.layout.name:.60}, expected one that works"
            )
        robot.allocate(
            np.zeros(6),
            lost=parameters.lost,
            free=parameters.free,
            policy=parameters.policy,
            power=parameters.power_w,
            previous=robot.neutral(parameters.lost),
        )


def _of_watch(parameters: Parameters) -> tuple[bool, str, float, bool, bool, str]:
    """The parameters with which the monitor begins anew."""
    heard = (parameters.accelerometer, parameters.pressure, parameters.drives)
    return parameters.monitor, parameters.frame, parameters.period_s, *heard
