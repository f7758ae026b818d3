"""A file of measurements, or a finished table, that becomes the model of a fin or a thruster."""

import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from finlab.actuators.fin.table_law import read_table
from finlab.actuators.thrust_model import PowerTable
from finlab.errors import DataError, FinlabError, LayoutError
from finlab.files.worker import in_worker
from finlab.layout import Actuator, Fin
from finlab.swim.design_files import stored_table
from webapp.session.files import table_folder
from webapp.tasks.context import Context
from webapp.tasks.slot import Slot, Work

if TYPE_CHECKING:  # scipy takes its time, and only who fits needs it
    from finlab.fit.fin_fit import FinFit
    from finlab.fit.thruster_fit import ThrusterFit

MAX_BYTES = 50_000_000
"""Largest file that the page takes; the command line reads ten times as much."""


@dataclass(frozen=True, eq=False)
class Upload:
    """A file that was dropped on an actuator."""

    actuator: Actuator
    name: str
    """Of the file."""
    content: bytes
    voltage: float | None = None
    """At which the rows count [V]; None where the user was not asked."""


@dataclass(frozen=True, eq=False)
class WhichVoltage:
    """A file of a thruster that was measured at several voltages: the user knows which counts."""

    upload: Upload
    levels: tuple[float, ...]
    """The voltages [V], rising."""


@dataclass(frozen=True, eq=False)
class FitResult:
    """The model that an upload became."""

    upload: Upload
    """What it was made of; without its content."""
    fields: dict[str, Any]
    """Fields of the actuator: its model, and what else was found."""
    fit: "FinFit | ThrusterFit | None" = None
    """The fit; None where the file was a finished table."""


class Fitting(Slot[Upload, FitResult | WhichVoltage]):
    """One file at a time for one page; what came of it goes on the fin at once, and undo takes it
    off."""

    def __init__(self, context: Context) -> None:
        super().__init__(
            context.pools.long,
            context.bell,
            fit_upload,
            watched=True,
            stage="reading the file",
            title="Not fitted",
        )
        self._session = context.session
        self.ask_voltage: Callable[[WhichVoltage], object] = lambda _: None
        """Asks the user which of several voltages counts."""
        self.result: FitResult | None = None
        """The fit; None where there is none, or where a voltage is asked for."""

    def forget(self) -> None:
        """Drop the file, and what came of it."""
        super().forget()
        self.result = None

    def start_at(self, choice: WhichVoltage, voltage: float) -> None:
        """Fit a file by its rows at one voltage [V]."""
        self.forget()
        self.ask(replace(choice.upload, voltage=voltage))

    def start(self, actuator_name: str, file_name: str, content: bytes) -> None:
        """Begin with a file for an actuator.

        Args:
            actuator_name: the actuator that was measured.
            file_name: what the user's file is called; its ending says how it is read.
            content: the file.

        Raises:
            FinlabError: another file is under way, the file is too large, or its kind of actuator
                has no table.
        """
        if self.busy:
            raise FinlabError("a fit is under way already; wait for it, or cancel it")
        short = short_name(file_name)
        if len(content) > MAX_BYTES:
            raise DataError(
                f"{short}: has {len(content):,} bytes, expected at most {MAX_BYTES:,}; cut it "
                "into shorter series, or write cycle means"
            )
        actuator = self._session.state.layout.actuator(actuator_name)
        if not actuator.KIND.models:
            raise FinlabError(
                f"{actuator_name} is a {actuator.type}, without a table; type its coefficients"
            )
        self.forget()
        self.ask(Upload(actuator, short, content))

    def put_on_all(self) -> None:
        """What was found for all that still have the model that this one had."""
        fit_result = self.result
        session = self._session
        if fit_result is not None:
            old_model = _model(fit_result.upload.actuator)
            alike = [
                actuator.name
                for actuator in session.state.layout.actuators
                if _model(actuator) == old_model
            ]
            if not alike:
                raise FinlabError("no other actuator has the model that this one had")
            session.set_model(alike, **fit_result.fields)

    def attend(self) -> bool:
        """Put what was found on its actuator. FinlabError: that is another one by now."""
        was_busy = self.busy
        came = super().attend()
        answer = self.answer
        self.result = answer if isinstance(answer, FitResult) else None
        if was_busy and not self.busy and isinstance(answer, WhichVoltage):
            self.forget()
            self.ask_voltage(answer)
        elif was_busy and not self.busy and isinstance(answer, FitResult):
            self._put_on(answer)
        return came

    def _put_on(self, fit_result: FitResult) -> None:
        """Gives the actuator of an upload its model. FinlabError: it has changed since."""
        upload = fit_result.upload
        session = self._session
        name = upload.actuator.name
        layout = session.state.layout
        if name not in layout.names or _model(layout.actuator(name)) != _model(upload.actuator):
            self.forget()
            raise FinlabError(f"{name} is no longer what {upload.name} was for; upload it again")
        session.set_model([name], **fit_result.fields)


def fit_upload(upload: Upload, work: Work[Upload]) -> FitResult | WhichVoltage:
    """Returns the model that a file becomes, or a question about it.

    Args:
        upload: the file and its actuator.
        work: takes reports, and ends a fit where it is cancelled.

    Raises:
        FinlabError: the file cannot be read or fitted, or the fit was cancelled.
    """
    # The result is kept, and the file may be large.
    without_content = replace(upload, content=b"")
    with as_file(upload.name, upload.content) as path:
        if not isinstance(upload.actuator, Fin):
            return _bench_fit(path, without_content, upload)
        if in_worker(_is_table, path):
            return FitResult(
                without_content, {"model": stored_table(upload.content, table_folder())}
            )
        return _fin_fit(path, without_content, work)


def _fin_fit(path: Path, upload: Upload, work: Work[Upload]) -> FitResult:
    """A fin by noisy measurements; a fit whose result is not waited for ends before its next
    step."""
    from finlab.fit.fin_fit import fin_csv, fit_fin
    from finlab.fit.measurements import read_measurements

    def tell(words: str) -> None:
        if work.cancelled.is_set():
            raise FinlabError("cancelled")
        work.report(words)

    fit = fit_fin(in_worker(read_measurements, [path]), progress=tell)
    tell("writing the table")
    model = stored_table(fin_csv(fit).encode(), table_folder())
    return FitResult(upload, {"model": model}, fit)


def short_name(name: str) -> str:
    """The name of an upload as that of a file here."""
    return re.sub(r"[^\w .()+-]", "_", Path(str(name)).name)[-60:].lstrip(". ") or "upload.csv"


@contextmanager
def as_file(name: str, content: bytes) -> Iterator[Path]:
    """An upload as a file while it is read; what is wrong with it is said without the file's
    folder."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(content)
        try:
            yield path
        except FinlabError as error:
            raise type(error)(str(error).replace(f"{folder}/", "")) from None


def _model(actuator: Actuator) -> object:
    """The model of an actuator; None where its kind has none."""
    return getattr(actuator, "model", None)


def _bench_fit(path: Path, upload: Upload, full_upload: Upload) -> FitResult | WhichVoltage:
    """A thruster, fixed or turning, by its bench table, or by a finished one; or the question which
    voltage counts, about the `full_upload` upload."""
    from finlab.fit.thruster_bench import VoltageError, read_bench
    from finlab.fit.thruster_fit import fit_thruster

    def fields_of(table: PowerTable) -> dict[str, Any]:
        """The model, and the limits of force that its table has."""
        least = table.rows[0][1]
        if upload.actuator.KIND.sticks_at_angle:
            # One that turns points the other way in place of a force below 0.
            least = max(least, 0.0)
        return {"model": table, "force": (least, table.rows[-1][1])}

    with suppress(LayoutError):
        return FitResult(upload, fields_of(in_worker(PowerTable.read, path)))
    try:
        bench = in_worker(read_bench, [path], upload.voltage)
    except VoltageError as error:
        return WhichVoltage(full_upload, error.levels)
    fit = fit_thruster(bench)
    more = {"dead_band": fit.dead_band, "torque_per_newton": fit.torque_per_newton}
    return FitResult(upload, {**fields_of(fit.table), **more, "uncertainty": None}, fit)


def _is_table(path: Path) -> bool:
    """Whether a file is a finished force table: every amplitude with every frequency and direction,
    once."""
    try:
        read_table(path)
    except DataError:
        return False
    return True
