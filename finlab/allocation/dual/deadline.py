"""A limit of processor time on the searches of one call, most of which need a small part of it."""

from time import thread_time

LIMIT_S = 0.15
"""Processor time [s] of this thread after which a search for one target ends with what it has found."""
ENDED = "the search for a better answer was ended by its limit of processor time"
"""The note on an answer whose search was ended."""


class Deadline:
    """When the searches of one call end."""

    def __init__(self, targets: int) -> None:
        self._end = thread_time() + LIMIT_S * targets
        self.struck = False
        """Whether a search has ended by it."""

    def passed(self) -> bool:
        """Whether a search has to end now."""
        self.struck = self.struck or thread_time() > self._end
        return self.struck
