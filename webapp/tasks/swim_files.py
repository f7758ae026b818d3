"""A swim as files: a table, pictures; made beside the page, which goes on."""

import io
import tempfile
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

from finlab.errors import FinlabError
from finlab.evaluation.plots.closed_loop_run import save_pictures
from finlab.sim.log_csv import csv_of
from webapp.session.files import file_stem
from webapp.tasks.context import Context
from webapp.tasks.recorded import Recorded
from webapp.tasks.swimming import Swimming

SHORTEST = 5
"""Ticks of which pictures can be made."""


class SwimFiles:
    """Makes files of the swim that a page shows."""

    def __init__(self, context: Context, swimming: Swimming, changed: Callable[[], None]) -> None:
        """`changed` is called on the loop when there is something new to tell."""
        self._context, self._swimming, self._changed = context, swimming, changed
        self.making = ""
        """Name of the file that is being made; empty where there is none."""

    def table(self) -> None:
        """Send the log as CSV; an archive of them where there are several robots."""
        records = self._records()
        names = _names(records)
        if len(records) == 1:
            self._make(f"{names[0]}.csv", lambda: csv_of(records[0].log).encode())
            return

        def archive() -> bytes:
            logs = zip(names, records, strict=True)
            return _archive({f"{name}.csv": csv_of(record.log).encode() for name, record in logs})

        self._make(f"{names[0]}_csv.zip", archive)

    def pictures(self) -> None:
        """Send path, errors, commands and wrench of each robot as pictures."""
        records = self._records()
        names = _names(records)

        def made() -> bytes:
            with tempfile.TemporaryDirectory() as place:
                folder = Path(place)
                for name, record in zip(names, records, strict=True):
                    (folder / name).mkdir()
                    save_pictures(record.log, folder / name)
                files = sorted(folder.rglob("*.png"))
                return _archive({str(path.relative_to(folder)): path.read_bytes() for path in files})

        self._make(f"{names[0]}_plots.zip", made)

    def _records(self) -> tuple[Recorded, ...]:
        if self.making:
            raise FinlabError(f"{self.making} is being made; wait for it")
        records = self._swimming.records()
        if short := [record for record in records if record.log.n_ticks < SHORTEST]:
            raise FinlabError(f"{short[0].method} has swum too little yet; let it swim for half a second")
        return records

    def _make(self, name: str, make: Callable[[], bytes]) -> None:
        """Have a worker make a file, and send it."""
        loop, context = self._context.loop, self._context
        self._tell(name)

        def send(content: bytes) -> None:
            self._tell("")
            context.client.send_file_download(name, content, save_immediately=True)

        def failed(text: str) -> None:
            self._tell("")
            context.notify("Not exported", text)

        context.workers.fits.submit(
            (id(self), "swim"),
            lambda: loop.post(partial(send, make())),
            lambda text: loop.post(partial(failed, text)),
        )

    def _tell(self, name: str) -> None:
        self.making = name
        self._changed()


def _words(records: tuple[Recorded, ...]) -> list[str]:
    """What each robot is called in a picture, each otherwise."""
    words = [f"{record.method}, {record.about}" for record in records]
    return [f"{text} ({k + 1})" if words.index(text) < k else text for k, text in enumerate(words)]


def _names(records: tuple[Recorded, ...]) -> list[str]:
    """The same as names of files."""
    return [
        file_stem(f"{record.layout.name}_{words}")
        for words, record in zip(_words(records), records, strict=True)
    ]


def _archive(files: dict[str, bytes]) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return content.getvalue()
