"""How a fit says how far it is."""

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""Told in a few words what comes next, and the share of the work that is done; what it raises ends a fit."""


def say_nothing(words: str, share: float) -> None:
    """A `Progress` for whoever does not watch."""


class Stages:
    """Stages of a fit of about the same length, each of some steps."""

    def __init__(self, progress: Progress, count: int, steps: int = 1) -> None:
        """Takes what is called, how many stages there are at most, and how many steps a stage has at most."""
        self._progress, self._count, self._steps = progress, count, steps
        self._words, self._stage = "", -1

    def begin(self, words: str) -> None:
        """The next stage begins."""
        self._words, self._stage = words, min(self._stage + 1, self._count - 1)
        self.step(0)

    def step(self, k: int) -> None:
        """Step k of the stage begins."""
        self._progress(self._words, (self._stage + k / self._steps) / self._count)

    def skip_to(self, stage: int) -> None:
        """The next stage is this one, counted from 0; those before it were not needed."""
        self._stage = stage - 1
