"""Files of any kind that a browser sends, by *Open* or dropped on the page: each is opened by its kind."""

from collections.abc import Callable
from importlib.resources import files
from pathlib import PurePath

import viser

from finlab.errors import FinlabError
from webapp.presses import Presses
from webapp.viser_internals import run_script

SCRIPT = files("webapp").joinpath("dropping.js").read_text("utf-8")
"""What runs in the page."""
KINDS = "a design (YAML, JSON, ZIP), measurements of a fin (CSV), or a hull (STL, OBJ, GLB, PLY)"
"""What is opened, in words."""

Take = Callable[[str, bytes], object]
"""Opens a file, from its name and its content."""


class Opening:
    """What files are for."""

    def __init__(self, gui: viser.GuiApi, presses: Presses) -> None:
        """Let the page take what is dropped on it."""
        self._takers: dict[str, Take] = {}
        presses.on("dropped", _refuse)
        run_script(gui, SCRIPT)

    @property
    def suffixes(self) -> str:
        """Suffixes of all files that can be opened, as a browser expects them."""
        return ",".join(self._takers)

    def add(self, suffixes: str, take: Take) -> None:
        """Files whose names end so (`.csv,.txt`) are for `take`."""
        self._takers |= dict.fromkeys(suffixes.split(","), take)

    def open(self, name: str, content: bytes) -> None:
        """A file that the browser has sent.

        Raises:
            FinlabError: it is of no kind that is opened, or whoever takes it refuses it.
        """
        take = self._takers.get(PurePath(name).suffix.lower())
        if take is None:
            raise FinlabError(f"{PurePath(name).name[-60:]!r} cannot be opened; expected {KINDS}")
        take(name, content)


def _refuse(_key: str, _text: str) -> None:
    """What several files, or a folder, are told.

    Raises:
        FinlabError: always.
    """
    raise FinlabError("one file can be dropped at a time; put a design and its files into one ZIP archive")
