"""A swim to take home: a table, pictures, an animation; made beside the page, which goes on."""

import io
import tempfile
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

from finlab.errors import FinlabError
from finlab.evaluation.plots.animation import animation
from finlab.evaluation.plots.closed_loop_run import save_pictures
from finlab.evaluation.plots.compared_runs import draw_compared
from finlab.evaluation.plots.film import Swum
from finlab.sim.log_csv import csv_of
from webapp.session.files import file_stem
from webapp.tasks.context import Context
from webapp.tasks.recorded import Recorded
from webapp.tasks.swimming import Swimming

STEP = 0.05
"""Share of a file after which the page is sent its progress."""
SHORTEST = 5
"""Ticks of which pictures can be made."""


class SwimFiles:
    """Makes files of the swim that a page shows, and of the one that was kept."""

    def __init__(self, context: Context, swimming: Swimming, changed: Callable[[], None]) -> None:
        """`changed` is called on the loop when there is something new to tell."""
        self._context, self._swimming, self._changed = context, swimming, changed
        self.making = ""
        """Name of the file that is being made; empty where there is none."""
        self.share = 0.0
        """How far that is, 0 to 1."""

    def table(self) -> None:
        """Send the log as CSV; an archive of them where there are several robots."""
        records = self._records()
        names = _names(records)
        if len(records) == 1:
            self._make(f"{names[0]}.csv", lambda tell: csv_of(records[0].log).encode())
            return

        def archive(tell: Callable[[float], None]) -> bytes:
            logs = zip(names, records, strict=True)
            return _archive({f"{name}.csv": csv_of(record.log).encode() for name, record in logs})

        self._make(f"{names[0]}_csv.zip", archive)

    def pictures(self) -> None:
        """Send path, errors, commands and wrench of each robot as pictures, and all robots in one."""
        records = self._records()
        names = _names(records)

        def made(tell: Callable[[float], None]) -> bytes:
            with tempfile.TemporaryDirectory() as place:
                folder = Path(place)
                for k, (name, record) in enumerate(zip(names, records, strict=True)):
                    (folder / name).mkdir()
                    save_pictures(record.log, folder / name)
                    tell((k + 1) / (len(records) + 1))
                logs = {words: record.log for words, record in zip(_words(records), records, strict=True)}
                draw_compared(logs).save(folder / "compared.png")
                files = sorted(folder.rglob("*.png"))
                return _archive({str(path.relative_to(folder)): path.read_bytes() for path in files})

        self._make(f"{names[0]}_plots.zip", made)

    def animation(self) -> None:
        """Send the swim as an animated picture."""
        records = self._records()
        robots = [
            Swum(words, record.log, record.layout)
            for words, record in zip(_words(records), records, strict=True)
        ]
        self._make(f"{_names(records)[0]}.gif", lambda tell: animation(robots, progress=tell))

    def _records(self) -> tuple[Recorded, ...]:
        if self.making:
            raise FinlabError(f"{self.making} is being made; wait for it")
        records = self._swimming.records()
        if short := [record for record in records if record.log.n_ticks < SHORTEST]:
            raise FinlabError(f"{short[0].method} has swum too little yet; let it swim for half a second")
        return records

    def _make(self, name: str, make: Callable[[Callable[[float], None]], bytes]) -> None:
        """Have a worker make a file, and send it."""
        loop, client = self._context.loop, self._context.client
        self._tell(name, 0.0)
        told = 0.0

        def tell(share: float) -> None:
            nonlocal told
            if share - told >= STEP:
                told = share
                loop.post(partial(self._tell, name, share))

        def send(content: bytes) -> None:
            self._tell("", 0.0)
            client.send_file_download(name, content, save_immediately=True)

        def failed(text: str) -> None:
            self._tell("", 0.0)
            self._context.notify("Not exported", text)

        self._context.workers.fits.submit(
            (id(self), "swim"),
            lambda: loop.post(partial(send, make(tell))),
            lambda text: loop.post(partial(failed, text)),
        )

    def _tell(self, name: str, share: float) -> None:
        self.making, self.share = name, share
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
