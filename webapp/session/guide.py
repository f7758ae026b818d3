"""The way through tour and lessons, and back to the work as it was left."""

from dataclasses import replace
from typing import Any

from finlab.allocation.allocation import Allocation
from webapp.session.core import Core
from webapp.session.lessons import LESSONS, TOUR, Stop
from webapp.session.looking import Desk
from webapp.session.state import History, chosen

BY_NAME = {stop.name: stop for stop in (*TOUR, *LESSONS)}
KEPT = ("history", "saved", "display", "chosen", "mode", "desk")
"""What of a session comes back at the end."""


class Guide:
    """A stop of the tour, or a lesson, that is open; the scene brings its camera back with the work."""

    def __init__(self, session: Core) -> None:
        self._session = session
        self.stop: Stop | None = None
        self.solved = False
        """Whether its exercise has been done since it was opened."""
        self._left: dict[str, Any] = {}
        """The work as it was."""

    def open(self, name: str) -> None:
        """Prepare the state of a stop; what was there before comes back at the end. FinlabError: there is no
        such stop."""
        stop, session = BY_NAME[chosen(name, "lesson", BY_NAME)], self._session
        if self.stop is None:
            self._left = {key: getattr(session, key) for key in KEPT}
        self._enter(History(stop.state))  # what can be undone is what is done here
        self.stop, self.solved = stop, False
        session.saved, session.chosen, session.mode = stop.state.layout, (), stop.mode
        session.desk = Desk()
        session.show_drawer(stop.drawer)
        session.display = replace(session.display, drawn="none")

    def _enter(self, history: History) -> None:
        before, self._session.history = self._session.state, history
        self._session.settle(before)

    def go(self, steps: int) -> None:
        """The stop so many after this one; after the last one the work comes back."""
        if self.stop is not None:
            course = TOUR if self.stop in TOUR else LESSONS
            place = max(course.index(self.stop) + steps, 0)
            if place == len(course):
                self.end()
            else:
                self.open(course[place].name)

    def tour(self) -> None:
        """The tour's first stop, or the one after this."""
        if self.stop in TOUR:
            self.go(1)
        else:
            self.open(TOUR[0].name)

    def end(self) -> None:
        """All is as it was left, and what could be undone then can be undone now."""
        if self.stop is not None:
            self.stop = None
            self._enter(self._left["history"])
            self._session.history.end_merge()
            for key, value in self._left.items():
                setattr(self._session, key, value)

    def take(self, answer: Allocation) -> None:
        """See what the fins do now; an exercise that is done stays so until another stop is opened."""
        session = self._session
        if self.stop is not None and answer.layout == session.state.able:
            self.solved = self.solved or self.stop.done(session, answer)
