"""Sessions on disk, so that a browser finds its work again after the server was restarted."""

import json
import os
import re
from pathlib import Path
from typing import Any

from finlab.errors import FinlabError
from finlab.layout import layout_to_dict, parse_layout
from webapp.state import SETTINGS, State

MAX_FILES = 64
"""Sessions that are kept; the oldest go first."""
MAX_BYTES = 1_000_000
"""Largest session file that is read."""
_KEY = re.compile(r"[A-Za-z0-9_-]{8,64}")


class SessionFiles:
    """One JSON file per session in a folder that only the user can read."""

    def __init__(self, folder: Path) -> None:
        """`folder` is made when the first session is written."""
        self._folder = folder

    def write(self, key: str, state: State) -> None:
        """Keep a session's state; a full disk or a missing right loses it silently: the page goes on."""
        path = self._path(key)
        if path is None:
            return
        text = json.dumps(to_dict(state))
        try:
            self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            part = path.with_suffix(".part")
            part.touch(mode=0o600)
            part.write_text(text, encoding="utf-8")
            os.replace(part, path)
            self._prune()
        except OSError:
            return

    def read(self, key: str) -> State | None:
        """The state kept under a key; None if there is none or it cannot be understood."""
        path = self._path(key)
        try:
            if path is None or not path.is_file() or path.stat().st_size > MAX_BYTES:
                return None
            return from_dict(json.loads(path.read_text(encoding="utf-8")))
        except (OSError, ValueError, TypeError, KeyError, FinlabError, RecursionError):
            return None

    def _path(self, key: str) -> Path | None:
        # Keys come from browsers: nothing in one may lead out of the folder.
        return self._folder / f"{key}.json" if _KEY.fullmatch(key) else None

    def _prune(self) -> None:
        files = sorted(self._folder.glob("*.json"), key=lambda path: path.stat().st_mtime)
        for path in files[:-MAX_FILES]:
            path.unlink(missing_ok=True)


def to_dict(state: State) -> dict[str, Any]:
    """A state as plain values."""
    return {
        "version": 1,
        "layout": layout_to_dict(state.layout),
        "failed": list(state.failed),
        "target": list(state.target),
        "links": [list(pair) for pair in state.links],
        "settings": {key: getattr(state, key) for key in SETTINGS},
    }


def from_dict(values: dict[str, Any]) -> State:
    """The state that `to_dict` wrote, checked like anything that a page sends.

    Raises:
        FinlabError: a value is not allowed.
    """
    layout = parse_layout(values["layout"], source="kept session")
    state = State(layout)
    for axis, value in enumerate(values["target"][:6]):
        state = state.with_target(axis, value)
    for name in values["failed"]:
        state = state.with_failure_toggled(name)
    for key in SETTINGS:
        state = state.with_setting(key, values["settings"][key])
    for a, b in values["links"]:
        state = state.with_link(str(a), str(b))
    return state
