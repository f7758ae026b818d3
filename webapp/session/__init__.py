"""One browser's session: its state with undo, and how it is looked at. Knows nothing of pages and widgets.

Every method is an intent of the user. It either changes the session as a whole, or raises a `FinlabError`
with a sentence for the user and changes nothing. One file per kind of intent.
"""

from webapp.session.display import ANGLE_STEPS, POSITION_STEPS, Display
from webapp.session.inspecting import Inspecting
from webapp.session.lessons import Learning
from webapp.session.questions import Questions


class Session(Questions, Inspecting, Learning):
    """What one browser has made so far."""

    def twin(self) -> "Session":
        """A session with the same state and look, for work that must not see later changes."""
        other = Session(self.state.layout, self.display)
        other.resume(self.state)
        return other


__all__ = ["ANGLE_STEPS", "POSITION_STEPS", "Display", "Session"]
