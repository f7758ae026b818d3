"""The page as everything that works for it sees it."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import viser

from webapp.session import Session
from webapp.tasks.background import EventLoop, Workers
from webapp.tasks.solver import Solver

Made = TypeVar("Made")


@dataclass(frozen=True)
class Context:
    """One page."""

    client: viser.ClientHandle
    session: Session
    solver: Solver
    workers: Workers
    loop: EventLoop
    do: Callable[[Callable[[], object]], None]
    changed: Callable[[], None]
    """Renders the page; called on the loop when there is something new to show."""
    notify: Callable[..., None]
    """Shows a note: title and sentence, and whether it is `calm`; called on the loop."""

    def make(self, work: Callable[[], Made], use: Callable[[Made], object], kind: Hashable) -> None:
        """Do what takes time on a thread, and use what it gives on the loop, as an intent of the user. What
        waits gives way to a newer one of its `kind`."""

        def job() -> None:
            self.loop.post(partial(self.do, partial(use, work())))

        def refused(text: str) -> None:
            self.loop.post(partial(self.notify, "Not possible", text))

        self.workers.readers.submit((id(self), kind), job, refused)
