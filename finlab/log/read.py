"""Reads a log and poses it for one robot: demands in newtons, outputs as commands of its
actuators."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from finlab.actuators.thrust_model import PowerTable
from finlab.allocation.baselines.autopilots import ArduSub, Px4
from finlab.allocation.solution import PlainData
from finlab.arrays import Array
from finlab.assets import install
from finlab.axes import AXES
from finlab.errors import DataError, FinlabError, LayoutError
from finlab.files.guarded import read_file
from finlab.layout import Layout, load_layout
from finlab.log import ardusub_log, px4_log, ros_bag
from finlab.log.ardusub_log import FULL_US, REST_US
from finlab.log.recorded import Event, Form, Recorded, Series
from finlab.physics.objective import yardstick

MOST_BYTES = 1_000_000_000
"""Largest log."""
MOST_FORCE = 1e9
"""Largest demand that is no fault of the file [N, N m]."""
MOST_SAMPLES = 1_000_000
"""Most samples of demands: five hours at 50 Hz."""
GAP_S = 1.0
"""Longest time that a sample holds; what lies beyond it was not logged."""

STILL_S, PUSHES = 1.0, 0.2
"""How long [s] a thruster is told to push, by this share of its most at least, before it is dead
for not turning."""


@dataclass(frozen=True, eq=False)
class Log(PlainData):
    """What a robot was asked for and told, as plain data; wrenches in x forward, y left, z up."""

    source: str
    """Name of the file."""
    form: Form
    """Whose log it is: `px4`, `ardusub`, `ros`."""
    robot: Layout
    """By whose laws it is judged."""
    time: Array
    """Of each sample on the log's clock (N,) [s], rising."""
    span: Array
    """How long each held (N,) [s]."""
    demand: Array
    """Wrench that was asked for (N, 6) [N, N m]; NaN along an axis that does not count."""
    command: Array | None
    """What the actuators were told (N, n, 3), as their laws take it, NaN for one that was stopped;
    None where the log holds no outputs."""
    unmet: Array | None
    """What the autopilot says that it left of each demand (N, 6) [N, N m]; None where it says
    nothing, or the log holds outputs."""
    events: tuple[Event, ...]
    """What the log says of the robot's health, by time."""
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
) -> Log:
    """Reads a log of PX4 (`.ulg`), of ArduSub (`.bin`) or a bag of ROS.

    It runs in this process: files of strangers belong in `finlab.files.worker.in_worker`.

    Args:
        path: of the file, or of a bag's folder.
        robot: a layout, or what `load_layout` takes; by the log's own parameters when None.
        scale: what a setpoint of 1 asks for on each axis (6,) [N, N m]; of ROS what wrenches are
            multiplied by. By the autopilot's own rule and the robot's forces when None.
        demand: topic of a bag that holds the wrench; the only one there when None.
        outputs: topic of a bag that holds what actuators were sent; the only one there when None.

    Raises:
        DataError: the file is damaged, of another kind or too large, or lacks what no option gives;
            or the package that reads it is not installed.
        LayoutError: the robot cannot be read, or does not fit the log's motors.
    """
    place = Path(path)
    try:
        record = _recorded(place, demand, outputs)
    except ModuleNotFoundError as error:
        raise DataError(f"{place}: {error.name} is not installed; run: {install('logs')}") from None
    except FinlabError:
        raise
    except Exception as problem:  # of many kinds, by a file that is damaged
        why = f"{type(problem).__name__}: {problem!s:.80}"
        damaged = f"cannot be read as a log ({why}); it is damaged or of an unknown version"
        raise DataError(f"{place}: {damaged}") from None
    known = load_layout(robot) if isinstance(robot, str) else robot or record.layout
    if known is None:
        raise DataError(f"{place}: {record.lacking[0]}")
    if known is record.layout:
        record.notes, record.asks = record.notes + record.taken, record.lacking + record.asks
    return _posed(place.name, record, known, scale)


def _recorded(place: Path, demand: str | None, outputs: str | None) -> Recorded:
    folder = place.is_dir()
    head = b"" if folder else read_file(place, MOST_BYTES, "a log", head=64)
    if head.startswith(px4_log.MAGIC):
        return px4_log.read_ulog(place)
    if head.startswith(ardusub_log.MAGIC):
        return ardusub_log.read_dataflash(place)
    if folder and sum(each.stat().st_size for each in place.iterdir()) > MOST_BYTES:
        raise DataError(f"{place}: is larger than {MOST_BYTES:,} bytes; cut it")
    if folder or place.suffix.lower() in ros_bag.ENDS:
        return ros_bag.read_bag(place, demand, outputs)
    raise DataError(f"{place}: expected a log of PX4 (.ulg), of ArduSub (.bin), or a bag of ROS 2")


def _sides(own: Layout | None, robot: Layout) -> Array:
    """1 for each actuator (n,) that pushes as the log's motor in its place does, if the log says
    that, and -1 for one mounted the other way round. Raises LayoutError: they do not fit."""
    if own is None or own is robot:
        return np.ones(robot.n)
    if own.n != robot.n:
        raise LayoutError(
            f"layout {robot.name!r:.60} has {robot.counted}, and the log's parameters have "
            f"{own.n} motors"
        )
    axes = [[getattr(part, "axis", (0.0,) * 3) for part in each.actuators] for each in (own, robot)]
    along = np.einsum("nk,nk->n", *map(np.array, axes))
    if (apart := np.abs(along) < 0.5).any():
        raise LayoutError(
            f"{robot.names[apart.argmax()]!r:.60} of layout {robot.name!r:.60} pushes another way "
            "than the "
            "log's motor in its place; list the actuators in the order of the motors"
        )
    return np.asarray(np.sign(along))


def _unit(form: Form, robot: Layout, scale: ArrayLike | None) -> Array:
    """What a setpoint of 1 asks for on each axis (6,) [N, N m], x forward, y left, z up; NaN along
    an axis that the robot does not drive. Raises LayoutError: it has other actuators than an
    autopilot drives."""
    if scale is not None:
        unit = np.asarray(scale, np.float64)
        if unit.shape == (6,) and np.isfinite(unit).all() and (unit > 0.0).all():
            return unit
        raise DataError(
            f"scale: expected six numbers above 0, newtons and newton metres, got {scale!s:.80}"
        )
    if form == "ros":
        return np.ones(6)
    kind = Px4 if form == "px4" else ArduSub
    return np.abs(kind(robot, kind.settings_class(), yardstick(robot)).setpoint_unit)


def _posed(source: str, record: Recorded, robot: Layout, scale: ArrayLike | None) -> Log:
    """The log in the robot's newtons, at the times of its outputs, or else of what says what was
    left."""
    sides = _sides(record.layout, robot)
    unit = _unit(record.form, robot, scale)
    basis = record.outputs or record.unmet or record.demand
    time = basis.time
    notes = [*record.notes]
    asks = [*record.asks]
    demand = record.demand.at(time) * np.where(robot.commanded, unit, np.nan)
    kept = np.isfinite(demand).any(axis=1) & ~(np.abs(demand) > MOST_FORCE).any(axis=1)
    command = unmet = None
    if record.outputs is not None:
        command = commands_of(record, record.outputs.values, robot, sides)
        for i, k in _dead(command, record.turns, time, robot):
            words = "stood still from here on although it was told to push"
            record.events.append(Event(float(time[k]), words, i))
            command[k:, i] = np.nan
        idle = (np.nan_to_num(command) == robot_rest(robot)).all(axis=(1, 2))
        kept &= ~idle
        if idle.any():
            notes.append("Times at which no output moved, such as before arming, are left out.")
    else:
        asks.append(
            "It holds no outputs: what the autopilot gave is what its method gives, not what it "
            "sent."
        )
        if record.unmet is not None:
            unmet = np.nan_to_num(record.unmet.values * unit, posinf=0.0, neginf=0.0)
    if kept.sum() < 2:
        raise DataError(
            f"{source}: holds no demands while outputs moved; there is nothing to judge"
        )
    if len(time) > MOST_SAMPLES:
        raise DataError(
            f"{source}: holds {len(time):,} samples, expected up to {MOST_SAMPLES:,}; cut it"
        )
    step = np.diff(time, append=time[-1] + np.median(np.diff(time)))
    if (beyond := float(np.maximum(step - GAP_S, 0.0)[kept].sum())) > 0.0:
        notes.append(f"Gaps between samples, {beyond:.0f} s beyond {GAP_S:g} s each, are left out.")
    if back := max(basis.back, record.demand.back):
        notes.append(
            f"Its clock jumps back, by up to {back:.3g} s; samples were sorted by their times."
        )
    if undriven := [axis for axis, one in zip(AXES, unit, strict=True) if np.isnan(one)]:
        notes.append(
            f"No thruster drives {', '.join(undriven)}; what was asked there is not judged."
        )
    return Log(
        source=source,
        form=record.form,
        robot=robot,
        time=time[kept],
        span=np.minimum(step, GAP_S)[kept],
        demand=demand[kept],
        command=None if command is None else command[kept],
        unmet=None if unmet is None else unmet[kept],
        events=tuple(sorted(record.events, key=lambda event: event.time)),
        notes=tuple(dict.fromkeys(notes)),
        asks=tuple(asks),
    )


def _dead(
    command: Array, turns: Series | None, time: Array, robot: Layout
) -> Iterator[tuple[int, int]]:
    """Thrusters that turned once, but no more although told so (N, n, 3), and the sample where that
    began."""
    speed = np.empty((len(time), 0)) if turns is None else turns.at(time)
    held = np.minimum(np.diff(time, append=time[-1:]), GAP_S)
    most = np.maximum(robot.upper, -robot.lower)[:, 0]
    for i, turned in enumerate(speed.T[: robot.n] != 0.0):
        pushes = np.abs(command[:, i, 0]) > PUSHES * most[i]
        pushes[: len(turned) - turned[::-1].argmax()] = False
        if np.nan_to_num(speed[:, i]).any() and held[pushes].sum() > STILL_S:
            yield i, int(pushes.argmax())


def robot_rest(robot: Layout) -> Array:
    """Commands (n, 3) of actuators at rest."""
    return np.asarray(np.clip(0.0, robot.lower, robot.upper))


def commands_of(record: Recorded, outputs: Array, robot: Layout, sides: Array) -> Array:
    """Commands (M, n, 3) of the outputs (M, k) in a log. Raises LayoutError: they are of another
    robot."""
    n = robot.n
    k = outputs.shape[1]
    if not record.of_shares and k == 3 * n:
        return np.asarray(outputs.reshape(-1, n, 3))
    if k < n or (k != n and record.form == "ros"):
        thrice = "" if record.of_shares else f" or {3 * n}"
        raise LayoutError(
            f"layout {robot.name!r:.60} has {robot.counted}, and the log {k} outputs, not "
            f"{n}{thrice}"
        )
    robot.only("a log with one output for each actuator", "thruster")
    values = outputs[:, :n] * sides
    command = np.zeros((len(values), n, 3))
    low = robot.lower[:, 0]
    high = robot.upper[:, 0]
    force = np.where(values < 0.0, -values * low, values * high) if record.of_shares else values
    for i, part in enumerate(robot.actuators):
        model = getattr(part, "model", None)
        if record.form == "ardusub" and isinstance(model, PowerTable) and model.unit == "us":
            force[:, i] = np.interp(REST_US + FULL_US * values[:, i], *model.columns[:2])
    command[..., 0] = np.clip(force, low, high)
    command[np.isnan(values)] = np.nan
    return command
