"""Files of any kind that a browser sends, by *Open* or dropped on the page: each is opened by its kind."""

import json
from collections.abc import Callable
from importlib.resources import files
from pathlib import PurePath
from typing import Any, NamedTuple

import viser

from finlab.bundle_files import LARGEST_BUNDLE, MOST_FILES
from finlab.errors import FinlabError
from webapp.presses import Presses
from webapp.viser_internals import run_script

SCRIPT = files("webapp").joinpath("dropping.js").read_text("utf-8")
"""What runs in the page."""
KINDS = "a design (YAML, JSON, ZIP), measurements of a fin or a path (CSV), or a hull (STL, OBJ, GLB, PLY)"
"""What is opened, in words."""

Take = Callable[[str, bytes], object]
"""Opens a file, from its name and its content."""


class Taker(NamedTuple):
    """What files are for."""

    suffixes: tuple[str, ...]
    """How their names end."""
    take: Take
    """Opens one, from its name and its content."""
    knows: Callable[[bytes], bool] | None
    """Whether a file of such a name is for it; None where it takes what no other one does."""


class Opening:
    """What files are for; several that are dropped at once are one design with its tables and its mesh."""

    def __init__(
        self,
        gui: viser.GuiApi,
        presses: Presses,
        together: Callable[[dict[str, bytes]], object],
    ) -> None:
        """Hear from the page what is dropped on it; `together` takes what is dropped at once."""
        self._gui, self._together = gui, together
        self._takers: list[Taker] = []
        self._dropped: tuple[str, ...] = ()
        self._came: dict[str, bytes] = {}
        presses.on("dropped", lambda _, text: self._hear(text))
        run_script(gui, SCRIPT)

    @property
    def suffixes(self) -> str:
        """Suffixes of all files that can be opened, as a browser expects them."""
        return ",".join(dict.fromkeys(suffix for taker in self._takers for suffix in taker.suffixes))

    def add(self, suffixes: str, take: Take, knows: Callable[[bytes], bool] | None = None) -> None:
        """Files whose names end so (`.csv,.txt`) are for `take`, where `knows` says so of their content."""
        self._takers.append(Taker(tuple(suffixes.split(",")), take, knows))
        self._takers.sort(key=lambda taker: taker.knows is None)

    def expect(self, told: list[tuple[str, int, bool]]) -> None:
        """Files that will come: their names, sizes [bytes] and whether they are folders.

        Raises:
            FinlabError: they cannot be opened.
        """
        self._dropped, self._came = (), {}
        if len(told) > MOST_FILES:
            raise FinlabError(f"{len(told)} files were dropped, expected at most {MOST_FILES}")
        for name, size, is_folder in told:
            if is_folder:
                raise FinlabError(f"{name[-60:]!r} is a folder; drop what is in it, or a ZIP archive of it")
            if size > LARGEST_BUNDLE:
                raise FinlabError(f"{name[-60:]}: has {size:,} bytes, expected at most {LARGEST_BUNDLE:,}")
            self._check(name)
        self._check_sum(sum(size for _, size, _ in told))
        if len(told) > 1:
            self._dropped = tuple(name for name, *_ in told)

    def open(self, name: str, content: bytes) -> None:
        """A file that the browser has sent.

        Raises:
            FinlabError: it is of no kind that is opened, or whoever takes it refuses it.
        """
        if name in self._dropped:
            self._came[name] = content
            self._check_sum(sum(len(part) for part in self._came.values()))
            if len(self._came) < len(self._dropped):
                self._send_next()
                return
            came = {first: self._came[first] for first in self._dropped}
            self._dropped, self._came = (), {}
            self._together(came)
            return
        suffix = self._check(name)
        for taker in self._takers:
            if suffix in taker.suffixes and (taker.knows is None or taker.knows(content)):
                taker.take(name, content)
                return

    def _check(self, name: str) -> str:
        """How a file's name ends, if such files are opened."""
        suffix = PurePath(name).suffix.lower()
        if not any(suffix in taker.suffixes for taker in self._takers):
            raise FinlabError(f"{PurePath(name).name[-60:]!r} cannot be opened; expected {KINDS}")
        return suffix

    def _check_sum(self, size: int) -> None:
        """Files that are kept until the last one is there."""
        if size > LARGEST_BUNDLE:
            self._dropped, self._came = (), {}
            raise FinlabError(f"the files have {size:,} bytes, expected at most {LARGEST_BUNDLE:,} in all")

    def _hear(self, text: str) -> None:
        """What was dropped, from the page, which may send anything; it sends them when asked to."""
        try:
            told: Any = json.loads(text)
        except (ValueError, RecursionError):
            return
        entries = told if isinstance(told, list) else []
        if all(isinstance(e, list) and [type(part) for part in e] == [str, int, bool] for e in entries):
            self.expect([(name, size, is_folder) for name, size, is_folder in entries])
            self._send_next()

    def _send_next(self) -> None:
        """One at a time: of two files that arrive at once viser reports the second one twice."""
        run_script(self._gui, "finlabDropping.sendNext();")
