"""The record of a swim: one row per control tick, as arrays, in memory and in an NPZ file."""

import io
import json
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from msgspec import defstruct

from finlab.arrays import AnyArray
from finlab.display import Table, html
from finlab.display.pictures import path_picture
from finlab.errors import DataError
from finlab.files.guarded import check_shapes, json_of, read_arrays
from finlab.files.schema import checked
from finlab.whole_file import write_whole

FORMAT = "finlab-swim"
VERSION = 4
_IN_FILE = {"force": "fin_force"}
"""Columns -> their names in an NPZ file, where the two differ."""
MAX_BYTES = 200_000_000
"""Largest log that is read, unpacked [bytes]; an hour has a quarter of it."""


def lies_over(quaternion: AnyArray) -> AnyArray:
    """Whether a body of attitudes (..., 4) as w, x, y, z lies on its side or stands on its end
    (...)."""
    tilt: AnyArray = (quaternion[..., 1:3] ** 2).sum(axis=-1)
    return tilt > 0.5


class Tick(NamedTuple):
    """What happened in one control period; N ticks of n fins make the columns of a `RunLog`."""

    time: float
    """At the beginning of the period [s]."""
    position: AnyArray
    """Position (3,) in the world, z up [m]."""
    quaternion: AnyArray
    """Attitude (4,) as w, x, y, z, body to world."""
    motion: AnyArray
    """Velocity (3,) [m/s] and angular rates (3,) [rad/s] in the body frame."""
    flow: AnyArray
    """Velocity of the water (3,) where the robot is, in the world [m/s]."""
    measured: AnyArray
    """What the sensors said last (12,): position [m], roll, pitch, yaw [rad], velocity [m/s] and
    angular rates [rad/s] in the body frame."""
    reference: AnyArray
    """Where the robot should be at `time` (3,) [m]."""
    reference_surge: float
    """How fast it should be along x [m/s]."""
    asked: AnyArray
    """Wrench (6,) that the controller asks for [N, N m], body frame."""
    allocated: AnyArray
    """Wrench (6,) that the commands give once the fins have followed them, by the fin law [N, N
    m]."""
    delivered: AnyArray
    """Wrench (6,) of the fins, mean over the period [N, N m]."""
    command: AnyArray
    """Command (n, 3): amplitude [rad], frequency [Hz], zero direction [rad]; NaN for a fin that is
    taken for lost."""
    fin_motion: AnyArray
    """What the fins did at the end of the period (n, 3), in the same units."""
    force: AnyArray
    """Force of each actuator (n, 3) in the body frame, mean over the period [N]."""
    inertial_power: AnyArray
    """|I alpha omega| of each fin (n,), mean over the period [W]."""
    driving_power: AnyArray
    """max(torque times speed, 0) of each fin with the heat in its motor's windings (n,), mean over
    the period [W]."""
    alive: AnyArray
    """Which fins move as commanded, stuck and torn ones among them (n,)."""
    fault_probability: AnyArray
    """What the monitor gives for each fin not being whole (n,), 0 to 1; NaN without a monitor."""
    strength: AnyArray
    """Share of its nominal thrust that the monitor gives each fin (n,); NaN without one."""
    strength_std: AnyArray
    """Standard deviation of that share (n,); NaN without one."""
    solve_ms: float
    """Time of the allocation [ms]."""


FINS = (None,)
COMMANDS = (None, 3)
SHAPES: dict[str, tuple[int | None, ...]] = {
    "position": (3,),
    "quaternion": (4,),
    "motion": (6,),
    "flow": (3,),
    "measured": (12,),
    "reference": (3,),
    "asked": (6,),
    "allocated": (6,),
    "delivered": (6,),
    "command": COMMANDS,
    "fin_motion": COMMANDS,
    "force": COMMANDS,
    "inertial_power": FINS,
    "driving_power": FINS,
    "alive": FINS,
    "fault_probability": FINS,
    "strength": FINS,
    "strength_std": FINS,
}
"""Shape of a column at each tick, None for the number of fins; the others are numbers."""


@dataclass(frozen=True)
class RunLog:
    """A whole swim: each column of `Tick` as an array with N rows, and what was swum."""

    layout: str
    names: tuple[str, ...]
    """Of the actuators."""
    method: str
    controller: str
    task: str
    water: str
    seed: int
    """Seed of the sensors' noise."""
    columns: dict[str, AnyArray]
    """Column name, as in `Tick`, to array (N, ...)."""

    def __getattr__(self, name: str) -> AnyArray:
        columns = self.__dict__.get("columns", {})
        if name not in columns:
            raise AttributeError(f"a swim log has no column {name!r}; it has {', '.join(columns)}")
        column: AnyArray = columns[name]
        return column

    @property
    def n_ticks(self) -> int:
        """How many ticks there are."""
        return len(self.columns["time"])

    @property
    def capsized_s(self) -> float | None:
        """When the robot first lay on its side or stood on its end [s]; None where it never did."""
        over = np.flatnonzero(lies_over(self.quaternion))
        return float(self.time[over[0]]) if len(over) else None

    def _repr_html_(self) -> str:
        off = np.linalg.norm(self.position - self.reference, axis=1)
        lost = {
            f"{name} lost": self.position[np.argmin(works)]
            for name, works in zip(self.names, self.alive.T, strict=True)
            if not works.all()
        }
        rows = [
            ("time [s]", f"{self.time[-1]:.1f}"),
            ("off the reference, root mean square [m]", f"{np.sqrt(np.mean(off**2)):.3f}"),
            ("off the reference, largest [m]", f"{off.max():.3f}"),
            ("mean power with motor losses [W]", f"{self.driving_power.sum(axis=1).mean():.2f}"),
        ]
        title = f"{self.layout} along {self.task} by {self.method}, controller {self.controller}"
        ends = [", ".join(lost)] if lost else []
        ends += (
            [] if self.capsized_s is None else [f"the robot capsized at {self.capsized_s:.1f} s"]
        )
        shown = title, self.reference, self.position, lost
        return html(
            [title, Table(("swim", ""), rows, (True, False)), *ends], lambda: path_picture(*shown)
        )

    def npz(self) -> bytes:
        """An NPZ file: one array per column, and `meta`, a JSON object with the rest."""
        meta: dict[str, Any] = {"format": FORMAT, "version": VERSION}
        meta |= {"fins" if name == "names" else name: getattr(self, name) for name, _ in _ABOUT}
        columns = {_IN_FILE.get(name, name): column for name, column in self.columns.items()}
        file = io.BytesIO()
        np.savez_compressed(file, allow_pickle=False, meta=np.array(json.dumps(meta)), **columns)
        return file.getvalue()

    def save(self, path: str | Path) -> None:
        """Writes the NPZ file; a `DataError` where it cannot be written."""
        write_whole(path, self.npz(), DataError)


_ABOUT = [(field.name, field.type) for field in fields(RunLog) if field.name != "columns"]
_FORM = [("format", Literal["finlab-swim"]), ("version", Literal[4])]
_About: Any = defstruct("About", [*_FORM, *_ABOUT], rename={"names": "fins"})
"""What an NPZ file says of a swim beside its columns."""


def log_of_ticks(ticks: list[Tick], **about: Any) -> RunLog:
    """The log of ticks in order; `about` holds the other fields of `RunLog`."""
    columns = {name: np.array([getattr(tick, name) for tick in ticks]) for name in Tick._fields}
    return RunLog(columns=columns, **about)


def load_log(path: str | Path) -> RunLog:
    """Reads what `RunLog.save` wrote; a `DataError` where the file is missing, or no log of this
    version."""
    what = "a swim log written by finlab simulate"
    in_file = [_IN_FILE.get(name, name) for name in Tick._fields]
    arrays = read_arrays(path, ("meta", *in_file), MAX_BYTES, what)
    columns = {
        "meta": arrays["meta"],
        **{name: arrays[own] for name, own in zip(Tick._fields, in_file, strict=True)},
    }
    about = checked(
        json_of(columns.pop("meta"), f"{path}: meta"), _About, DataError, f"{path}: meta"
    )
    n = columns["time"].size
    fins = len(about.names)
    shapes = {
        name: tuple(fins if size is None else size for size in SHAPES.get(name, ()))
        for name in columns
    }
    check_shapes(columns, {name: (n, *shape) for name, shape in shapes.items()}, str(path))
    return RunLog(columns=columns, **{name: getattr(about, name) for name, _ in _ABOUT})
