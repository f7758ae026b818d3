"""Every use of viser's private parts in Python (of 1.1.1): look here first when viser is upgraded.

Each function says why it is needed. What would make it needless upstream, in `src/viser` of
viser-project/viser:

- `start_server`, `_guarded`: hooks for requests, headers and sizes of messages; `infra/_infra.py`,
  class `WebsockServer`.
- `_name_page`: title, icon and first page as arguments of `ViserServer`; `_viser.py`.
- `stored`: an awaitable `get_item` of `client.local_storage`; `_viser.py`.
- `_keep_property_types`: types of properties looked up once for each class;
  `_assignable_props_api.py`, `AssignablePropsBase._prop_hints`.
- `uuid_of`: a public name of a widget's element in the page; `_gui_handles.py`.
- `run_script`, `run_file`: a public way to run a script, as `add_plotly` does; `_gui_api.py`.
- `hold_uploads`: sizes and parts of files checked as they come; `_gui_api.py`,
  `_handle_file_transfer_part`.
- `disable_sharing`: an argument that closes the share tunnel; `_viser.py`, `ShareUrlRequest`.

The private parts that the page's scripts use are listed at the heads of `frames.js`, `presses.js`
and `habits.js`.
"""

import asyncio
import contextlib
import gzip
import io
import logging
import secrets
import threading
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from http import HTTPStatus
from importlib.resources import files
from operator import attrgetter
from typing import Any, get_type_hints
from unittest.mock import patch

import viser
import websockets.asyncio.server as websockets_server
from viser import _messages
from viser._assignable_props_api import AssignablePropsBase
from websockets.http11 import Request, Response

from webapp.guard import SECURE, Guard
from webapp.guard import answer as status_page

MAX_MESSAGE = 16 * 1024 * 1024
"""Longest message from a page [bytes]: the picture of a large view."""
_STARTING = threading.Lock()
quiet = logging.getLogger("finlab.connections")
"""Of what strangers send wrongly, nothing is printed."""
quiet.setLevel(logging.CRITICAL + 1)
LOCAL = Guard("127.0.0.1")
"""Lets only pages of this machine in."""


def start_server(guard: Guard = LOCAL, port: int = 0) -> viser.ViserServer:
    """A server behind a guard, without a banner of viser's own; `verbose=False` alone would leave
    it."""
    _keep_property_types()
    with _STARTING, _guarded(guard), contextlib.redirect_stdout(io.StringIO()):
        return viser.ViserServer(host=guard.host, port=port, label="finlab", verbose=False)


@contextlib.contextmanager
def _guarded(guard: Guard) -> Iterator[None]:
    """Servers that start within this context ask the guard first. Viser has no hook for that."""
    serve = websockets_server.serve

    def guarded(*arguments: Any, process_request: Any = None, **options: Any) -> Any:
        def ask(connection: Any, request: Request) -> Response | None:
            headers = {name.lower(): value for name, value in request.headers.raw_items()}
            verdict = guard.check(request.path, headers)
            try:
                answer: Response | None = verdict or process_request(connection, request)
            except OSError:  # viser looks for a file of that name, which may be too long for one
                answer = status_page(HTTPStatus.NOT_FOUND, "There is no such page.\n")
            return answer if verdict is not None or answer is None else _name_page(answer)

        def secured(connection: Any, request: Request, response: Response) -> None:
            for name, value in SECURE.items():
                response.headers.setdefault(name, value)

        ours = {
            "process_request": ask,
            "process_response": secured,
            "max_size": MAX_MESSAGE,
            "server_header": None,
            "logger": quiet,
        }
        return serve(*arguments, **{**options, **ours})

    with patch.object(websockets_server, "serve", guarded):
        yield


def _name_page(answer: Response) -> Response:
    """Let an answer of viser's bring our first page: with our name and icon, and without its
    panel."""
    if answer.headers.get("Content-Type", "").startswith("text/html"):
        answer.body = _named(bytes(answer.body), answer.headers.get("Content-Encoding") == "gzip")
        del answer.headers["Content-Length"]
        answer.headers["Content-Length"] = str(len(answer.body))
    return answer


@cache
def _named(body: bytes, zipped: bool) -> bytes:
    ours = files("webapp.markup").joinpath("first_page.html").read_bytes()
    plain = gzip.decompress(body) if zipped else body
    plain = plain.replace(b'rel="icon"', b'rel="alternate"', 1).replace(
        b"<title>Viser</title>", ours, 1
    )
    return gzip.compress(plain) if zipped else plain


async def stored(client: viser.ClientHandle, key: str, patience: Sequence[float]) -> str | None:
    """What a browser keeps for us; `client.local_storage` would hold a thread until it answers.

    A page that is just reconnecting may drop the question, so it is repeated, after each time [s]
    of `patience` but the last one. TimeoutError: it did not answer at all. RuntimeError: it forbids
    storage.
    """
    connection = client._websock_connection
    question = f"finlab-{secrets.token_hex(8)}"
    answer: asyncio.Future[Any] = asyncio.get_running_loop().create_future()

    def hear(client_id: int, message: Any) -> None:
        if message.request_uuid == question and not answer.done():
            answer.set_result(message)

    kind = _messages.LocalStorageGetItemResponseMessage
    connection.register_handler(kind, hear)
    try:
        for seconds in patience:
            connection.queue_message(_messages.LocalStorageGetItemRequestMessage(key, question))
            client.flush()
            if (await asyncio.wait([answer], timeout=seconds))[0]:
                break
        else:
            raise TimeoutError(f"the browser said nothing of {key}")
    finally:
        connection.unregister_handler(kind, hear)
    if answer.result().error is not None:
        raise RuntimeError(f"the browser says nothing of {key}: {answer.result().error}")
    value = answer.result().value
    return value if isinstance(value, str) else None


@cache
def _keep_property_types() -> None:
    """Let viser look up the types of a handle's properties once for each class, in place of once
    for each handle: of the 500 handles of a page that takes a third of the time to build it."""
    for name, props in vars(_messages).items():
        if name.endswith("Props"):
            props.finlab_hints = get_type_hints(props)
    handles: Any = AssignablePropsBase
    handles._prop_hints = property(attrgetter("_impl.props.finlab_hints"))


def uuid_of(handle: Any) -> str:
    """What a handle is called in the page."""
    return str(handle._impl.uuid)


def run_script(gui: viser.GuiApi, source: str) -> None:
    """Run a script in the page, as viser does to bring its plots."""
    gui._websock_interface.queue_message(_messages.RunJavascriptMessage(source=source))


def run_file(gui: viser.GuiApi, name: str, more: str = "") -> None:
    """Run a script that lies beside this file, and a line more."""
    run_script(gui, files("webapp").joinpath(name).read_text("utf-8") + more)


def hold_uploads(gui: viser.GuiApi, most: int, refuse: Callable[[str], object]) -> None:
    """Hold what a page sends against what it announced, where viser trusts it until the last part,
    and what is on its way from it against `most` bytes; `refuse` hears why a file is dropped."""
    interface = gui._websock_interface
    states = gui._current_file_upload_states

    def drop(message: Any, size: int, sentence: str) -> None:
        states.pop(message.transfer_uuid, None)
        done = message.source_component_uuid, message.transfer_uuid, size, size
        interface.queue_message(_messages.FileTransferPartAck(*done))  # the page waits no longer
        refuse(sentence)

    def begin(client: Any, message: Any) -> None:
        name = str(message.filename)[-80:]
        size = message.size_bytes
        parts = message.part_count
        if type(size) is not int or type(parts) is not int or not 0 <= parts <= max(size, 0):
            drop(message, 0, f"{name}: is announced with {size!r:.20} bytes in {parts!r:.20} parts")
        elif size + sum(state["total_bytes"] for state in states.values()) > most:
            drop(
                message,
                size,
                f"{name}: has {size:,} bytes, expected at most {most:,} on their way at once",
            )
        else:
            gui._handle_file_transfer_start(client, message)

    def gather(client: Any, message: Any) -> None:
        state = states.get(message.transfer_uuid)
        if state is None:
            return
        came = len(message.content) if isinstance(message.content, bytes) else most
        if state["transferred_bytes"] + came > (size := state["total_bytes"]):
            drop(
                message,
                size,
                f"{state['filename'][-80:]}: sends more than the {size:,} bytes it announced",
            )
        else:
            gui._handle_file_transfer_part(client, message)

    interface._incoming_handlers |= {
        _messages.FileTransferStartUpload: [begin],
        _messages.FileTransferPart: [gather],
    }


def stop_server(server: viser.ViserServer) -> None:
    """Stop a server, silently."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def disable_sharing(server: viser.ViserServer) -> None:
    """The public share tunnel stays closed: viser lets every connected page ask for it."""
    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)
