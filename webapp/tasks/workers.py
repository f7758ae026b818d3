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

    def __post_init__(self) -> None:
        import torch  # takes seconds; the app's other parts do without

        # Networks this small gain nothing from more threads, and on a busy machine those wait for each other:
        # an answer of the paper's method then takes a hundred times longer.
        torch.set_num_threads(1)

    def stop(self) -> None:
        """End all threads."""
        for worker in (self.answers, self.marks, self.cards, self.swims, self.searches):
            worker.stop()
