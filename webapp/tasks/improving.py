"""A search for a better layout that can be watched, stopped, and taken or left."""

import threading
from collections.abc import Callable
from functools import partial

from finlab.analysis import Improvement, Progress, optimize_layout
from finlab.errors import FinlabError
from finlab.layout import Layout
from webapp.session.search_request import GOAL_WORDS, SearchRequest
from webapp.tasks.worker import Worker


class Improver:
    """One search at a time for one page."""

    def __init__(
        self, worker: Worker, post: Callable[[Callable[[], object]], None], changed: Callable[[], None]
    ) -> None:
        """Prepare.

        Args:
            worker: whose thread searches.
            post: brings a call to the event loop.
            changed: called there when there is progress.
        """
        self._worker, self._post, self._changed = worker, post, changed
        self._stop = threading.Event()
        self.start_layout: Layout | None = None
        """Where the search began; None while there is none."""
        self.progress: Progress | None = None
        """How far it is."""
        self.found: Improvement | None = None
        """What came of it."""
        self.error: str | None = None
        """Why nothing came of it."""

    @property
    def running(self) -> bool:
        """True from the start to the result."""
        return self.start_layout is not None and self.found is None and self.error is None

    def start(self, layout: Layout, request: SearchRequest) -> None:
        """Search from a layout; mirror pairs in it stay mirror pairs.

        Raises:
            FinlabError: a search is running, or a fin of the request is not there.
        """
        if self.running:
            raise FinlabError("a search is running already; cancel it first")
        bounds, goal = request.bounds(layout), GOAL_WORDS[request.goal]
        self._stop = stop = threading.Event()
        self.start_layout, self.progress, self.found, self.error = layout, None, None, None

        def report(progress: Progress) -> None:
            self._post(partial(self._take, stop, "progress", progress))

        def job() -> None:
            found = optimize_layout(
                layout,
                request.fins,
                bounds,
                goal,
                mission=request.wrenches,
                progress=report,
                cancelled=stop.is_set,
            )
            self._post(partial(self._take, stop, "found", found))

        def failed(text: str) -> None:
            self._post(partial(self._take, stop, "error", text))

        self._worker.submit((id(self), "search"), job, failed)

    def cancel(self) -> None:
        """Stop after the present round; what has been found by then is offered."""
        self._stop.set()

    def forget(self) -> None:
        """The result has been taken or left."""
        self._stop.set()
        self._stop = threading.Event()
        self.start_layout = self.progress = self.found = self.error = None

    def close(self) -> None:
        """Nobody wants to know any more."""
        self._stop.set()
        self._worker.forget((id(self), "search"))

    def _take(self, stop: threading.Event, name: str, value: object) -> None:
        if stop is self._stop:  # else it belongs to a search that was forgotten
            setattr(self, name, value)
            self._changed()
