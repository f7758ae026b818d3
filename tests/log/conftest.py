"""A dive of an eight-thruster robot whose yaw is out of reach for a while, as autopilots would log
it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.exchange import Exchange
from finlab.exchange.motor_factors import FRAMES
from finlab.exchange.parameters import read_parameters, write_px4
from finlab.layout import Layout, load_layout
from tests.log.dataflash_writer import write_dataflash
from tests.log.ulog_writer import write_ulog

FULL = 40.0
"""Force of each thruster at full output, either way [N]."""
FLU_TO_FRD = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
"""Signs by which wrenches go from x forward, y left, z up to y right, z down."""
DIAGONAL = np.sqrt(0.5)
"""Part of a unit vector along each of two axes, between which it lies."""
LEVER = 0.24 * DIAGONAL
"""Arm of yaw [m]."""
ROLL = 0.22
"""Arm of roll [m]."""
PITCH = 0.12
"""Arm of pitch [m]."""
# PX4 divides columns of the pseudo-inverse: each of thrust by the mean of its entries, roll and
# pitch by sqrt(2) times the larger entry, yaw by its own.
PX4_UNIT = 4 * FULL * np.array([DIAGONAL, DIAGONAL, 1.0, PITCH * DIAGONAL, PITCH * DIAGONAL, LEVER])
SUB_UNIT = 4 * FULL * np.array([DIAGONAL, DIAGONAL, 1.0, ROLL, PITCH, LEVER])
"""Wrench of a setpoint of 1 on each axis by the rules of both autopilots, worked out for this
robot."""


@dataclass(frozen=True)
class Dive:
    """What was asked for, what outputs gave, and where that was written."""

    robot: Layout
    path: Path
    time: np.ndarray
    demand: np.ndarray
    given: np.ndarray

    @property
    def missing(self) -> np.ndarray:
        """Impulse (6,) that was missing."""
        step = np.diff(self.time, append=2 * self.time[-1] - self.time[-2])
        return step @ np.abs(self.demand - self.given)


def even_robot() -> Layout:
    """The BlueROV2 Heavy with thrusters that push alike both ways, its centre amid its horizontal
    ones."""
    robot = load_layout("bluerov2_heavy")
    places = [(*np.sign(part.position[:2]), part) for part in robot.actuators]
    parts = (
        replace(
            part,
            force=(-FULL, FULL),
            position=(0.14 * x, 0.1 * y, 0.0) if i < 4 else (0.12 * x, 0.22 * y, 0),
        )
        for i, (x, y, part) in enumerate(places)
    )
    return replace(robot, name="even", actuators=tuple(parts), body=None)


def columns(robot: Layout) -> np.ndarray:
    """Wrench (n, 6) of each thruster per newton: its force and its lever times that."""
    return np.array([[*part.axis, *np.cross(part.position, part.axis)] for part in robot.actuators])


def asked(n: int, dt: float, surge: float, yaw: float) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) [s] and demands (n, 6) [N, N m]: easy ones, and for a sixth of the time more of
    surge and yaw than goes together."""
    time = 4.0 + dt * np.arange(n)
    demand = np.zeros((n, 6))
    demand[:, 0] = 20.0 + 5.0 * np.sin(time / 7)
    demand[:, 2] = 10.0 * np.cos(time / 3)
    demand[:, 5] = 2.0 * np.sin(time)
    hard = slice(n // 2, n // 2 + n // 6)
    demand[hard] = [surge, 0.0, 0.0, 0.0, 0.0, yaw]
    return time, demand


def px4_dive(
    path: Path,
    n: int = 3000,
    dt: float = 0.02,
    outputs: str = "shares",
    speed: np.ndarray | None = None,
    extra: Mapping[str, Any] | None = None,
) -> Dive:
    """A log of PX4, with extra topics. Outputs are its own method's, judged by hand: wrench = sum of forces and
    levers. ESCs say the speed (n, 8) of motors, if it is given."""
    robot = even_robot()
    time, demand = asked(n, dt, 90.0, 18.0)
    force = Allocator(robot, "px4").allocate_batch(demand).command[..., 0]
    given = force @ columns(robot)
    found = read_parameters(write_px4(robot, Exchange(), ""), "")
    whole = ("CA_ROTOR_COUNT", "CA_R_REV", "CA_AIRFRAME")
    parameters = {key: int(value) if key in whole else value for key, value in found.items()}
    setpoint = demand / PX4_UNIT * FLU_TO_FRD
    topics = {
        "vehicle_thrust_setpoint": (time, {"xyz": setpoint[:, :3]}),
        "vehicle_torque_setpoint": (time, {"xyz": setpoint[:, 3:]}),
    }
    if outputs == "pulses":
        topics["actuator_outputs"] = (
            time,
            {"output": np.pad(1500 + 400 * force / FULL, ((0, 0), (0, 8)))},
        )
        for i in range(1, 9):
            parameters |= {
                f"PWM_MAIN_FUNC{i}": 100 + i,
                f"PWM_MAIN_MIN{i}": 1100,
                f"PWM_MAIN_MAX{i}": 1900,
            }
    elif outputs:
        control = np.full((n, 12), np.nan)
        control[:, :8] = force / FULL
        topics["actuator_motors"] = (time + 0.001, {"control": control})
    left = (demand - given) / PX4_UNIT * FLU_TO_FRD
    late = time > time[n // 3]
    topics["failure_detector_status"] = (
        time,
        {"motor_failure_mask": np.where(late, 4, 0).astype(np.uint16)},
    )
    escs = {"esc_count": np.full(n, 8, np.uint16)}
    escs["esc_online_flags"] = np.where(late, 0x7F, 0xFF).astype(np.uint16)
    topics["esc_status"] = (time, escs if speed is None else escs | {"esc.esc_rpm": speed})
    status = {"unallocated_torque": left[:, 3:], "unallocated_thrust": left[:, :3]}
    topics["control_allocator_status"] = (time + 0.001, status)
    topics |= extra or {}
    return Dive(robot, write_ulog(path, topics, parameters), time, demand, given)


@dataclass(frozen=True)
class SubMotion:
    """What ArduSub is asked for and does: more of forward and yaw is asked for than goes together,
    and outputs are the sum of factors, cut at full; pulses up to 25 us from rest turn no motor."""

    robot: Layout
    time: np.ndarray
    stick: np.ndarray
    """Roll, pitch, yaw, throttle, forward, lateral (n, 6)."""
    pulse: np.ndarray
    """(n, 8) [us]."""
    demand: np.ndarray
    given: np.ndarray
    parameters: dict[str, float]


def sub_motion(n: int, dt: float) -> SubMotion:
    """The motion of n samples."""
    robot = even_robot()
    time, _ = asked(n, dt, 0.0, 0.0)
    hard = slice(n // 2, n // 2 + n // 6)
    stick = np.zeros((n, 6))
    stick[:, 2] = 0.1 * np.sin(time)
    stick[:, 3] = 0.2 * np.cos(time / 3)
    stick[:, 4] = 0.3
    stick[hard] = [0.0, 0.0, 0.6, 0.0, 0.8, 0.0]
    output = np.clip(stick @ FRAMES["VECTORED_6DOF"].T, -1.0, 1.0)
    signs = np.array([1, -1, 1, 1, -1, 1, 1, 1.0])
    pulse = np.round(1500.0 + 400.0 * output * signs)
    force = FULL * (pulse - 1500.0) / 400.0 * signs
    force[np.abs(pulse - 1500.0) <= 25.0] = 0.0
    given = force @ columns(robot)
    demand = stick[:, [4, 5, 3, 0, 1, 2]] * [1.0, -1.0, 1.0, 1.0, -1.0, -1.0] * SUB_UNIT
    parameters = {
        "FRAME_CONFIG": 2.0,
        **{f"MOT_{i}_DIRECTION": sign for i, sign in enumerate(signs, 1)},
    }
    parameters |= {f"SERVO{i}_FUNCTION": 32.0 + i for i in range(1, 9)}
    return SubMotion(robot, time, stick, pulse, demand, given, parameters)


def sub_dive(
    path: Path,
    n: int = 3000,
    dt: float = 0.02,
    speed: np.ndarray | None = None,
    extra: Mapping[str, Any] | None = None,
) -> Dive:
    """A log of ArduSub, with extra messages. ESCs say the speed (n, 8) of motors, if it is
    given."""
    motion = sub_motion(n, dt)
    stick = motion.stick
    us = np.round(motion.time * 1e6)
    rate = {"TimeUS": us, "ROut": stick[:, 0], "POut": stick[:, 1], "YOut": stick[:, 2]}
    rate["AOut"] = 0.5 + 0.5 * stick[:, 3]
    sticks = {f"C{i}": np.round(1500 + 400 * stick[:, i - 1]) for i in (5, 6)}
    pulses = {f"C{i}": motion.pulse[:, i - 1] for i in range(1, 9)}
    messages = {
        "RATE": ("Qffff", rate),
        "RCIN": ("QHH", {"TimeUS": us, **sticks}),
        "RCOU": ("Q" + "H" * 8, {"TimeUS": us, **pulses}),
        "MSG": ("QZ", {"TimeUS": us[n // 2 :][:1], "Message": np.array([b"Leak Detected"])}),
    }
    if speed is not None:
        motors = {
            "TimeUS": np.repeat(us, 8),
            "Instance": np.tile(np.arange(8), n),
            "RPM": speed.ravel(),
        }
        messages["ESC"] = ("QBe", motors)
    messages |= extra or {}
    written = write_dataflash(path, messages, motion.parameters)
    return Dive(motion.robot, written, motion.time, motion.demand, motion.given)


@pytest.fixture(scope="session")
def px4(tmp_path_factory: pytest.TempPathFactory) -> Dive:
    """The dive as PX4 logs it."""
    return px4_dive(tmp_path_factory.mktemp("px4") / "dive.ulg")


@pytest.fixture(scope="session")
def sub(tmp_path_factory: pytest.TempPathFactory) -> Dive:
    """The dive as ArduSub logs it."""
    return sub_dive(tmp_path_factory.mktemp("sub") / "dive.bin")
