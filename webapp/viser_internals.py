"""Every use of viser's private parts (of 1.1.1), and its habits: look here first when viser is upgraded."""

import contextlib
import io
import threading
from collections.abc import Callable, Iterator
from functools import cache
from types import SimpleNamespace
from typing import Any, get_type_hints
from unittest.mock import patch
from zipfile import ZipFile

import viser
import websockets.asyncio.server as websockets_server
from viser import _icons, _messages
from viser._assignable_props_api import AssignablePropsBase
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from webapp.guard import Guard

_STARTING = threading.Lock()
LOCAL = Guard("127.0.0.1")
"""Lets only pages of this machine in."""


def start_server(guard: Guard = LOCAL, port: int = 0) -> viser.ViserServer:
    """A server behind a guard, without a banner of viser's own; `verbose=False` alone would leave it."""
    _quicken()
    with _STARTING, _guarded(guard), contextlib.redirect_stdout(io.StringIO()):
        return viser.ViserServer(host=guard.host, port=port, label="finlab", verbose=False)


@contextlib.contextmanager
def _guarded(guard: Guard) -> Iterator[None]:
    """Servers that start within this context ask the guard first. Viser has no hook for that."""
    serve = websockets_server.serve

    def guarded(*arguments: Any, process_request: Callable[..., Any] | None = None, **options: Any) -> Any:
        async def ask(connection: Any, request: Request) -> Any:
            headers = {name.lower(): value for name, value in request.headers.raw_items()}
            verdict = guard.check(request.path, headers)
            if verdict is not None:
                body = verdict.text.encode()
                answer = Headers({**verdict.headers, "Content-Type": "text/plain; charset=utf-8"})
                answer["Content-Length"] = str(len(body))
                answer["Connection"] = "close"
                return Response(verdict.status.value, verdict.status.phrase, answer, body)
            if process_request is None:
                return None
            result = process_request(connection, request)
            return await result if hasattr(result, "__await__") else result

        return serve(*arguments, process_request=ask, **options)

    with patch.object(websockets_server, "serve", guarded):
        yield


@cache
def _quicken() -> None:
    """Spare a first page what viser does again and again: it opens its archive of 4,000 icons for each one
    that it draws, half a second in all, and looks up the types of properties for each handle."""
    icons: Any = _icons
    opened: Any = cache(ZipFile)
    icons.zipfile = SimpleNamespace(ZipFile=lambda archive: contextlib.nullcontext(opened(archive)))
    handles: Any = AssignablePropsBase
    hints: Any = cache(get_type_hints)
    handles._prop_hints = property(lambda handle: hints(type(handle._impl.props)))


def put_marks(slider: viser.GuiSliderHandle[float], marks: tuple[tuple[float, str], ...]) -> None:
    """Other marks (value and text) on a slider that stands already; viser takes them only when it is made."""
    wanted = tuple(_messages.GuiSliderMark(value=value, label=text) for value, text in marks)
    if slider._marks != wanted:
        slider._marks = wanted


def uuid_of(handle: Any) -> str:
    """What a handle is called in the page."""
    return str(handle._impl.uuid)


def run_script(gui: viser.GuiApi, source: str) -> None:
    """Run a script in the page, as viser does to bring its plots."""
    gui._websock_interface.queue_message(_messages.RunJavascriptMessage(source=source))


def limit_uploads(gui: viser.GuiApi, most: int, refuse: Callable[[str, int], None]) -> None:
    """Take no file that says it has more bytes than `most`: viser would gather it in memory before anybody
    is asked. `refuse` is told its name and size on the event loop; what comes of it after that is dropped."""

    def begin(client_id: Any, message: Any) -> None:
        if message.size_bytes <= most:
            gui._handle_file_transfer_start(client_id, message)
            return
        size = message.size_bytes
        done = _messages.FileTransferPartAck(message.source_component_uuid, message.transfer_uuid, size, size)
        gui._websock_interface.queue_message(done)  # so that the page stops showing how far it is
        refuse(message.filename, size)

    gui._websock_interface._incoming_handlers[_messages.FileTransferStartUpload] = [begin]


def stop_server(server: viser.ViserServer) -> None:
    """Stop a server, silently."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def disable_sharing(server: viser.ViserServer) -> None:
    """Nobody may open the public share tunnel: viser lets every connected page ask for it."""
    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)


def disconnect_all(server: viser.ViserServer) -> None:
    """Drop every connection, as a bad network would; for tests."""
    server._websock_server.disconnect_all_clients()
