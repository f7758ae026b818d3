"""What all intents of a session share: its state with undo, and what is selected and shown."""

import time
from collections.abc import Callable, Sequence
from typing import Generic, TypeVar

from finlab.errors import FinlabError
from finlab.layout import Layout
from webapp.session.display import Display
from webapp.session.search_request import SearchRequest
from webapp.session.state import State
from webapp.session.swim_plan import SwimSettings
from webapp.session.targets import FIRST

Snapshot = TypeVar("Snapshot")

MERGE_WINDOW_S = 1.0
"""Changes of the same kind that follow each other faster than this are one step of undo."""
MAX_STEPS = 200


class History(Generic[Snapshot]):
    """Snapshots before and after the present one."""

    def __init__(self, state: Snapshot, clock: Callable[[], float] = time.monotonic) -> None:
        """Start with one state; `clock` gives seconds and is replaced in tests."""
        self.state = state
        self._clock = clock
        self.past: list[tuple[str, Snapshot]] = []
        """Steps that can be undone, oldest first: names, and the states before them."""
        self.future: list[tuple[str, Snapshot]] = []
        """Steps that can be redone, last one first: names, and the states after them."""
        self.merge_key: str | None = None
        """Key of the step that is still being merged into, if any."""
        self._merge_time = 0.0

    def commit(self, name: str, state: Snapshot, merge_key: str | None = None, timed: bool = True) -> None:
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
        if not (same and self.past and (not timed or now - self._merge_time < MERGE_WINDOW_S)):
            self.past.append((name, self.state))
            self.past, self.future = self.past[-MAX_STEPS:], []
        self.merge_key, self._merge_time = merge_key, now
        self.state = state

    def replace(self, state: Snapshot) -> None:
        """Let the present state be another one, without a step."""
        self.state = state
        self.merge_key = None

    def resume(
        self, state: Snapshot, past: Sequence[tuple[str, Snapshot]], future: Sequence[tuple[str, Snapshot]]
    ) -> None:
        """Be again as at an earlier moment, with what could be undone and redone then."""
        self.state, self.past, self.future = state, list(past), list(future)
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

    def undo(self) -> str | None:
        """Go back one step; returns its name, None when there is none."""
        return self._step(self.past, self.future)

    def redo(self) -> str | None:
        """Go forward one step; returns its name, None when there is none."""
        return self._step(self.future, self.past)

    def _step(self, source: list[tuple[str, Snapshot]], sink: list[tuple[str, Snapshot]]) -> str | None:
        if not source:
            return None
        name, state = source.pop()
        sink.append((name, self.state))
        self.state = state
        self.merge_key = None
        return name


class Core:
    """State, history and selection."""

    def __init__(self, layout: Layout, display: Display | None = None) -> None:
        """Start with a layout, no failures, and a gentle wrench forward and to the left."""
        self._first = State(layout, target=FIRST)
        self.history: History[State] = History(self._first)
        self.display = display or Display()
        self._chosen: tuple[str, ...] = ()
        self._names = layout.names
        self.saved = layout
        """The layout as it was opened or saved last."""
        self.draft = SearchRequest()
        self.swim = SwimSettings()
        self.mode = 0
        """Which of the answer's modes is shown; 0 is the best one."""
        self.step: int | None = None
        """How many steps of refinement the network's proposals have had that are shown; None for all."""
        self.loops = False
        """Whether the refinement begins anew at its end."""
        self.revision = 0
        """Grows with every change of the state; an answer carries the revision it was made for."""

    @property
    def state(self) -> State:
        """The present state."""
        return self.history.state

    @property
    def selected(self) -> str | None:
        """The selected actuator; of several the one that was chosen last."""
        return self._chosen[-1] if self._chosen else None

    @selected.setter
    def selected(self, name: str | None) -> None:
        self._chosen = () if name is None else (name,)

    @property
    def selection(self) -> tuple[str, ...]:
        """All selected actuators, in the order of the layout."""
        return tuple(name for name in self.state.layout.names if name in self._chosen)

    def _commit(self, name: str, state: State, merge_key: str | None = None, timed: bool = True) -> None:
        """Another state; a step of undo where the robot is another one."""
        if state == self.state:
            return
        if state.asking(self.state) == self.state:  # about the same robot
            self.history.replace(state)
        else:
            self.history.commit(name, state, merge_key, timed)
        self._settled()

    def _settled(self) -> None:
        """After any change of the state: a choice of mode is void, one that is gone is not selected."""
        self.revision += 1
        self.mode, self.step = 0, None
        names, before = self.state.layout.names, self._names
        self._names = names
        if len(names) == len(before):  # one that is called otherwise now stays selected
            called = {old: new for old, new in zip(before, names, strict=True) if old not in names}
            self._chosen = tuple(called.get(name, name) for name in self._chosen)
        self._chosen = tuple(name for name in self._chosen if name in names)

    def select(self, name: str | None) -> None:
        """Select an actuator, or none."""
        if name is not None:
            self.state.layout.index(name)
        self.selected = name
        self.history.end_merge()

    def select_also(self, name: str) -> None:
        """One more actuator beside those that are selected; one of them is let go."""
        self.state.layout.index(name)
        others = tuple(other for other in self._chosen if other != name)
        self._chosen = others if name in self._chosen else (*others, name)
        self.history.end_merge()

    def select_next(self) -> None:
        """Select the actuator after the selected one."""
        names = self.state.layout.names
        self.select(names[(names.index(self.selected) + 1) % len(names)] if self.selected else names[0])

    def _selected_name(self) -> str:
        if self.selected is None:
            raise FinlabError("no actuator is selected; click one, or choose it in the list")
        return self.selected

    def start_over(self) -> None:
        """Everything as at first sight; the way here can be undone."""
        self._commit("Start over", self._first)
        self.saved = self._first.layout
        self.selected, self.mode = None, 0

    def undo(self) -> str:
        """Take back the last step; returns its name."""
        return self._stepped(self.history.undo, "undo")

    def redo(self) -> str:
        """Bring back the step taken back last; returns its name."""
        return self._stepped(self.history.redo, "redo")

    def _stepped(self, step: Callable[[], str | None], verb: str) -> str:
        asked, name = self.state, step()
        self.history.replace(self.state.asking(asked))
        if name is None:
            raise FinlabError(f"there is nothing to {verb}")
        self._settled()
        return name
