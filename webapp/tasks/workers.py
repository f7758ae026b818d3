"""The threads that compute, so that a long search keeps nobody waiting for a quick answer."""

from dataclasses import dataclass, field

from webapp.tasks.worker import Worker


@dataclass(frozen=True)
class Workers:
    """One thread for each kind of work; all pages share them."""

    answers: Worker = field(default_factory=Worker)
    """Allocations: milliseconds."""
    marks: Worker = field(default_factory=Worker)
    """Reachable ranges: tens of milliseconds, after the answer."""
    cards: Worker = field(default_factory=Worker)
    """What a layout can do: about a second."""
    swims: Worker = field(default_factory=Worker)
    """Robots that swim: all the time, in short turns."""
    searches: Worker = field(default_factory=Worker)
    """Better layouts: up to minutes."""

    def stop(self) -> None:
        """End all threads."""
        for worker in (self.answers, self.marks, self.cards, self.swims, self.searches):
            worker.stop()
