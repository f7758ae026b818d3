"""A file of measurements, or a finished force table, that becomes the model of a fin."""

import re
import tempfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from finlab.actuators.fin.models import read_table
from finlab.arrays import Array
from finlab.errors import DataError, FinlabError
from finlab.layout import FinModelSpec, Layout
from webapp.session.companions import stored_table
from webapp.session.files import table_folder
from webapp.tasks.background import Newest
from webapp.tasks.context import Context

if TYPE_CHECKING:  # scipy takes its time, and only who fits needs it
    from finlab.fit.fin_fit import FinFit

MAX_BYTES = 50_000_000
"""Largest file that the page takes; the command line reads ten times as much."""


@dataclass(frozen=True, eq=False)
class Upload:
    """A file that was dropped on a fin."""

    fin: str
    model: FinModelSpec
    name: str
    content: bytes


@dataclass(frozen=True, eq=False)
class Fitted:
    """What came of it."""

    upload: Upload
    """What it was made of; without its content."""
    model: FinModelSpec
    fit: "FinFit | None" = None
    """The fit; None where the file was a finished table."""
    advice: Array | None = None
    """Commands (5, 3) to measure next."""


class Fitting(Newest[Upload, Fitted]):
    """One file at a time for one page; what came of it goes on the fin at once, and undo takes it off."""

    def __init__(self, context: Context) -> None:
        """The page is rendered when there is progress."""
        super().__init__(context.loop, context.workers.fits, self._fit, self._put_on)
        self._context = context
        self.progress = ""

    def start(self, fin: str, name: str, content: bytes) -> None:
        """Begin with a file for a fin.

        Raises:
            FinlabError: another file is under way, the file is too large, or there is no such fin.
        """
        if self.busy:
            raise FinlabError("a fit is under way already; wait for it, or cancel it")
        short = re.sub(r"[^\w .()+-]", "_", Path(str(name)).name)[-60:].lstrip(". ") or "upload.csv"
        if len(content) > MAX_BYTES:
            raise DataError(too_large(short, len(content)))
        layout = self._context.session.state.layout
        model = layout.fins[layout.index(fin)].model
        self.forget()
        self.progress = "reading the file"
        self.ask(Upload(fin, model, short, content))

    def forget(self) -> None:
        """Cancel what is under way, and put away what came of the last file; the fin keeps its model."""
        super().forget()
        self.progress = ""

    def put_on_all(self) -> None:
        """The new model for all fins that still have the model that this fin had."""
        found, session = self.findings, self._context.session
        if found is not None:
            alike = [fin.name for fin in session.state.layout.fins if fin.model == found.upload.model]
            if not alike:
                raise FinlabError("no other fin has the model that this fin had")
            session.set_model(alike, model=found.model)

    def _put_on(self) -> None:
        """On the loop, when the worker is done."""
        self.progress = ""
        found, context = self.findings, self._context
        if found is None:
            context.notify("Not fitted", self.error or "nothing came of it")
            context.changed()
        else:
            context.do(partial(self._take_over, found))

    def _take_over(self, found: Fitted) -> None:
        upload, session = found.upload, self._context.session
        if _model_of(session.state.layout, upload.fin) != upload.model:
            self.forget()
            raise FinlabError(
                f"{upload.fin} is no longer the fin that {upload.name} was for; upload the file again"
            )
        session.set_model([upload.fin], model=found.model)

    def _fit(self, upload: Upload) -> Fitted:
        """On the worker's thread."""
        done = Upload(upload.fin, upload.model, upload.name, b"")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / upload.name
            path.write_bytes(upload.content)
            try:
                if _is_table(path):
                    return Fitted(done, stored_table(upload.content, table_folder()))
                return self._fit_measurements(path, upload, done)
            except FinlabError as error:
                raise type(error)(str(error).replace(f"{folder}/", "")) from None

    def _fit_measurements(self, path: Path, upload: Upload, done: Upload) -> Fitted:
        from finlab.fit.advice import next_measurements
        from finlab.fit.fin_file import fin_csv
        from finlab.fit.fin_fit import fit_fin
        from finlab.fit.measurements import read_measurements

        tell = partial(self._tell, upload)
        fit = fit_fin(read_measurements([path]), progress=tell)
        tell("writing the table")
        model = stored_table(fin_csv(fit).encode(), table_folder())
        return Fitted(done, model, fit, next_measurements(fit))

    def _tell(self, upload: Upload, words: str) -> None:
        """On the worker's thread, before each step: a fit whose result is not waited for ends here."""
        if upload is not self.question:
            raise FinlabError("cancelled")
        self._loop.post(partial(self._note, upload, words))

    def _note(self, upload: Upload, words: str) -> None:
        if upload is self.question and self.busy:
            self.progress = words
            self._context.changed()


def too_large(name: str, size: int) -> str:
    """What to say of a file that is too large for the page."""
    return (
        f"{name}: has {size:,} bytes, expected at most {MAX_BYTES:,}; cut it into shorter series, write "
        "cycle means, or use `finlab fit fin`"
    )


def _model_of(layout: Layout, name: str) -> FinModelSpec | None:
    return next((fin.model for fin in layout.fins if fin.name == name), None)


def _is_table(path: Path) -> bool:
    """Whether a file is a finished force table: every amplitude with every frequency and direction, once."""
    try:
        read_table(path)
    except DataError:
        return False
    return True
