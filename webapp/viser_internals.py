"""Every use of viser's private parts in Python (of 1.1.1): look here first when viser is upgraded.

Each function says why it is needed. What would make it needless upstream, in `src/viser` of
viser-project/viser:

- `start_server`, `_guarded`: hooks for requests, headers and sizes of messages; `infra/_infra.py`,
  class `WebsockServer`.
- `_name_page`: title, icon and first page as arguments of `ViserServer`; `_viser.py`.
- `stored`: an awaitable `get_item` of `client.local_storage`; `_viser.py`.
- `_keep_property_types`: types of properties looked up once for each class, and those of arrays
  made once; `_assignable_props_api.py`, `_prop_hints` and `_cast_value_recursive`.
- `_stay_awake`: no wake-up of a loop by its own thread; `infra/_async_message_buffer.py`, `push`,
  `atomic_end` and `flush`.
- `Outbox`: messages to one page are packed and written in the turn of the loop in which they are
  told, not gathered for 16 ms by a task that is woken six times; `infra/_infra.py`,
  `_message_producer`, and `infra/_async_message_buffer.py`, `_window_loop`.
- `icons_at_hand`: the list of an archive of thousands of icons read once, not for each icon;
  `_icons.py`, `svg_from_icon`.
- `_consume`: an input's change heard without a task for each listener; `infra/_infra.py`,
  `_message_consumer` and `handle_incoming`.
- `_frame`: messages of a step packed without a look at the type of each of their parts;
  `infra/_messages.py`, `as_serializable_dict`.
- `keep_private`: no message to the other pages about an input of one page; `_gui_api.py`,
  `sync_other_clients`.
- `assign`: several properties of a node in one message; `_scene_handles.py`, `_queue_update`.
- `script_of_points`: arrows that follow others without a message of their own; `_scene_handles.py`,
  `_queue_update`.
- `know_position`: a pose that is known here and not sent, of a node that a script in the page
  places; `_scene_handles.py`, `SceneNodeHandle.position`.
- `slider_marks`: marks of a slider that can be others later; `_gui_handles.py`, `GuiSliderProps`.
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
import time
from collections.abc import Callable, Coroutine, Iterator, Sequence
from functools import cache
from http import HTTPStatus
from importlib.resources import files
from itertools import islice
from operator import attrgetter
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_type_hints
from unittest.mock import patch
from zipfile import ZipFile

import msgspec
import numpy as np
import viser
import websockets.asyncio.server as websockets_server
from msgspec import msgpack
from numpy.typing import NDArray
from viser import _assignable_props_api, _icons, _messages
from viser._assignable_props_api import AssignablePropsBase
from viser.infra import _infra
from viser.infra._async_message_buffer import AsyncMessageBuffer
from viser.infra._messages import wire_field_names
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response
from websockets.protocol import State
from zstandard import ZstdCompressor

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


def start_server(guard: Guard = LOCAL, port: int = 0, start_page: bytes = b"") -> viser.ViserServer:
    """A server behind a guard, without a banner of viser's own; `verbose=False` alone would leave
    it. Its page begins with the markup of `start_page`."""
    _keep_property_types()
    _serve_quickly()
    with _STARTING, _guarded(guard, start_page), contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host=guard.host, port=port, label="finlab", verbose=False)
    _stay_awake(server.get_event_loop())
    return server


@contextlib.contextmanager
def _guarded(guard: Guard, start_page: bytes) -> Iterator[None]:
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
            if verdict is not None or answer is None:
                return answer
            return _name_page(answer, start_page)

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


def _name_page(answer: Response, start_page: bytes) -> Response:
    """Let an answer of viser's bring our first page: with our name and icon, without its panel,
    and with the start page before its script."""
    if answer.headers.get("Content-Type", "").startswith("text/html"):
        is_zipped = answer.headers.get("Content-Encoding") == "gzip"
        answer.body = _named(bytes(answer.body), is_zipped, start_page)
        del answer.headers["Content-Length"]
        answer.headers["Content-Length"] = str(len(answer.body))
    return answer


@cache
def _named(body: bytes, zipped: bool, start_page: bytes) -> bytes:
    ours = files("webapp.markup").joinpath("first_page.html").read_bytes()
    plain = gzip.decompress(body) if zipped else body
    plain = plain.replace(b'rel="icon"', b'rel="alternate"', 1).replace(
        b"<title>Viser</title>", ours, 1
    )
    if start_page:  # it opens the body, before the script of a megabyte has come
        plain = plain.replace(b"<script", b"</head><body>" + start_page + b"<script", 1)
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
    # To each value that is set, viser compares the type of the property with four types of arrays,
    # and makes these anew: a third of the time of a slider's step.
    types: Any = _assignable_props_api
    types.npt = SimpleNamespace(NDArray=_ArrayTypes())


class _ArrayTypes(dict[Any, Any]):
    """In place of `numpy.typing.NDArray`: the type of arrays of each kind is made once."""

    def __missing__(self, kind: Any) -> Any:
        self[kind] = NDArray[kind]
        return self[kind]


def _stay_awake(loop: asyncio.AbstractEventLoop) -> None:
    """Let a loop be called from its own thread without being woken up: it is awake. Viser wakes it,
    through a socket, for each message, each group of messages, and each flush."""
    from_thread = loop.call_soon_threadsafe

    def call_soon(callback: Callable[..., object], *arguments: Any, **options: Any) -> Any:
        is_own = asyncio._get_running_loop() is loop
        call = loop.call_soon if is_own else from_thread
        return call(callback, *arguments, **options)

    loop.call_soon_threadsafe = call_soon  # type: ignore[assignment, method-assign]


@contextlib.contextmanager
def icons_at_hand() -> Iterator[None]:
    """Icons that a page asks for in this context are read from one open archive; to open it takes
    as long as to build a tenth of a page."""
    with contextlib.ExitStack() as opened:

        @cache
        def archive(path: Path) -> contextlib.nullcontext[ZipFile]:
            return contextlib.nullcontext(opened.enter_context(ZipFile(path)))

        with patch.object(_icons, "zipfile", SimpleNamespace(ZipFile=archive)):
            yield


_produced_by_viser = _infra._message_producer
"""Sends the messages that go to all pages, and are kept for pages to come."""


@cache
def _serve_quickly() -> None:
    """Let the messages to one page be sent by `_produce`, and those from it be heard by
    `_consume`."""
    infra: Any = _infra
    infra._message_producer = _produce
    infra._message_consumer = _consume


class _Knock(asyncio.Event):
    """Wakes `_produce`, but not while a group is told: that is sent at its end."""

    def __init__(self, buffer: AsyncMessageBuffer) -> None:
        super().__init__()
        self._buffer = buffer

    def set(self) -> None:
        if not self._buffer.atomic_counter:
            super().set()


def _produce(
    websocket: ServerConnection, buffer: AsyncMessageBuffer, *arguments: Any, **options: Any
) -> Coroutine[Any, Any, None]:
    """Sends messages to a page, until it has gone; arguments as in viser, which sends those that go
    to all pages."""
    if buffer.persistent_messages:
        return _produced_by_viser(websocket, buffer, *arguments, **options)
    return _produce_for_page(websocket, buffer)


async def _produce_for_page(websocket: ServerConnection, buffer: Any) -> None:
    """Sends what no `Outbox` has sent: what is told beside groups, and while the socket takes no
    more."""
    buffer.finlab_socket = websocket
    buffer.message_event = _Knock(buffer)
    compressor = ZstdCompressor(level=1)
    while not buffer.done:
        buffer.message_event.clear()
        window = [] if buffer.atomic_counter else _take(buffer)
        if window:
            await websocket.send(_frame(window, compressor))
        else:
            await buffer.message_event.wait()


async def _consume(
    websocket: ServerConnection, hear: Callable[[Any], None], kind: type[Any]
) -> None:
    """Hears messages of a page until it has gone; arguments as in viser, which makes two tasks of
    each. What a user has changed is heard at once: nothing waits that we do then."""
    while True:
        raw = await websocket.recv()
        message = kind.deserialize(raw)
        client: Any = vars(websocket).get("finlab_client")
        is_change = client is not None and type(message) is _messages.GuiUpdateMessage
        if not is_change or message.uuid not in client.gui._gui_input_handle_from_uuid:
            hear(message)
            continue
        try:
            await client.gui._handle_gui_updates(client.client_id, message)
        except Exception as error:  # a page may send anything
            loop = asyncio.get_running_loop()
            loop.call_exception_handler({"message": "of a page's input", "exception": error})


def _take(buffer: AsyncMessageBuffer) -> list[Any]:
    """The first messages of a buffer, as many as a window has."""
    with buffer.buffer_lock:
        first = list(islice(buffer.message_from_id, buffer.max_window_size))
        return [buffer.pop_message_locked(number) for number in first]


PLAIN = (str, float, bool, int, tuple)
"""Types of values that are packed as they are."""
UPDATES = (_messages.GuiUpdateMessage, _messages.SceneNodeUpdateMessage)
"""Messages of which a step of a slider consists."""


def _frame(window: Sequence[Any], compressor: ZstdCompressor) -> bytes:
    """Some messages in the format of viser's `_message_producer`: compressed messages, and arrays
    as they are.

    Updates are packed here where all that they hold is plain; viser compares the type of each part
    with ten others.
    """
    arrays: list[memoryview] = []
    messages: list[dict[str, Any]] = []
    for message in window:
        kind: Any = type(message)
        values: dict[str, Any] = {}
        is_plain = kind in UPDATES
        for name, value in message.updates.items() if is_plain else ():
            if type(value) in PLAIN:
                values[name] = value
            elif type(value) is np.ndarray and value.flags.c_contiguous:
                values[name] = {"__binary_index": len(arrays), "dtype": value.dtype.str}
                arrays.append(value.data)
            else:
                is_plain = False
                break
        if not is_plain:
            messages.append(message.as_serializable_dict(arrays))
            continue
        packed: dict[str, Any] = {"type": kind.__name__}
        for name in wire_field_names(kind):
            packed[name] = values if name == "updates" else getattr(message, name)
        messages.append(packed)
    plain = msgpack.encode(
        {
            "messages": messages,
            "timestampSec": time.perf_counter(),
            "binaryBufferLengths": [array.nbytes for array in arrays],
        }
    )
    compressed = compressor.compress(plain)
    lengths = len(plain).to_bytes(8, "little") + len(compressed).to_bytes(8, "little")
    parts: list[bytes | memoryview] = [lengths, compressed]
    _infra._append_aligned_buffers(parts, arrays, len(lengths) + len(compressed))
    return b"".join(parts)


class Outbox:
    """What one page is told, in groups that it applies as a whole; a `with` block is one. Belongs
    to the event loop."""

    def __init__(self, client: viser.ClientHandle) -> None:
        buffer: Any = client.gui._websock_interface.get_message_buffer()
        buffer.finlab_group = None
        self._buffer = buffer
        self._compressor = ZstdCompressor(level=1)
        self._websocket: Any = vars(buffer).get("finlab_socket")
        """The socket of the page; None where viser sends what it is told."""
        self._is_idle = False
        """Whether the socket takes a group at once."""
        if self._websocket is not None:
            self._websocket.finlab_client = client

    def __enter__(self) -> None:
        buffer = self._buffer
        websocket = self._websocket
        buffer.atomic_start()
        self._is_idle = (
            websocket is not None
            and not buffer.done
            and websocket.protocol.state is State.OPEN
            and websocket.send_in_progress is None
            and not websocket.transport.get_write_buffer_size()
        )
        if self._is_idle and not buffer.message_from_id:
            buffer.finlab_group = []

    def __exit__(self, *_: object) -> None:
        buffer = self._buffer
        if not self._is_idle:  # viser's buffer keeps the newest of what is told until it is
            buffer.atomic_end()
            buffer.flush()
            return
        with buffer.buffer_lock:
            buffer.atomic_counter -= 1
        window = buffer.finlab_group or []
        buffer.finlab_group = None
        if buffer.message_from_id:
            window += _take(buffer)
        while window:
            self._websocket.protocol.send_binary(_frame(window, self._compressor))
            window = _take(buffer) if buffer.message_from_id else []

    def send(self) -> None:
        """Write all groups at once: a call of the system takes as long as to pack a group."""
        if self._websocket is None:
            return
        frames = self._websocket.protocol.data_to_send()
        if frames:
            self._websocket.transport.write(b"".join(frames))


def _tell(interface: Any, message: Any) -> None:
    """Tell a page, or all of them, a message: in the group that an `Outbox` has begun, if any.
    Viser's buffer, which looks for older messages that it replaces, keeps it else, and from the
    first message on that others have put there: the order is that in which they are told."""
    buffer = interface.get_message_buffer()
    group = vars(buffer).get("finlab_group")
    if group is None or buffer.message_from_id:
        interface.queue_message(message)
    else:
        group.append(message)


def keep_private(handle: Any) -> None:
    """Let viser tell no other page of what a user changes: each page has inputs of its own, and the
    message would be dropped just before it is sent."""
    handle._impl.sync_cb = None


def assign(handle: Any, values: dict[str, Any]) -> None:
    """Set properties of a handle to values that they do not have yet; those of a node's own shape
    and colour are one message, where viser makes one of each."""
    own: dict[str, Any] = {}
    if isinstance(handle, viser.SceneNodeHandle):
        props = handle._impl.props
        for name, value in values.items():
            # Viser would take a new value of the same type as it is.
            old = vars(props).get(name, UNKNOWN)
            is_array = isinstance(value, np.ndarray)
            is_same_type = isinstance(old, np.ndarray) == is_array and old is not UNKNOWN
            if is_same_type and (not is_array or old.dtype == value.dtype):
                setattr(props, name, value)
                own[name] = value
        if own:
            update = _messages.SceneNodeUpdateMessage(handle.name, own)
            api = handle._impl.api
            update.owner = api._owner_id
            _tell(api._websock_interface, update)
    for name, value in values.items():
        if name not in own:
            setattr(handle, name, value)


def script_of_points(handle: Any, points: NDArray[np.float64]) -> str:
    """A script that gives a node of arrows other ends (n, 2, 3) [m], for pages that are told a
    script anyway: no message of its own."""
    handle._impl.props.points = points.astype(np.float32)
    owner = handle._impl.api._owner_id
    values = msgspec.json.encode([handle.name, owner, points.ravel().tolist()]).decode()
    return f"finlabFrames.point({values[1:-1]});"


def know_position(handle: Any, position: NDArray[np.float64]) -> None:
    """Remember where a node is that a script in the page has placed: nothing is sent."""
    handle._impl.position = position


def write_content(handle: Any, content: str) -> None:
    """Let markup of the page be another one."""
    handle._impl.props.content = content
    update = _messages.GuiUpdateMessage(handle._impl.uuid, {"content": content})
    _tell(handle._impl.gui_api._websock_interface, update)


UNKNOWN = object()
"""In place of a property that a handle has elsewhere."""


def slider_marks(*marks: tuple[float, str]) -> tuple[_messages.GuiSliderMark, ...]:
    """Values and texts as the property `_marks` of a slider, which viser sets once alone."""
    return tuple([_messages.GuiSliderMark(value, text) for value, text in marks])


def uuid_of(handle: Any) -> str:
    """What a handle is called in the page."""
    return str(handle._impl.uuid)


def run_script(gui: viser.GuiApi, source: str) -> None:
    """Run a script in the page, as viser does to bring its plots."""
    _tell(gui._websock_interface, _messages.RunJavascriptMessage(source=source))


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
