"""Connections to the server until they are pages, and beyond: how many there may be, and for how long.

A connection waits until its page has said which sessions it knows. Waiting takes no thread. Of too many that
have come equally far, the one that has waited longest is dropped. An honest browser goes on at once, so it
comes in beside thousands that say nothing.
"""

import asyncio
import logging
from http import HTTPStatus
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.exceptions import SecurityError
from websockets.frames import Opcode
from websockets.http11 import Response

from webapp.guard import SECURE, Admission

STAGES = 3
"""How far a connection has come that is no page yet: it is open, it has asked, it has sent a message."""
MOST_WAITING = 100
"""Connections of each stage; a browser has one or two for less than a second."""
MOST_PAGES = 128
"""Pages that are open; of more, the one whose user has done nothing for the longest time is dropped."""
REQUEST_S = 15.0
"""How long a request, and its answer, may take [s]."""
PATIENCE_S = 90.0
"""How long a connection may wait [s]: a page on a slow machine has to load and draw first."""
MAX_MESSAGE = 16 * 1024 * 1024
"""Longest message from a page [bytes]: the picture of a large view."""

quiet = logging.getLogger("finlab.connections")
"""Of what strangers send wrongly, nothing is printed."""
quiet.setLevel(logging.CRITICAL + 1)


class Connections:
    """All connections of one server."""

    def __init__(self) -> None:
        """There are none yet."""
        self._waiting: tuple[dict[Connection, None], ...] = tuple({} for _ in range(STAGES))
        self._pages: dict[Connection, None] = {}

    def note(self, connection: "Connection", stage: int) -> None:
        """A connection has come to a stage."""
        if connection in self._pages or any(connection in known for known in self._waiting[stage:]):
            return
        self.leave(connection)
        waiting = self._waiting[stage]
        waiting[connection] = None
        if len(waiting) > MOST_WAITING:
            self._drop(next(iter(waiting)))

    def enter(self, connection: "Connection") -> None:
        """A connection has become a page."""
        self.leave(connection)
        self._pages[connection] = None
        if len(self._pages) > MOST_PAGES:
            self._drop(min(self._pages, key=lambda page: page.heard))

    def leave(self, connection: "Connection") -> None:
        """A connection has ended."""
        for known in (*self._waiting, self._pages):
            known.pop(connection, None)

    def expire(self, connection: "Connection") -> None:
        """The time of a connection is over; a page stays."""
        if connection not in self._pages:
            self._drop(connection)

    def _drop(self, connection: "Connection") -> None:
        self.leave(connection)
        connection.transport.abort()


class Connection(ServerConnection):
    """One connection, which answers what is no request in plain words."""

    def __init__(self, connections: Connections, *arguments: Any, **options: Any) -> None:
        """`connections` are those of its server; the rest is as the library has it."""
        super().__init__(*arguments, **options)
        self._connections = connections
        self._refused = False
        self._timer: asyncio.TimerHandle | None = None
        self.heard = self.loop.time()
        """When the page last sent something of its own [s], by the clock of the event loop."""

    def enter(self) -> None:
        """It has become a page."""
        self._connections.enter(self)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin to wait."""
        super().connection_made(transport)
        self._timer = self.loop.call_later(PATIENCE_S, self._connections.expire, self)
        self._connections.note(self, 0)

    def connection_lost(self, exc: Exception | None) -> None:
        """Nothing is waited for any more."""
        super().connection_lost(exc)
        if self._timer is not None:
            self._timer.cancel()
        self._connections.leave(self)

    def process_event(self, event: Any) -> None:
        """A request, or a frame of a page."""
        if self.request is None:
            self._connections.note(self, 1)
        elif event.opcode is Opcode.BINARY:
            self.heard = self.loop.time()
            self._connections.note(self, 2)
        super().process_event(event)

    def send_data(self) -> None:
        """Send what the library wants sent, and before it why a request could not be read."""
        error = self.protocol.handshake_exc
        cause = None if error is None else error.__cause__
        if self.request is None and cause is not None and not self._refused:
            self._refused = True
            self.transport.write(refusal(_reason(cause)).serialize())
        super().send_data()


def refusal(verdict: Admission) -> Response:
    """An answer in plain words."""
    body = verdict.text.encode()
    headers = Headers({**SECURE, **verdict.headers, "Content-Type": "text/plain; charset=utf-8"})
    headers["Content-Length"], headers["Connection"] = str(len(body)), "close"
    return Response(verdict.status.value, verdict.status.phrase, headers, body)


def _reason(error: BaseException) -> Admission:
    """What to say of a request that could not be read."""
    if isinstance(error, SecurityError):
        return Admission(HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE, "The request is too long.\n")
    if any(word in str(error) for word in ("HTTP method", "request body", "transfer codings", "int()")):
        text = "This server answers GET requests without a body.\n"
        return Admission(HTTPStatus.METHOD_NOT_ALLOWED, text, {"Allow": "GET"})
    return Admission(HTTPStatus.BAD_REQUEST, "This is no request of HTTP/1.1.\n")
