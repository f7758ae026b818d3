"""A search for a better layout that can be watched, stopped, and taken or left."""

import math
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

from finlab.analysis import Bounds, Improvement, Progress, optimize_layout
from finlab.errors import FinlabError
from finlab.layout import Layout
from webapp.session.room import Room
from webapp.session.search_request import GOAL_WORDS, SearchRequest
from webapp.tasks.background import Newest
from webapp.tasks.context import Context

APART_M = 0.02
"""Least distance between what two fins sweep."""
GRID = 0.001, math.radians(1.0)
"""What is proposed is round: steps of places [m] and shafts [rad]."""


@dataclass(frozen=True, eq=False)
class Search:
    """One search."""

    layout: Layout
    """Where it begins; mirror pairs in it stay mirror pairs."""
    goal: str
    """What to raise, as `optimize_layout` calls it."""
    bounds: Mapping[str, Bounds]
    """Where each fin that may move may go."""
    room: Room
    stop: threading.Event = field(default_factory=threading.Event)
    """Ends it after the present round."""


class Improver(Newest[Search, Improvement]):
    """One search at a time for one page."""

    def __init__(self, context: Context) -> None:
        """The page is rendered when there is progress."""
        super().__init__(context.loop, context.workers.searches, self._improve, context.changed)
        self.progress: Progress | None = None
        """How far it is."""

    def start(self, layout: Layout, request: SearchRequest) -> None:
        """Search from a layout.

        Raises:
            FinlabError: a search is running, or no fin may move.
        """
        if self.busy:
            raise FinlabError("a search is running already; cancel it first")
        room, goal = Room(layout, APART_M), GOAL_WORDS[request.goal]
        search = Search(layout, goal, request.bounds(layout), room)
        self.forget()
        self.ask(search)

    def cancel(self) -> None:
        """Stop after the present round; what has been found by then is offered."""
        if self.question is not None:
            self.question.stop.set()

    def forget(self) -> None:
        """The result has been taken or left, or the page has gone."""
        self.cancel()
        super().forget()
        self.progress = None

    def _improve(self, search: Search) -> Improvement:
        """On the worker's thread."""
        return optimize_layout(
            search.layout,
            tuple(search.bounds),
            search.bounds,
            search.goal,
            rule=search.room.broken,
            grid=GRID,
            progress=lambda progress: self._loop.post(partial(self._note, search, progress)),
            cancelled=search.stop.is_set,
        )

    def _note(self, search: Search, progress: Progress) -> None:
        if search is self.question:  # else it was forgotten
            self.progress = progress
            self._changed()
