"""One browser's session: its state with undo, and how it is looked at. Knows nothing of pages and widgets.

Every method is an intent of the user. It either changes the session as a whole, or raises a `FinlabError`
with a sentence for the user and changes nothing. One file per kind of intent.
"""

from webapp.session.display import Display
from webapp.session.guide import Guiding
from webapp.session.inspecting import Inspecting
from webapp.session.questions import Questions


class Session(Questions, Inspecting, Guiding):
    """What one browser has made so far."""


__all__ = ["Display", "Session"]
