"""Undo and redo: a stack of named snapshots of an immutable state."""

import time
from collections.abc import Callable, Iterable
from typing import Generic, TypeVar

State = TypeVar("State")

MERGE_WINDOW_S = 1.0
"""Changes of the same kind that follow each other faster than this are one step of undo."""
MAX_STEPS = 200
"""Steps that are kept."""


class History(Generic[State]):
    """Snapshots before and after the present one."""

    def __init__(self, state: State, clock: Callable[[], float] = time.monotonic) -> None:
        """Start with one state; `clock` gives seconds and is replaced in tests."""
        self.state = state
        self._clock = clock
        self._past: list[tuple[str, State]] = []
        self._future: list[tuple[str, State]] = []
        self.merge_key: str | None = None
        """Key of the step that is still being merged into, if any."""
        self._merge_time = 0.0

    def commit(self, name: str, state: State, merge_key: str | None = None, timed: bool = True) -> None:
        """Make `state` the present one.

        Args:
            name: what was done, in words, such as "Move front_left".
            state: the new state.
            merge_key: changes with the same key in quick succession (one slider being dragged) share a step.
            timed: False lets them share it however slow they are, until `end_merge`.
        """
        if state == self.state:
            return
        now = self._clock()
        same = merge_key is not None and merge_key == self.merge_key
        if not (same and self._past and (not timed or now - self._merge_time < MERGE_WINDOW_S)):
            self._past.append((name, self.state))
            del self._past[:-MAX_STEPS]
        self.merge_key, self._merge_time = merge_key, now
        self._future.clear()
        self.state = state

    def end_merge(self) -> None:
        """The next change starts a step of its own."""
        self.merge_key = None

    def abandon(self) -> bool:
        """Take the step back that is being merged into, leaving no trace of it; False if there is none."""
        if self.merge_key is None or not self._past:
            return False
        _, self.state = self._past.pop()
        self.merge_key = None
        return True

    @property
    def past(self) -> tuple[tuple[str, State], ...]:
        """Steps that can be undone, oldest first: names, and the states before them."""
        return tuple(self._past)

    @property
    def future(self) -> tuple[tuple[str, State], ...]:
        """Steps that can be redone, last one first: names, and the states after them."""
        return tuple(self._future)

    def restore(self, past: Iterable[tuple[str, State]], future: Iterable[tuple[str, State]]) -> None:
        """Take over steps that were kept."""
        self._past, self._future = list(past), list(future)

    @property
    def undo_name(self) -> str | None:
        """Name of the step that undo takes back, if any."""
        return self._past[-1][0] if self._past else None

    @property
    def redo_name(self) -> str | None:
        """Name of the step that redo brings back, if any."""
        return self._future[-1][0] if self._future else None

    def undo(self) -> str | None:
        """Go back one step; returns its name, None when there is none."""
        return self._step(self._past, self._future)

    def redo(self) -> str | None:
        """Go forward one step; returns its name, None when there is none."""
        return self._step(self._future, self._past)

    def _step(self, source: list[tuple[str, State]], sink: list[tuple[str, State]]) -> str | None:
        if not source:
            return None
        name, state = source.pop()
        sink.append((name, self.state))
        self.state = state
        self.merge_key = None
        return name
