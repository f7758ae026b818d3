"""A page that takes everything and says nothing, for tests without a browser."""

from types import SimpleNamespace
from typing import Any

import viser


class SilentClient:
    """Stands for a browser: the server's own scene and panel, and a camera that takes everything."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.scene, self.gui, self.atomic = server.scene, server.gui, server.atomic
        self.camera = type("Camera", (), {})()
        self.kept: dict[str, str] = {}
        self.local_storage = SimpleNamespace(set_item=self.kept.__setitem__, get_item=self.kept.get)
        self.notes: list[str] = []
        self.files: dict[str, bytes] = {}

    def add_notification(self, title: str, body: str, **_: Any) -> None:
        """Note what the user would have been told."""
        self.notes.append(f"{title}: {body}")

    def send_file_download(self, name: str, content: bytes, **_: Any) -> None:
        """Keep what the user would have saved."""
        self.files[name] = content
