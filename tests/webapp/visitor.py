"""A browser reduced to what the server needs to hear: for tests that open many pages."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import msgspec
import viser
import zstandard
from websockets.asyncio.client import ClientConnection, connect

CAMERA: dict[str, Any] = {
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (1.0, 1.0, 1.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 600,
    "image_width": 800,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


class Visitor:
    """One connection that speaks viser's protocol."""

    def __init__(self, socket: ClientConnection) -> None:
        """Take a connection over."""
        self.socket = socket
        self.stored: str | None = None
        """What the server had it keep."""

    async def send(self, kind: str, **values: Any) -> None:
        """Send one message."""
        await self.socket.send(msgspec.msgpack.encode({"type": kind, **values}))

    async def heard(self) -> AsyncIterator[dict[str, Any]]:
        """Messages of the server, one after the other."""
        async for raw in self.socket:
            assert isinstance(raw, bytes)
            size, packed = (int.from_bytes(raw[k : k + 8], "little") for k in (0, 8))
            text = zstandard.ZstdDecompressor().decompress(raw[16 : 16 + packed], max_output_size=size)
            for message in msgspec.msgpack.decode(text)["messages"]:
                yield message

    async def look(self) -> None:
        """Say where the camera is, which is a page's first message."""
        await self.send("ViewerCameraMessage", **CAMERA)

    async def enter(self, keys: str | None = None) -> None:
        """Answer until the server has opened a page."""
        await self.look()
        async for message in self.heard():
            if message["type"] == "LocalStorageGetItemRequestMessage":
                answer = {"value": keys, "error": None, "request_uuid": message["request_uuid"]}
                await self.send("LocalStorageGetItemResponseMessage", **answer)
            elif message["type"] == "LocalStorageSetItemMessage" and message["key"] == "finlab-sessions":
                self.stored = message["value"]
                return
        raise AssertionError("the server has dropped this page")


@asynccontextmanager
async def visitor(port: int) -> AsyncIterator[Visitor]:
    """A connection to a server on this machine."""
    async with connect(
        f"ws://127.0.0.1:{port}/",
        subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
        max_size=None,
        compression=None,
        open_timeout=30,
    ) as socket:
        yield Visitor(socket)


async def visit(port: int, limit_s: float = 30.0) -> bool:
    """Open a page and leave; whether it came in time [s]."""
    try:
        async with visitor(port) as page:
            await asyncio.wait_for(page.enter(), limit_s)
            return True
    except (OSError, TimeoutError, AssertionError):
        return False
