"""Sessions on disk, so that a browser finds its work again after the server was restarted."""

import copy
import json
import os
import re
from dataclasses import asdict
from pathlib import Path
from typing import Any

from finlab.errors import FinlabError
from finlab.files.guarded import read_text
from finlab.files.plain_values import parse_json
from finlab.layout import Layout, layout_to_dict, parse_layout
from webapp.session import Session
from webapp.session.search_request import restored_request
from webapp.session.state import SETTINGS, State

VERSION = 7
"""Of what stands in the files; others are not read."""
MAX_FILES = 64
"""Sessions that are kept; the oldest go first."""
MAX_BYTES = 3_000_000
"""Largest session file that is read."""
KEPT = ("failed", "weak", "stuck", "target", "links")
"""Fields of a state that are written as they are."""
_KEY = re.compile(r"[A-Za-z0-9_-]{8,64}")


class SessionFiles:
    """One JSON file per session in a folder that only the user can read."""

    def __init__(self, folder: Path) -> None:
        """`folder` is made when the first session is written."""
        self._folder = folder

    def write(self, key: str, session: Session) -> None:
        """Keep a session; a full disk or a missing right loses it silently: the page goes on."""
        path = self._path(key)
        if path is None:
            return
        text = json.dumps(to_dict(session))
        try:
            self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            part = path.with_suffix(".part")
            part.touch(mode=0o600)
            part.write_text(text, encoding="utf-8")
            os.replace(part, path)
            self._prune()
        except OSError:
            return

    def read(self, key: str, session: Session) -> bool:
        """Bring a fresh session to what is kept under a key; False if there is none or it makes no sense."""
        path = self._path(key)
        try:
            if path is None or not path.is_file():
                return False
            restore(session, parse_json(read_text(path, MAX_BYTES, "a kept session"), path.name))
        except (OSError, ValueError, TypeError, LookupError, AttributeError, FinlabError, RecursionError):
            return False
        return True

    def _path(self, key: str) -> Path | None:
        # Keys come from browsers: nothing in one may lead out of the folder.
        return self._folder / f"{key}.json" if _KEY.fullmatch(key) else None

    def _prune(self) -> None:
        files = sorted(self._folder.glob("*.json"), key=lambda path: path.stat().st_mtime)
        for path in files[:-MAX_FILES]:
            path.unlink(missing_ok=True)


def frozen(session: Session) -> Session:
    """A session as it is now, to be written while it goes on."""
    kept, kept_history = copy.copy(session), copy.copy(session.history)
    kept.history = kept_history
    return kept


def to_dict(session: Session) -> dict[str, Any]:
    """A session as plain values. Layouts are written once each, however many steps share them."""
    layouts: dict[Layout, int] = {}

    def place(layout: Layout) -> int:
        return layouts.setdefault(layout, len(layouts))

    def plain(state: State) -> dict[str, Any]:
        return {
            "layout": place(state.layout),
            **{key: getattr(state, key) for key in KEPT},
            "settings": {key: getattr(state, key) for key in SETTINGS},
        }

    values = {
        "version": VERSION,
        "state": plain(session.state),
        "saved": place(session.saved),
        "beside": session.beside,
        "display": asdict(session.display),
        "draft": asdict(session.draft),
        "swim": asdict(session.swim),
    }
    return {**values, "layouts": [layout_to_dict(layout) for layout in layouts]}


def restore(session: Session, values: dict[str, Any]) -> None:
    """Bring a fresh session to what `to_dict` wrote, checked like anything that a page sends.

    Raises:
        FinlabError: a value is not allowed. So may KeyError, TypeError, ValueError and IndexError tell.
            The session is to be dropped then: it is half restored.
    """
    if values["version"] != VERSION:
        raise FinlabError(f"kept session: expected version {VERSION}, got {values['version']!r:.20}")
    layouts = [parse_layout(layout, source="kept session") for layout in values["layouts"]]

    session.resume(_state(values["state"], layouts))
    session.saved = layouts[values["saved"]]
    for key, value in values["display"].items():
        session.set_display(key, value)
    for key, value in values["swim"].items():
        session.set_swim(key, value)
    session.swim = session.swim.without_own_path()
    session.set_draft(restored_request(values["draft"]))
    session.compare_with(values["beside"])


def _state(values: dict[str, Any], layouts: list[Layout]) -> State:
    state = State(layouts[values["layout"]])
    for axis, value in enumerate(values["target"][:6]):
        state = state.with_target(axis, value)
    for name in values["failed"]:
        state = state.with_failure_toggled(name)
    for name, share in values["weak"]:
        state = state.with_strength(str(name), share)
    for name, angle in values["stuck"]:
        state = state.with_stop(str(name), angle)
    for key in SETTINGS:
        state = state.with_setting(key, values["settings"][key])
    for a, b in values["links"]:
        state = state.with_link(str(a), str(b))
    return state
