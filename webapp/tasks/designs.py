"""Designs as a whole: new, opened, saved, shared by a link, and those that this browser had lately."""

import contextlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from finlab.errors import FinlabError
from finlab.layout import Layout
from webapp.editables import Editables
from webapp.scene.meshes.hull import hull_of
from webapp.session import files
from webapp.session.companions import Opened
from webapp.session.design_links import FRAGMENT, packed, unpacked
from webapp.tasks.context import Context
from webapp.tasks.exports import Exports
from webapp.viser_internals import run_script

STORED = "finlab-designs"
"""Where a browser keeps its recent designs."""
MOST = 8
"""Designs that a browser keeps."""
LARGEST = 60_000
"""Most characters of a design that a browser keeps."""


@dataclass(frozen=True)
class Recent:
    """A design that this browser had."""

    name: str
    """Of the robot."""
    fins: int
    """How many."""
    when: float
    """When it was left or saved [s since 1970]."""
    text: str
    """The design, as in a link."""


class Designs:
    """What one page does with whole designs."""

    def __init__(self, context: Context, exports: Exports, editables: Editables) -> None:
        """Hear from the page what it has kept, and which link it was opened with."""
        self._context, self._session, self._exports = context, context.session, exports
        self.recent: list[Recent] = []
        """Newest first."""
        self._last = self._session.state.layout
        editables.on("designs-kept", lambda _, text: self._take_kept(text))
        editables.on("design-link", lambda _, text: context.do(partial(self.open_link, text)))
        editables.on_press("design-recent", lambda place, _: self.open_recent(place))

    def new(self) -> None:
        """A robot with one hull and one fin."""
        self._session.new_layout()

    def open(self, name: str, content: bytes) -> None:
        """A design from a file that the browser sent."""
        self._read(partial(files.read_layout, name, content))

    def open_together(self, parts: dict[str, bytes]) -> None:
        """A design from files that the browser sent at once, by their names."""
        self._read(partial(files.read_together, parts))

    def open_link(self, text: str) -> None:
        """A design from the part of an address behind the #; it may be anything."""
        self._read(partial(unpacked, text.removeprefix(FRAGMENT)))

    def open_recent(self, place: str) -> None:
        """A design that this browser had, by its place."""
        if not place.isdecimal() or int(place[:3]) >= len(self.recent):
            raise FinlabError("that design is not kept any more")
        self._read(partial(unpacked, self.recent[int(place)].text))

    def _read(self, read: Callable[[], Opened]) -> None:
        self._context.reading.read(read, self._take, lambda opened: hull_of(opened.layout))

    def _take(self, opened: Opened) -> None:
        self._session.open_layout(opened.layout)
        for file in opened.missing:
            text = f"{file} did not come along, so a hull that fits is drawn; put both into one ZIP archive"
            self._context.notify("Without its hull", text)

    def save(self) -> None:
        """Send the design's file to the browser."""
        layout = self._session.state.layout
        self._context.reading.make(partial(files.layout_file, layout), partial(self._send, layout))

    def _send(self, layout: Layout, file: tuple[str, bytes]) -> None:
        self._exports.download(*file)
        self._session.note_saved(layout)
        self._remember(layout)

    def save_as(self, name: str) -> None:
        """Another name for the robot, and its file to the browser."""
        self._session.rename_robot(name)
        self.save()

    def share(self) -> None:
        """Show the link that carries the design, and take it to the clipboard where the browser lets us."""
        layout = self._session.state.layout
        self._context.reading.make(partial(packed, layout), partial(self._show, layout))

    def _show(self, layout: Layout, text: str) -> None:
        card = json.dumps([FRAGMENT + text, layout.name])
        run_script(self._context.client.gui, f"finlabDesigns.share(...{card});")
        self._remember(layout)

    def note(self) -> None:
        """Called whenever the page is written: a design that was replaced by another one is kept."""
        layout, last = self._session.state.layout, self._last
        self._last = layout
        if layout.name != last.name and layout.fins != last.fins:
            self._remember(last)

    def _remember(self, layout: Layout) -> None:
        if files.shipped_name(layout) is None:
            with contextlib.suppress(FinlabError):  # the page is busy with other files
                self._context.reading.make(partial(_kept, layout), self._keep)

    def _keep(self, newest: Recent | None) -> None:
        if newest is not None:
            self.recent = [newest, *(old for old in self.recent if old.name != newest.name)][:MOST]
            kept = json.dumps([[r.name, r.fins, r.when, r.text] for r in self.recent])
            self._context.client.local_storage.set_item(STORED, kept)

    def _take_kept(self, text: str) -> None:
        """What the browser has kept, which may be anything; a design is only read when it is opened."""
        try:
            kept: Any = json.loads(text)
        except (ValueError, RecursionError):
            return
        for entry in kept[:MOST] if isinstance(kept, list) else []:
            kinds = [type(part) for part in entry] if isinstance(entry, list) else []
            if kinds in ([str, int, float, str], [str, int, int, str]):
                name, fins, when, design = entry
                self.recent.append(Recent(name[:64], fins, float(when), design))


def _kept(layout: Layout) -> Recent | None:
    """A design as a browser keeps it; None where it is too large, or a file of it is gone."""
    try:
        return Recent(layout.name, layout.n_fins, time.time(), packed(layout, LARGEST))
    except FinlabError:
        return None
