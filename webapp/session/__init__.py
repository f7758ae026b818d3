"""One browser's session: its state with undo, and how it is looked at. Knows nothing of pages and
widgets.

Every method is an intent of the user. It either changes the session as a whole, or raises a
`FinlabError` with a sentence for the user and changes nothing: a page may send anything.
"""

from webapp.session.editing import Session
from webapp.session.looking import Display

__all__ = ["Display", "Session"]
