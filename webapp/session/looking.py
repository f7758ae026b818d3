"""Intents about what is looked at; none of them is part of undo."""

from typing import Any

from finlab.errors import FinlabError
from finlab.layout import Layout
from webapp.session.core import Core
from webapp.session.files import shipped
from webapp.session.search_request import SearchRequest

PINNED = "pinned"
"""Name of the layout that was put aside, among those to compare with."""


class Looking(Core):
    """Modes, samples, overlays, switches, and the layout to compare with."""

    def show_mode(self, index: int) -> None:
        """Show one of the answer's modes on the robot."""
        self.mode, self.sample = max(0, int(index)), None

    def show_sample(self, index: int | None) -> None:
        """Show one of the answer's raw samples on the robot, or the chosen mode again."""
        self.sample = None if index is None else max(0, int(index))

    def set_overlay(self, method: str | None) -> None:
        """Show the forces of a compared method, or of none."""
        self.overlay = method

    def set_display(self, key: str, value: Any) -> None:
        """One field of `Display`."""
        self.display = self.display.with_value(key, value)

    def set_swim(self, key: str, value: Any) -> None:
        """One field of `SwimSettings`."""
        self.swim = self.swim.with_value(key, value)

    def set_draft(self, draft: SearchRequest) -> None:
        """What the next search for a better layout is to do."""
        self.draft = draft

    def pin(self) -> None:
        """Put the layout aside as it is now, and compare with it."""
        self.pinned, self.beside = self.state.layout, PINNED

    def compare_with(self, name: str | None) -> None:
        """Compare with a shipped layout, the pinned one, or (None) with the saved one.

        Raises:
            FinlabError: nothing is pinned, or there is no such layout.
        """
        if name == PINNED and self.pinned is None:
            raise FinlabError("nothing is pinned yet; Pin puts the layout aside as it is now")
        if name is not None and name != PINNED and name not in shipped():
            raise FinlabError(f"there is no shipped layout {name!r:.40}")
        self.beside = name

    @property
    def reference(self) -> Layout:
        """The layout that the score card compares with."""
        if self.beside is None:
            return self.saved
        return (self.pinned or self.saved) if self.beside == PINNED else shipped()[self.beside]
