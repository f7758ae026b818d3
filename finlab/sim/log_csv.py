"""A swim as a table for spreadsheets and other programs: one row per control period, units in the header.

`finlab fit robot` reads it, too: `x` to `r` are what the sensors said, `FIN.A`, `FIN.f` and `FIN.phi` what
each fin was commanded. What is true of the simulated robot says so in its name.
"""

import csv
import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from finlab.arrays import AnyArray
from finlab.errors import DataError
from finlab.sim.log import RunLog
from finlab.whole_file import write_whole

MEASURED = (
    *("x [m]", "y [m]", "z [m]", "roll [rad]", "pitch [rad]", "yaw [rad]"),
    *("u [m/s]", "v [m/s]", "w [m/s]", "p [rad/s]", "q [rad/s]", "r [rad/s]"),
)
WRENCH = ("Fx [N]", "Fy [N]", "Fz [N]", "Tx [N m]", "Ty [N m]", "Tz [N m]")
"""Columns of a wrench in the body frame."""
COMMAND = ("A [rad]", "f [Hz]", "phi [rad]")
"""Columns of what a fin is commanded: half amplitude, frequency, zero direction."""


def csv_of(log: RunLog) -> str:
    """The log as CSV text; a cell is empty where nothing is known, as for the command of a lost fin."""
    columns = list(_columns(log))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([name for name, _ in columns])
    for row in np.column_stack([values for _, values in columns]).tolist():
        writer.writerow(["" if value != value else f"{value:.6g}" for value in row])
    return text.getvalue()


def save_csv(log: RunLog, path: str | Path) -> None:
    """Writes the log as a CSV file; a `DataError` where that is not possible."""
    write_whole(path, csv_of(log), DataError)


def _columns(log: RunLog) -> Iterator[tuple[str, AnyArray]]:
    """Headers and values (N,), in order."""
    yield "t [s]", log.time
    yield from zip(MEASURED, log.measured.T, strict=True)
    yield from _named("true", MEASURED[:3], log.position)
    yield from _named("true", ("qw", "qx", "qy", "qz"), log.quaternion)
    yield from _named("true", MEASURED[6:], log.motion)
    yield from _named("reference", MEASURED[:3], log.reference)
    yield "reference surge [m/s]", log.reference_surge
    yield from _named("water", ("vx [m/s]", "vy [m/s]", "vz [m/s]"), log.flow)
    for word, wrench in (("asked", log.asked), ("allocated", log.allocated), ("delivered", log.delivered)):
        yield from _named(word, WRENCH, wrench)
    for i, fin in enumerate(log.fins):
        for name, values in zip(COMMAND, log.command[:, i].T, strict=True):
            yield f"{fin}.{name}", values
        yield from _named(f"{fin} true", COMMAND, log.fin_motion[:, i])
        yield f"{fin} true angle [rad]", log.fin_angle[:, i]
        yield from _named(f"{fin} true", WRENCH[:3], log.fin_force[:, i])
        yield f"{fin} power inertial [W]", log.inertial_power[:, i]
        yield f"{fin} power torque [W]", log.torque_power[:, i]
        yield f"{fin} power with motor losses [W]", log.driving_power[:, i]
        yield f"{fin} works [0 or 1]", log.alive[:, i]
        yield f"{fin} probability of a fault", log.fault_probability[:, i]
        yield f"{fin} strength believed", log.strength[:, i]
        yield f"{fin} strength believed, std", log.strength_std[:, i]
    yield "allocation [ms]", log.solve_ms


def _named(word: str, names: tuple[str, ...], values: AnyArray) -> Iterator[tuple[str, AnyArray]]:
    return ((f"{word} {name}", column) for name, column in zip(names, values.T, strict=True))
