"""A browser's ear: connects to a viser server as its page does, and keeps the messages that
come."""

import threading
import time
from typing import Any, NamedTuple

import msgspec
import viser
import zstandard
from websockets.sync.client import connect
from websockets.typing import Subprotocol

QUIET_S = 1.0
"""After so long without a message nothing more is on its way [s]."""
HEAD = 16
"""Bytes before what is compressed: its size as plain and as compressed bytes, eight each."""


class Heard(NamedTuple):
    """One message."""

    kind: str
    about: str
    """Node, widget or script."""
    size: int
    """Bytes of it, its arrays included, before they are compressed."""


class Listener:
    """Keeps what a server sends, while it is open."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Connect, and begin to listen on a thread."""
        protocol = Subprotocol(f"viser-v{viser.__version__}")
        self._socket = connect(
            f"ws://127.0.0.1:{server.get_port()}", subprotocols=[protocol], max_size=None
        )
        self.heard: list[Heard] = []
        self.bytes = 0
        """Of all that came, as it was sent."""
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        for frame in self._socket:
            assert isinstance(frame, bytes)
            self.bytes += len(frame)
            packed = int.from_bytes(frame[8:HEAD], "little")
            plain = zstandard.ZstdDecompressor().decompress(frame[HEAD : HEAD + packed])
            window = msgspec.msgpack.decode(plain)
            arrays = window["binaryBufferLengths"]
            self.heard += [_heard(message, arrays) for message in window["messages"]]

    def wait(self) -> None:
        """Let all come that a page is told first, and forget it."""
        before = -1
        while before != len(self.heard) or not self.heard:
            before = len(self.heard)
            time.sleep(QUIET_S)
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self.heard = []
        self.bytes = 0

    def close(self) -> None:
        """Hang up."""
        self._socket.close()
        self._thread.join(5.0)


def _heard(message: dict[str, Any], arrays: list[int]) -> Heard:
    """A message with what it is about and how many bytes it takes."""
    size = len(msgspec.msgpack.encode(message)) + sum(arrays[k] for k in _arrays(message))
    keys = [f"{k}" for k in message.get("updates", {})]
    about = message.get("name") or message.get("uuid") or str(message.get("source", ""))[:60]
    return Heard(message["type"], f"{about} {' '.join(keys)}".strip(), size)


def _arrays(value: Any) -> list[int]:
    """Which arrays a message has."""
    if isinstance(value, dict):
        if "__binary_index" in value:
            return [value["__binary_index"]]
        value = list(value.values())
    indices = list[int]()
    if isinstance(value, list):
        for part in value:
            indices += _arrays(part)
    return indices
