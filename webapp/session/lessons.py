"""Tour and lessons of `lessons.yaml`: prepared states with words; a lesson has a task and its
check."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct

from finlab.allocation.allocation import Allocation
from finlab.axes import axes_in, mask_of
from finlab.files import parse_yaml
from finlab.files.schema import checked
from webapp.session.base import BaseSession
from webapp.session.files import shipped
from webapp.session.looking import Desk
from webapp.session.state import History, State, Step, least_of, one_of
from webapp.session.targets import FIRST_TARGET

ALIGNED = 0.999
"""Cosine from which what is delivered points where it was asked."""


class Stop(Struct, frozen=True, forbid_unknown_fields=True):
    """A prepared state, what there is to see in it, and perhaps something to do."""

    name: str
    title: str
    text: str
    layout: str = "ucat"
    target: tuple[float, float, float, float, float, float] = FIRST_TARGET
    """Wrench that is asked for [N, N m]."""
    mode: int = 0
    method: str = "dual"
    swims: bool = False
    drawer: str = "Candidates"
    """What lies uppermost in the drawer; its task is open."""
    inspects: bool = False
    """Whether it speaks of the inspector: a phone begins with that below its card, else with the
    drawer, and a low window has more room for the list where it does not."""
    exercise: str = ""
    praise: str = ""

    @property
    def state(self) -> State:
        """The prepared state, with nothing left of the present one."""
        layout = shipped()[self.layout]
        counts = mask_of(layout.axes) | (np.array(self.target) != 0.0)  # an asked axis counts
        layout = replace(layout, axes=axes_in(counts))
        return State(layout, target=self.target, method=self.method)


def _aligned(answer: Allocation) -> bool:
    """Whether something is delivered, and in the direction that was asked for."""
    delivered, target = (
        wrench / answer.scale for wrench in (answer.wrench, np.nan_to_num(answer.target))
    )
    size = float(np.linalg.norm(delivered) * np.linalg.norm(target))
    return size > 0.0 and float(delivered @ target) / size > ALIGNED


DONE: dict[str, Callable[[BaseSession, Allocation], bool]] = {
    "two-ways": lambda session, answer: session.mode > 0 and answer.reachable,
    "refinement": lambda session, _: session.step is not None and session.step > 0,
    "temperature": lambda session, _: (session.state.temperature or 0.0) > 1.9,
    "watts-or-effort": lambda session, answer: (
        least_of(session.state.method) == "watts" and answer.reachable
    ),
    "null-space": lambda session, _: bool(session.shifts) and session.mode == 2,
    "lost-fin": lambda session, answer: bool(session.state.lost) and answer.reachable,
    "no-yaw": lambda session, answer: (
        session.state.layout.fins != shipped()["no_yaw"].fins and answer.reachable
    ),
    "out-of-reach": lambda session, answer: (
        session.state.policy == "direction" and not answer.reachable and _aligned(answer)
    ),
    "jets": lambda _, answer: answer.layout.interaction is not None and answer.reachable,
    "learned-physics": lambda session, answer: session.state.method == answer.method == "paper",
}
"""Whether the exercise of a lesson is done, by a session and what is on its robot."""


class _Course(Struct, forbid_unknown_fields=True):
    tour: tuple[Stop, ...]
    lessons: tuple[Stop, ...]


_FILE = Path(__file__).with_name("lessons.yaml")
_course = checked(parse_yaml(_FILE.read_text("utf-8"), _FILE.name), _Course)
TOUR = _course.tour
LESSONS = _course.lessons
BY_NAME = {stop.name: stop for stop in (*TOUR, *LESSONS)}
KEPT = ("history", "saved", "display", "selection_order", "shifts", "mode", "desk")
"""What of a session comes back at the end."""


class Guide:
    """A stop of the tour, or a lesson, that is open; the scene brings its camera back with the
    work."""

    def __init__(self, session: BaseSession) -> None:
        self._session = session
        self.stop: Stop | None = None
        self.solved = False
        """Whether its exercise has been done since it was opened."""
        self._left: dict[str, Any] = {}
        """The work as it was."""

    def open(self, name: str) -> None:
        """Prepare the state of a stop; what was there before comes back at the end, and a robot
        that was made at an earlier stop by undo. FinlabError: there is no such stop."""
        stop = BY_NAME[one_of(name, "lesson", BY_NAME)]
        session = self._session
        history = History(stop.state)  # what can be undone is what is done here
        if self.stop is None:
            self._left = {key: getattr(session, key) for key in KEPT}
        elif self._has_made:
            here = Step(f"Open {stop.title}", session.state, session.shifts)
            history.past = [*session.history.past, here]
            history.name_steps()
        self._enter(history)
        self.stop = stop
        self.solved = False
        session.saved = stop.state.layout
        session.selection_order = ()
        session.desk = Desk()
        session.show_drawer(stop.drawer)
        session.mode = stop.mode
        session.display = replace(session.display, drawn="none")

    def _enter(self, history: History) -> None:
        before = self._session.state
        self._session.history = history
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

    @property
    def course(self) -> str:
        """What the open stop is part of, in a word."""
        return "tour" if self.stop in TOUR else "lesson"

    @property
    def reminder(self) -> str:
        """What becomes of a robot that is opened, made or saved now; nothing outside of tour and
        lessons."""
        if self.stop is None:
            return ""
        return (
            f"The {self.course} “{self.stop.title}” is open: Close brings the robot from before "
            "back, and Undo then this one"
        )

    @property
    def _has_made(self) -> bool:
        """Whether a robot was made here that no stop has prepared."""
        session = self._session
        layouts = [step.state.layout for step in session.history.past]
        stops = [stop.state.layout for stop in (*TOUR, *LESSONS)]
        prepared = (*shipped().values(), *stops)
        return any(layout not in prepared for layout in [*layouts, session.state.layout])

    def end(self) -> None:
        """All is as it was left, and what could be undone then can be undone now; before that, by
        undo, robots that were made here."""
        if self.stop is not None:
            session = self._session
            history = self._left["history"]
            if self._has_made:
                close = Step(f"Close the {self.course}", session.state, session.shifts)
                step = f"Open the {self.course}"
                history.add_aside(step, self._left["shifts"], session.history.past, close)
            self.stop = None
            self._enter(history)
            self._session.history.end_merge()
            for key, value in self._left.items():
                setattr(self._session, key, value)

    def take(self, answer: Allocation) -> None:
        """See what the fins do now; an exercise that is done stays so until another stop is
        opened."""
        session = self._session
        if self.stop is not None and answer.layout == session.state.able:
            done = DONE.get(self.stop.name)
            self.solved = self.solved or (done is not None and done(session, answer))
