"""The way through tour and lessons, and back to the work as it was left."""

from dataclasses import replace
from typing import Any

from finlab.allocation.allocation import Allocation
from webapp.session.lessons import LESSONS, TOUR, Seen, Stop
from webapp.session.looking import Desk, Looking
from webapp.session.state import State, chosen

BY_NAME = {stop.name: stop for stop in (*TOUR, *LESSONS)}


Steps = tuple[tuple[str, State], ...]
KEPT = ("saved", "display", "_chosen", "mode", "desk")
"""What of a session comes back beside its history."""


class Guiding(Looking):
    """A stop of the tour, or a lesson, that is open; the scene brings its camera back with the work."""

    stop: Stop | None = None
    solved = False
    """Whether its exercise has been done since it was opened."""
    _left: tuple[State, Steps, Steps, dict[str, Any]] | None = None
    """The work as it was: state, what could be undone and redone, and what is `KEPT`."""

    @property
    def course(self) -> tuple[Stop, ...]:
        """What the stop is one of: the tour, or the lessons."""
        return TOUR if self.stop in TOUR else LESSONS

    def open_stop(self, name: str) -> None:
        """Prepare the state of a stop; what was there before comes back at the end.

        Raises:
            FinlabError: there is no such stop.
        """
        stop = BY_NAME[chosen(name, "lesson", BY_NAME)]
        if self._left is None:
            past, future = tuple(self.history.past), tuple(self.history.future)
            self._left = self.state, past, future, {key: getattr(self, key) for key in KEPT}
        self.history.resume(stop.state, (), ())  # what can be undone is what is done here
        self._settled()
        self.saved = stop.state.layout
        self.stop, self.solved, self.mode, self.step, self.selected = stop, False, stop.mode, None, None
        self.desk = Desk()
        self.show_drawer(stop.drawer)
        self.display = replace(self.display, drawn="none")

    def go_on(self) -> None:
        """The stop after this one; after the last one the work comes back."""
        self._go(1)

    def go_back(self) -> None:
        """The stop before this one."""
        self._go(-1)

    def _go(self, steps: int) -> None:
        if self.stop is not None:
            place = max(self.course.index(self.stop) + steps, 0)
            if place == len(self.course):
                self.end_guide()
            else:
                self.open_stop(self.course[place].name)

    def tour(self) -> None:
        """The tour's first stop, or the one after this."""
        if self.stop in TOUR:
            self.go_on()
        else:
            self.open_stop(TOUR[0].name)

    def end_guide(self) -> None:
        """All is as it was left, and what could be undone then can be undone now."""
        left, self._left, self.stop = self._left, None, None
        if left is not None:
            self.history.resume(*left[:3])
            self._settled()
            for key, value in left[3].items():
                setattr(self, key, value)

    def take(self, answer: Allocation) -> None:
        """See what the fins do now; an exercise that is done stays so until another stop is opened."""
        if self.stop is not None and answer.layout == self.state.able:
            self.solved = self.solved or self.stop.done(Seen(self.state, answer, self.mode, self.step))

    def start_over(self) -> None:
        """Everything as at first sight, outside of tour and lessons; nothing comes back."""
        self.stop, self._left = None, None
        super().start_over()
