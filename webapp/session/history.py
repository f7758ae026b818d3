"""Undo: the states of a session before and after the present one."""

import time
from collections.abc import Callable

from webapp.session.state import State

MERGE_WINDOW_S = 1.0
"""Changes of the same kind that follow each other faster than this are one step of undo."""
MAX_STEPS = 200

Steps = list[tuple[str, State]]


class History:
    """The present state, with those before it and those that were undone."""

    def __init__(self, state: State, clock: Callable[[], float] = time.monotonic) -> None:
        """Start with one state; `clock` gives seconds and is replaced in tests."""
        self.state = state
        self._clock = clock
        self.past: Steps = []
        """Steps that can be undone, oldest first: names, and the states before them."""
        self.future: Steps = []
        """Steps that can be redone, last one first: names, and the states after them."""
        self.merge_key: str | None = None
        """Key of the step that is still being merged into, if any."""
        self._merge_time = 0.0

    def commit(self, name: str, state: State, merge_key: str | None, timed: bool) -> None:
        """Make `state` the present one, by a step that is called `name`. Changes with the same `merge_key` in
        quick succession (one slider being dragged) share a step; those that are not `timed` share it however
        slow they are, until `end_merge`."""
        now = self._clock()
        same = merge_key is not None and merge_key == self.merge_key
        if not (same and self.past and (not timed or now - self._merge_time < MERGE_WINDOW_S)):
            self.past.append((name, self.state))
            self.past, self.future = self.past[-MAX_STEPS:], []
        self.merge_key, self._merge_time = merge_key, now
        self.state = state

    def replace(self, state: State) -> None:
        """Let the present state be another one, without a step."""
        self.state = state
        self.merge_key = None

    def end_merge(self) -> None:
        """The next change starts a step of its own."""
        self.merge_key = None

    @property
    def undo_name(self) -> str | None:
        """Name of the step that undo takes back, if any."""
        return self.past[-1][0] if self.past else None

    @property
    def redo_name(self) -> str | None:
        """Name of the step that redo brings back, if any."""
        return self.future[-1][0] if self.future else None
