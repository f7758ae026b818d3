"""The part of a session that a page shows, and a session that shows the same while it follows
another one.

The tasks that connect the pages are in `webapp/tasks/following.py`.
"""

from dataclasses import dataclass, replace
from typing import Any

from finlab.layout import Layout
from webapp.session.editing import Session
from webapp.session.lessons import Stop
from webapp.session.looking import Desk
from webapp.session.state import History, State

TAKEN_OVER = "Take over the page that was followed"
"""What undo calls the step from the own work to that of the page that was followed."""
KEPT = ("history", "desk", "display", "saved", "selection_order", "mode", "step", "shifts", "loops")
"""Attributes of a session that are its own work, and come back when it follows no longer."""


@dataclass(frozen=True)
class Scene:
    """What a page shows of its session; all of it is immutable."""

    state: State
    desk: Desk
    saved: Layout
    selection_order: tuple[str, ...]
    mode: int
    step: int | None
    shifts: tuple[float, ...]
    loops: bool
    drawn: str
    frozen: bool
    stop: Stop | None
    """The stop of a tour or lesson that is open."""
    solved: bool

    @staticmethod
    def of(session: Session) -> "Scene":
        """What a session shows now."""
        return Scene(
            state=session.state,
            desk=session.desk,
            saved=session.saved,
            selection_order=session.selection_order,
            mode=session.mode,
            step=session.step,
            shifts=session.shifts,
            loops=session.loops,
            drawn=session.display.drawn,
            frozen=session.display.frozen,
            stop=session.guide.stop,
            solved=session.guide.solved,
        )


class Follower:
    """A session that shows what another one shows; its own work is kept meanwhile."""

    def __init__(self, session: Session) -> None:
        """The session's own tour or lesson ends."""
        session.guide.end()
        self._session = session
        self._own: dict[str, Any] = {key: getattr(session, key) for key in KEPT}
        session.history = History(session.state)

    def show(self, scene: Scene) -> None:
        """Shows what the other session shows; theme and shadows stay the own ones."""
        session = self._session
        old_state = session.state
        if scene.state is not old_state:
            session.history.replace(scene.state)
            session.settle(old_state)
        session.desk = scene.desk
        session.saved = scene.saved
        session.selection_order = scene.selection_order
        session.mode = scene.mode
        session.step = scene.step
        session.shifts = scene.shifts
        session.loops = scene.loops
        session.display = replace(session.display, drawn=scene.drawn, frozen=scene.frozen)
        session.guide.stop = scene.stop
        session.guide.solved = scene.solved

    def end(self) -> None:
        """The session's own work comes back."""
        session = self._session
        state = session.state
        session.guide.stop = None
        for key, value in self._own.items():
            setattr(session, key, value)
        session.settle(state)
        for key in ("selection_order", "mode", "step", "shifts"):
            setattr(session, key, self._own[key])

    def take_over(self) -> None:
        """What is shown becomes the session's own work, by a step of undo."""
        scene = Scene.of(self._session)
        self.end()
        session = self._session
        session.history.commit(TAKEN_OVER, scene.state, None, True, session.shifts)
        session.settle(self._own["history"].past[-1].state)
        session.desk = scene.desk
        session.saved = scene.saved
        session.selection_order = scene.selection_order
