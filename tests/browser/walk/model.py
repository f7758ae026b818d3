"""What the page should hold: a session of the walk's own that is told the same intents.

What a session makes of an intent is for the session's own tests to say. The walk holds that a key or a click
brings the right intent, with the right value, once, and that the page shows what came of it.
"""

from typing import Any

from finlab.errors import FinlabError
from webapp.session import Session
from webapp.session.search_request import ALL
from webapp.session.state import State


class Model:
    """A session, and what panels keep for themselves."""

    def __init__(self, state: State, display: Any) -> None:
        """As the page is at first sight."""
        self.session = Session(state.layout, display)
        self.session.history.state = state
        self.ring = "z, up"
        """Entry of the list of axes that copies stand around."""
        self.bounds_of = ALL
        """Whose bounds of the search are shown."""
        self.stick = "surge and yaw"
        """What the stick steers."""
        self.spring = True
        """Whether it springs back."""
        self.follow = False
        """Whether the camera follows a swim."""
        self.sweep_axis = "surge"
        """Which axis a sweep goes along."""
        self.ends = (-5.0, 5.0)
        """From where to where."""
        self.tick = 0.0
        """Time of the walk [s]; it stands still within an action, however slow the machine is."""
        self.session.history._clock = lambda: self.tick

    @property
    def fin(self) -> Any:
        """The fin that was selected last."""
        session = self.session
        return session.state.layout.fins[session.state.layout.index(session.selected)]

    @property
    def damaged(self) -> str:
        """The fin that the panel of damage is about."""
        return self.session.selected or self.session.state.layout.names[0]

    def let_go(self) -> None:
        """Leave a fin that is not there any more, as the search's panel does."""
        if self.bounds_of not in self.session.state.layout.names:
            self.bounds_of = ALL

    def told(self, intent: Any) -> str | None:
        """Carry out an intent; the sentence with which it is refused, if it is."""
        try:
            intent(self)
        except FinlabError as error:
            return str(error)
        return None


def facts(session: Any) -> dict[str, Any]:
    """All that a session holds and a user can bring about."""
    names = ("display", "swim", "draft", "desk", "overlay", "mode", "sample", "saved", "pinned", "beside")
    found = {name: getattr(session, name) for name in (*names, "stop", "_chosen")}
    past, future = ([name for name, _ in steps] for steps in (session.history.past, session.history.future))
    lesson = None if session.lesson is None else session.lesson.name
    return found | vars(session.state) | {"undo": past, "redo": future, "lesson": lesson}
