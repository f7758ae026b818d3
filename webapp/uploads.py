"""Files on their way from a browser: each is gathered up to the size that it announced, and no further."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import viser

from webapp.viser_internals import acknowledge, hear_uploads, uuid_of

MOST_AT_ONCE = 4
MOST_IN_ALL = 200_000_000
"""Bytes that all pages together have on the way; of more, the file that has waited longest is dropped."""
SILENCE_S = 30.0
"""How long the next part of a file may take [s]."""

Take = Callable[[str, bytes], object]


@dataclass(eq=False)
class Upload:
    """One file on its way."""

    owner: "Uploads"
    key: str
    """What the page calls it."""
    button: str
    """What the page calls the button that it was chosen with."""
    name: str
    size: int
    """Bytes that it has, as announced."""
    parts: int
    content: bytearray = field(default_factory=bytearray)
    came: int = 0
    timer: asyncio.TimerHandle | None = None
    """Ends it when nothing comes any more."""


_under_way: dict[Upload, None] = {}
"""Of all pages, the one that was heard of longest ago first. Belongs to the event loop."""


class Uploads:
    """The files that one page sends. Takes the place of viser's own gathering, which trusts the page.

    All methods are called on the event loop.
    """

    def __init__(self, gui: viser.GuiApi, most: int, refuse: Callable[[str], None]) -> None:
        """Listen to a page.

        Args:
            gui: the page's.
            most: largest file that is taken [bytes].
            refuse: is called with a sentence that says why a file is not taken.
        """
        self._gui, self._most, self._refuse = gui, most, refuse
        self._takers: dict[str, Take] = {}
        hear_uploads(gui, self._begin, self._gather)

    def on(self, button: viser.GuiUploadButtonHandle, take: Take) -> None:
        """Call `take(name, content)` for each file that is chosen with a button."""
        self._takers[uuid_of(button)] = take

    def close(self) -> None:
        """The page has gone, and with it what it was sending."""
        for upload in self._own():
            self._end(upload)

    def _own(self) -> list[Upload]:
        return [upload for upload in _under_way if upload.owner is self]

    def _begin(self, client_id: Any, message: Any) -> None:
        name = str(message.filename)[-80:]
        size, parts, button = message.size_bytes, message.part_count, message.source_component_uuid
        if button not in self._takers or not all(type(count) is int for count in (size, parts)):
            return
        upload = Upload(self, str(message.transfer_uuid)[:80], button, name, size, parts)
        if not 0 <= size <= self._most:
            self._stop(
                upload, f"{name[-60:]}: has {size:,} bytes, expected at most {self._most:,}; nothing was read"
            )
        elif (parts == 0) != (size == 0) or not 0 <= parts <= size or len(self._own()) >= MOST_AT_ONCE:
            self._stop(upload, f"{name[-60:]}: cannot be taken; send it again, by itself")
        elif parts == 0:
            self._acknowledge(upload, 0)
            self._takers[button](name, b"")
        else:
            self._wait(upload)

    def _gather(self, client_id: Any, message: Any) -> None:
        upload = next((u for u in self._own() if u.key == message.transfer_uuid), None)
        if upload is None:
            return
        part = message.content
        whole = len(upload.content) + (len(part) if isinstance(part, bytes) else upload.size + 1)
        last = upload.came + 1 == upload.parts
        if message.part_index != upload.came or whole > upload.size or (last and whole < upload.size):
            self._stop(upload, f"{upload.name[-60:]}: came otherwise than announced; send it again")
            return
        upload.content += part
        upload.came += 1
        self._acknowledge(upload, whole)
        if not last:
            self._wait(upload)
            return
        self._end(upload)
        self._takers[upload.button](upload.name, bytes(upload.content))

    def _wait(self, upload: Upload) -> None:
        """For the next part; of too much in all, what was heard of longest ago goes."""
        self._end(upload)
        loop = asyncio.get_running_loop()
        upload.timer = loop.call_later(
            SILENCE_S, self._stop, upload, f"{upload.name[-60:]}: never came whole"
        )
        _under_way[upload] = None
        while sum(len(known.content) for known in _under_way) > MOST_IN_ALL:
            oldest = next(iter(_under_way))
            oldest.owner._stop(oldest, f"{oldest.name[-60:]}: too much is sent at once; send it again later")

    def _stop(self, upload: Upload, sentence: str) -> None:
        """Take no more of a file; its page stops showing how far it is."""
        self._end(upload)
        upload.content.clear()
        self._acknowledge(upload, upload.size)
        self._refuse(sentence)

    def _end(self, upload: Upload) -> None:
        if upload.timer is not None:
            upload.timer.cancel()
            upload.timer = None
        _under_way.pop(upload, None)

    def _acknowledge(self, upload: Upload, so_far: int) -> None:
        acknowledge(self._gui, upload.button, upload.key, so_far, upload.size)
