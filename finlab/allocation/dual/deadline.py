"""A limit of processor time on the searches of one call, most of which need a small part of it."""

from time import thread_time

LIMIT_S = 0.15
"""Processor time [s] of this thread after which a search for one target ends with what it has found."""


class Deadline:
    """When the searches of one call end."""

    def __init__(self, targets: float) -> None:
        self._end = thread_time() + LIMIT_S * targets
        self._struck = False

    def passed(self) -> bool:
        """Whether a search has to end now."""
        self._struck = self._struck or thread_time() > self._end
        return self._struck

    @property
    def notes(self) -> set[str]:
        """The sentence about a search that has ended so."""
        ended = "the search for a better answer was ended by its limit of processor time"
        return {ended} if self._struck else set()


NEVER = Deadline(float("inf"))
"""One that does not come."""
