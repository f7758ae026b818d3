"""Intents about the tour: each stop is a state, and the way back is kept."""

from dataclasses import replace

from finlab.layout import Layout
from webapp.session.core import Core
from webapp.session.display import Display
from webapp.session.state import State
from webapp.session.tour import STEPS


class Guiding(Core):
    """The tour."""

    def __init__(self, layout: Layout, display: Display | None = None) -> None:
        """Start outside the tour."""
        super().__init__(layout, display)
        self.stop: int | None = None
        """Where the tour is, None while there is none."""
        self._before_tour: State | None = None

    def next_stop(self) -> None:
        """The tour's first stop, or the one after this; after the last one the tour is over."""
        if self.stop is None:
            self._before_tour = self.state
        stop = 0 if self.stop is None else self.stop + 1
        if stop == len(STEPS):
            self.end_tour()
        else:
            self._go(stop)

    def previous_stop(self) -> None:
        """The tour's stop before this one."""
        self._go(max((self.stop or 0) - 1, 0))

    def end_tour(self) -> None:
        """Back to what was there before the tour."""
        if self._before_tour is not None:
            self._commit("End the tour", self._before_tour)
        self.stop, self._before_tour = None, None

    def start_over(self) -> None:
        """Everything as at first sight, outside the tour."""
        self.stop, self._before_tour = None, None
        super().start_over()

    def _go(self, stop: int) -> None:
        step = STEPS[stop]
        self._commit(f"Tour: {step.title}", step.state(self.state))
        self.stop, self.mode, self.selected = stop, step.mode, None
        self.display = replace(self.display, graph=step.graph)
