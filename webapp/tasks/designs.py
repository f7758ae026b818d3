"""Designs as a whole: new, opened, saved, shared by a link."""

import json
from collections.abc import Callable
from functools import partial

from finlab.layout import Layout
from webapp.presses import Presses
from webapp.scene.meshes.hull import hull_of
from webapp.session import files
from webapp.session.companions import Opened
from webapp.session.design_links import FRAGMENT, packed, unpacked
from webapp.tasks.context import Context
from webapp.tasks.exports import Exports
from webapp.viser_internals import run_script


class Designs:
    """What one page does with whole designs."""

    def __init__(self, context: Context, exports: Exports, presses: Presses) -> None:
        """Hear from the page which link it was opened with."""
        self._context, self._session, self._exports = context, context.session, exports
        presses.on("design-link", lambda _, text: self.open_link(text))

    def new(self) -> None:
        """A robot with one hull and one fin."""
        self._session.new_layout()

    def open(self, name: str, content: bytes) -> None:
        """A design from a file that the browser sent."""
        self._read(partial(files.read_layout, name, content))

    def open_link(self, text: str) -> None:
        """A design from the part of an address behind the #; it may be anything."""
        self._read(partial(unpacked, text.removeprefix(FRAGMENT)))

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

    def share(self) -> None:
        """Show the link that carries the design, and take it to the clipboard where the browser lets us."""
        layout = self._session.state.layout
        self._context.reading.make(partial(packed, layout), partial(self._show, layout))

    def _show(self, layout: Layout, text: str) -> None:
        card = json.dumps([FRAGMENT + text, layout.name])
        run_script(self._context.client.gui, f"finlabDesigns.share(...{card});")
