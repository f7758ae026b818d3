"""What a tour or a lesson leaves behind when it begins, and brings back when it ends."""

from dataclasses import dataclass

from webapp.session.display import Display
from webapp.session.looking import Desk, Looking
from webapp.session.state import State


@dataclass(frozen=True)
class Left:
    """The work as it was."""

    state: State
    past: tuple[tuple[str, State], ...]
    future: tuple[tuple[str, State], ...]
    display: Display
    chosen: tuple[str, ...]
    mode: int
    desk: Desk


class Returning(Looking):
    """The way back to the work, for whatever leads away from it; the scene brings its camera back with it."""

    _left: Left | None = None

    @property
    def guided(self) -> bool:
        """Whether a tour or a lesson is under way."""
        return self._left is not None

    def _leave(self) -> None:
        """Keep the work as it is, unless it was left already."""
        if self._left is None:
            history = self.history
            past, future = tuple(history.past), tuple(history.future)
            self._left = Left(self.state, past, future, self.display, self._chosen, self.mode, self.desk)

    def _come_back(self) -> None:
        """All is as it was left, and what could be undone then can be undone now."""
        left, self._left = self._left, None
        if left is None:
            return
        self.history.resume(left.state, left.past, left.future)
        self._settled()
        self.display, self.desk, self._chosen = left.display, left.desk, left.chosen
        self.mode = left.mode
