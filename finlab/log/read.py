"""Reads a log for one robot: demands in newtons, and outputs as commands of its actuators.

The readers of the autopilots and of ROS make a `LogRecord` in units of their own; here it gets the
units of the robot. `judging` judges the result.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.actuators.actuator import Actuator
from finlab.actuators.thrust_model import PowerTable
from finlab.allocation.baselines.autopilots import ArduSub, Px4
from finlab.allocation.solution import PlainData
from finlab.arrays import Array
from finlab.assets import install_command
from finlab.axes import AXES
from finlab.errors import DataError, FinlabError, LayoutError
from finlab.files.guarded import read_file
from finlab.layout import Layout, load_layout
from finlab.log import ardusub_log, px4_log, ros_bag, telemetry_log
from finlab.log.ardusub_signals import ESC_DEAD_BAND_US, FULL_US, REST_US, in_dead_band
from finlab.log.recorded import Event, Form, LogRecord, Series
from finlab.log.working_time import working_time
from finlab.physics.objective import wrench_scale_of
from finlab.physics.plant import plant_of

MAX_BYTES = 1_000_000_000
"""Largest log."""
MAX_DEMAND = 1e9
"""Largest demand that is no fault of the file [N, N m]."""
MAX_SAMPLES = 1_000_000
"""Most samples of demands: five hours at 50 Hz."""
GAP_S = 1.0
"""Longest time that a sample holds; what lies beyond it was not logged."""

MIN_STILL_S = 1.0
"""Time that a thruster is commanded to push without turning after which it counts as stopped
[s]."""
PUSHING_SHARE = 0.2
"""Share of its largest force from which on a command counts as one to push."""


@dataclass(frozen=True, eq=False)
class Log(PlainData):
    """Demands and commands of a robot over time, as plain data; wrenches are FLU."""

    source: str
    """Name of the file."""
    form: Form
    """The program that wrote the log."""
    robot: Layout
    """The robot by whose laws it is judged."""
    time: Array
    """Of each sample on the log's clock (N,) [s], rising."""
    span: Array
    """How long each held (N,) [s]."""
    demand: Array
    """Demanded wrenches (N, 6) [N, N m]; NaN along an axis that does not count."""
    command: Array | None
    """Commands of the actuators (N, n, 3), as their laws take them; NaN for one that was stopped.
    None where the log holds no outputs."""
    unmet: Array | None
    """The part of each demand that the autopilot logged as unallocated (N, 6) [N, N m]; None where
    it logged none, or the log holds outputs."""
    events: tuple[Event, ...]
    """Events of the robot's health, by time."""
    notes: tuple[str, ...]
    """Sentences on how it was read."""
    asks: tuple[str, ...]
    """Sentences on what it lacks, each with the option that gives it."""

    def __len__(self) -> int:
        return len(self.time)


def read_log(
    path: str | os.PathLike[str],
    robot: Layout | str | None = None,
    *,
    scale: ArrayLike | None = None,
    demand: str | None = None,
    outputs: str | None = None,
    whole: bool = False,
) -> Log:
    """Reads a log of PX4 (`.ulg`), of ArduSub (`.bin`, `.tlog`) or a bag of ROS.

    It runs in this process: files of strangers belong in `finlab.files.worker.in_worker`.

    Args:
        path: of the file, or of a bag's folder.
        robot: a layout, or what `load_layout` takes; by the log's own parameters when None.
        scale: what a setpoint of 1 asks for on each axis (6,) [N, N m]; of ROS what wrenches are
            multiplied by. By the autopilot's own rule and the robot's forces when None.
        demand: topic of a bag that holds the wrench; the only one there when None.
        outputs: topic of a bag that holds what actuators were sent; the only one there when None.
        whole: whether time counts at which the robot was disarmed, or not in the water.

    Raises:
        DataError: the file is damaged, of another kind or too large, or lacks what no option gives;
            or the package that reads it is not installed.
        LayoutError: the robot cannot be read, or does not fit the log's motors.
    """
    file = Path(path)
    try:
        record = _read_record(file, demand, outputs)
    except ModuleNotFoundError as error:
        raise DataError(
            f"{file}: {error.name} is not installed; run: {install_command('logs')}"
        ) from None
    except FinlabError:
        raise
    except Exception as problem:  # of many kinds, by a file that is damaged
        why = f"{type(problem).__name__}: {problem!s:.80}"
        problem_words = f"cannot be read as a log ({why}); it is damaged or of an unknown version"
        raise DataError(f"{file}: {problem_words}") from None
    layout = load_layout(robot) if isinstance(robot, str) else robot or record.layout
    if layout is None:
        raise DataError(f"{file}: {record.lacking[0]}")
    if layout is record.layout:
        record.notes, record.asks = record.notes + record.taken, record.lacking + record.asks
    if whole:
        record.armed = record.in_water = None
    return log_of_record(file.name, record, layout, scale)


def _read_record(path: Path, demand: str | None, outputs: str | None) -> LogRecord:
    """The record of a log, by the reader for its first bytes or its suffix."""
    is_folder = path.is_dir()
    head = b"" if is_folder else read_file(path, MAX_BYTES, "a log", head=64)
    if head.startswith(px4_log.MAGIC):
        return px4_log.read_ulog(path)
    if head.startswith(ardusub_log.MAGIC):
        return ardusub_log.read_dataflash(path)
    if is_folder and sum(entry.stat().st_size for entry in path.iterdir()) > MAX_BYTES:
        raise DataError(f"{path}: is larger than {MAX_BYTES:,} bytes; cut it")
    suffix = path.suffix.lower()
    if is_folder or suffix in ros_bag.SUFFIXES:
        return ros_bag.read_bag(path, demand, outputs)
    if suffix == telemetry_log.SUFFIX or telemetry_log.looks_like(head):
        return telemetry_log.read_telemetry(path)
    raise DataError(
        f"{path}: expected a log of PX4 (.ulg), of ArduSub (.bin, .tlog), or a bag of ROS"
    )


def _motor_signs(log_robot: Layout | None, robot: Layout) -> Array:
    """The sign (n,) that turns the output of each motor of the log into that of an actuator.

    It is 1, or -1 for an actuator that is mounted the other way round than the motor.

    Args:
        log_robot: the robot by the log's parameters; None where they hold none.
        robot: the robot by whose laws the log is judged.

    Raises:
        LayoutError: the two do not have the same motors in the same order.
    """
    if log_robot is None or log_robot is robot:
        return np.ones(robot.n)
    if log_robot.n != robot.n:
        raise LayoutError(
            f"layout {robot.name!r:.60} has {robot.counts_in_words}, and the log's parameters have "
            f"{log_robot.n} motors"
        )
    cosine = np.einsum("nk,nk->n", _axes_of(log_robot), _axes_of(robot))
    is_other = np.abs(cosine) < 0.5  # more than 60 degrees off, either way round
    if is_other.any():
        raise LayoutError(
            f"{robot.names[is_other.argmax()]!r:.60} of layout {robot.name!r:.60} pushes another "
            "way than the log's motor in its place; list the actuators in the order of the motors"
        )
    return np.asarray(np.sign(cosine))


def _axes_of(robot: Layout) -> Array:
    """Directions (n, 3) of the actuators' forces; 0 for one that has no axis."""
    return np.array([getattr(actuator, "axis", (0.0, 0.0, 0.0)) for actuator in robot.actuators])


def _unit(source_program: Form, robot: Layout, scale: ArrayLike | None) -> Array:
    """The wrench (6,) that a setpoint of 1 stands for [N, N m], FLU; NaN along an axis that the
    robot does not drive.

    Args:
        source_program: the program that wrote the log.
        robot: the robot; by its forces where `scale` is None.
        scale: the user's (6,); of ROS the factor of its wrenches.

    Raises:
        DataError: `scale` is not six numbers above 0.
        LayoutError: the robot has other actuators than an autopilot drives.
    """
    if scale is not None:
        unit = np.asarray(scale, np.float64)
        if unit.shape == (6,) and np.isfinite(unit).all() and (unit > 0.0).all():
            return unit
        raise DataError(
            f"scale: expected six numbers above 0, newtons and newton metres, got {scale!s:.80}"
        )
    if source_program in ("ros", "finlab"):
        return np.ones(6)
    kind = Px4 if source_program == "px4" else ArduSub
    return np.abs(kind(robot, kind.settings_class(), wrench_scale_of(robot)).setpoint_unit)


def log_of_record(source: str, record: LogRecord, robot: Layout, scale: ArrayLike | None) -> Log:
    """The log in the robot's newtons, at the times of its outputs, else of the unallocated
    wrenches, else of the demands.

    Args:
        source: the name of the file.
        record: the record in units of its own.
        robot: the robot by whose laws it is judged.
        scale: as in `read_log`.
    """
    signs = _motor_signs(record.layout, robot)
    unit = _unit(record.form, robot, scale)
    series = record.outputs or record.unmet or record.demand
    time = series.time
    notes = [*record.notes]
    asks = [*record.asks]
    demand = record.demand.at(time) * np.where(robot.commanded, unit, np.nan)
    is_kept = np.isfinite(demand).any(axis=1) & ~(np.abs(demand) > MAX_DEMAND).any(axis=1)
    command = None
    unmet = None
    if record.outputs is not None:
        command = commands_of(record, record.outputs.values, robot, signs)
        notes += _notes_on_dead_band(record, robot)
        record.events += _stop_thrusters(command, record.turns, time, robot)
        demand = _with_given(demand, record, time, command, robot)
    else:
        asks.append(
            "It holds no outputs: what the autopilot gave is what its method gives, not what it "
            "sent."
        )
        if record.unmet is not None:
            unmet = np.nan_to_num(record.unmet.values * unit, posinf=0.0, neginf=0.0)
    is_kept &= _at_work(source, record, time, command, robot, notes)
    if is_kept.sum() < 2:
        raise DataError(
            f"{source}: holds no demands while outputs moved; there is nothing to judge"
        )
    if len(time) > MAX_SAMPLES:
        raise DataError(
            f"{source}: holds {len(time):,} samples, expected up to {MAX_SAMPLES:,}; cut it"
        )
    step = np.diff(time, append=time[-1] + np.median(np.diff(time)))
    jump_s = max(series.max_jump_back, record.demand.max_jump_back)
    notes += _notes_on_time(step[is_kept], jump_s)
    undriven = [axis for axis, size in zip(AXES, unit, strict=True) if np.isnan(size)]
    if undriven:
        notes.append(
            f"No thruster drives {', '.join(undriven)}; what was asked there is not judged."
        )
    return Log(
        source=source,
        form=record.form,
        robot=robot,
        time=time[is_kept],
        span=np.minimum(step, GAP_S)[is_kept],
        demand=demand[is_kept],
        command=None if command is None else command[is_kept],
        unmet=None if unmet is None else unmet[is_kept],
        events=tuple(sorted(record.events, key=lambda event: event.time)),
        notes=tuple(dict.fromkeys(notes)),
        asks=tuple(asks),
    )


def _at_work(
    source: str,
    record: LogRecord,
    time: Array,
    command: Array | None,
    robot: Layout,
    notes: list[str],
) -> NDArray[np.bool_]:
    """Whether the robot was at work at each time (N,): by what the record says of it, else by
    commands (N, n, 3) that differ from those at rest; adds notes on what is left out."""
    counts = working_time(source, record, time, notes)
    if counts is not None:
        return counts
    if command is None:
        return np.ones(len(time), bool)
    is_idle = (np.nan_to_num(command) == rest_command(robot)).all(axis=(1, 2))
    if is_idle.any():
        notes.append("Times at which no output moved, such as before arming, are left out.")
    return np.asarray(~is_idle)


def _with_given(
    demand: Array, record: LogRecord, time: Array, command: Array, robot: Layout
) -> Array:
    """Demands (N, 6), with the wrench of the outputs along axes whose demand the log lacks at a
    time."""
    if record.unlogged is None:
        return demand
    is_unlogged = (record.unlogged.at(time) > 0.0) & robot.commanded
    return np.where(is_unlogged, plant_of(robot).wrench(command), demand)


def _notes_on_dead_band(record: LogRecord, robot: Layout) -> list[str]:
    """A sentence on outputs that ESCs take for rest."""
    if record.form != "ardusub" or record.outputs is None:
        return []
    shares = record.outputs.values[:, : robot.n]
    is_plain = np.array([_pulse_table(actuator) is None for actuator in robot.actuators])
    is_dead = in_dead_band(shares) & (shares != 0.0) & is_plain[: shares.shape[1]]
    if not is_dead.any():
        return []
    return [
        f"Pulses within {ESC_DEAD_BAND_US:.0f} us of rest, the dead band of ESCs, count as 0 N: "
        f"{is_dead.mean():.0%} of all."
    ]


def _pulse_table(actuator: Actuator) -> PowerTable | None:
    """The actuator's table of force over the width of its pulse; None where it has none."""
    model = getattr(actuator, "model", None)
    return model if isinstance(model, PowerTable) and model.unit == "us" else None


def _notes_on_time(step: Array, jump_s: float) -> list[str]:
    """Sentences on gaps between samples and on a clock that jumps back.

    Args:
        step: times from each sample to the next (N,) [s].
        jump_s: largest step of the clock backwards [s].
    """
    notes = []
    gap_s = float(np.maximum(step - GAP_S, 0.0).sum())
    if gap_s > 0.0:
        notes.append(f"Gaps between samples, {gap_s:.0f} s beyond {GAP_S:g} s each, are left out.")
    if jump_s:
        notes.append(
            f"Its clock jumps back, by up to {jump_s:.3g} s; samples were sorted by their times."
        )
    return notes


def _stop_thrusters(
    command: Array, turns: Series | None, time: Array, robot: Layout
) -> list[Event]:
    """Sets commands (N, n, 3) of thrusters that stopped turning to NaN from then on; returns the
    events."""
    events = []
    for i, k in _stopped_thrusters(command, turns, time, robot):
        words = "stood still from here on although it was told to push"
        events.append(Event(float(time[k]), words, i))
        command[k:, i] = np.nan
    return events


def _stopped_thrusters(
    command: Array, turns: Series | None, time: Array, robot: Layout
) -> Iterator[tuple[int, int]]:
    """Yields thrusters that stopped turning although commanded to push, each with the sample at
    which that began.

    Args:
        command: commands (N, n, 3).
        turns: how fast motors turned; None where no ESC says it.
        time: times of the commands (N,) [s].
        robot: the robot.
    """
    speed = np.empty((len(time), 0)) if turns is None else turns.at(time)
    spans = np.minimum(np.diff(time, append=time[-1:]), GAP_S)
    force_max = np.maximum(robot.upper, -robot.lower)[:, 0]
    for i, is_turning in enumerate(speed.T[: robot.n] != 0.0):
        is_pushing = np.abs(command[:, i, 0]) > PUSHING_SHARE * force_max[i]
        is_pushing[: len(is_turning) - is_turning[::-1].argmax()] = False
        if np.nan_to_num(speed[:, i]).any() and spans[is_pushing].sum() > MIN_STILL_S:
            yield i, int(is_pushing.argmax())


def rest_command(robot: Layout) -> Array:
    """Commands (n, 3) of actuators at rest."""
    return np.asarray(np.clip(0.0, robot.lower, robot.upper))


def commands_of(record: LogRecord, outputs: Array, robot: Layout, signs: Array) -> Array:
    """Returns the commands (M, n, 3) of the outputs in a log.

    Args:
        record: the record of the log.
        outputs: its outputs (M, k).
        robot: the robot.
        signs: of `_motor_signs`, (n,).

    Raises:
        LayoutError: the outputs are those of another robot.
    """
    n = robot.n
    k = outputs.shape[1]
    if not record.of_shares and k == 3 * n:
        return np.asarray(outputs.reshape(-1, n, 3))
    if k < n or (k != n and record.form in ("ros", "finlab")):
        or_commands = "" if record.of_shares else f" or {3 * n}"
        raise LayoutError(
            f"layout {robot.name!r:.60} has {robot.counts_in_words}, and the log {k} outputs, not "
            f"{n}{or_commands}"
        )
    robot.require_kind("a log with one output for each actuator", "thruster")
    values = outputs[:, :n] * signs
    command = np.zeros((len(values), n, 3))
    low = robot.lower[:, 0]
    high = robot.upper[:, 0]
    force = np.where(values < 0.0, -values * low, values * high) if record.of_shares else values
    if record.form == "ardusub":
        force = np.where(in_dead_band(values), 0.0, force)
        for i, actuator in enumerate(robot.actuators):
            table = _pulse_table(actuator)
            if table is not None:
                force[:, i] = np.interp(REST_US + FULL_US * values[:, i], *table.columns[:2])
    command[..., 0] = np.clip(force, low, high)
    command[np.isnan(values)] = np.nan
    return command
