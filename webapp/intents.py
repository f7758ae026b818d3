"""Actions of a user on one page, and the notes by which the page reports them."""

import traceback
from collections.abc import Callable
from typing import Any

import viser

from finlab.errors import FinlabError
from webapp.box_labels import in_boxes
from webapp.markup.words import in_app
from webapp.tasks.slot import Bell
from webapp.theme import BLUE, VERMILLION


class Intents:
    """Carries out intents; nothing else changes a session. What came of it is written when the page
    wakes.

    Everything here is called on viser's event loop.
    """

    def __init__(self, client: viser.ClientHandle, bell: Bell) -> None:
        """`bell` wakes the page after each."""
        self._client = client
        self._bell = bell
        self._note: viser.NotificationHandle | None = None
        self._faults: set[str] = set()
        self.is_new = False
        """Whether something was done, or went wrong, since the page was written."""
        self.changed_handles: list[Any] = []
        """Handles that a user has changed: the session may have refused it."""
        self.lock = ""
        """Why nothing may be changed on this page; empty where it may."""
        self.has_fault = False
        """Whether something went wrong since the page was written: nothing that was drawn is
        trusted."""

    def do(self, act: Callable[[], object], handle: Any = None) -> None:
        """Carry out an intent, by the input `handle` that the user has changed, if any; a refusal
        becomes a note, and the page goes back to what the session holds."""
        self.look(self._refuse if self.lock else act, handle)

    def _refuse(self) -> None:
        raise FinlabError(self.lock)

    def look(self, act: Callable[[], object], handle: Any = None) -> None:
        """The same for what a page may do that is locked."""
        self._faults.clear()
        try:
            act()
        except FinlabError as error:
            self.notify("Not possible", in_boxes(error))
        except Exception as error:  # the page must go on, whatever we have got wrong
            self.fault(error)
        if handle is not None:
            self.changed_handles.append(handle)
        self.is_new = True
        self._bell.ring()

    def notify(self, title: str, body: str, calm: bool = False) -> None:
        """Show a note to the user, in place of the last one; a calm one is no warning."""
        if self._note is not None:
            self._note.remove()
        color = BLUE if calm else VERMILLION
        self._note = self._client.add_notification(
            title, in_app(body), auto_close_seconds=8.0, color=color
        )

    def fault(self, error: Exception) -> None:
        """An error of our own is reported, once however often the page is written."""
        self.has_fault = True
        text = f"{type(error).__name__}: {error}"
        if text not in self._faults:
            self._faults.add(text)
            traceback.print_exception(error)
            self.notify("A fault of the app", text)
