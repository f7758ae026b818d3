"""What everything that works for one page is made with."""

from collections.abc import Callable
from dataclasses import dataclass

import viser

from webapp.session import Session
from webapp.tasks.background import EventLoop, Workers
from webapp.tasks.reading import Reading
from webapp.tasks.solver import Solver


@dataclass(frozen=True)
class Context:
    """One page, as its tasks and its scene see it."""

    client: viser.ClientHandle
    session: Session
    solver: Solver
    workers: Workers
    loop: EventLoop
    reading: Reading
    do: Callable[[Callable[[], object]], None]
    changed: Callable[[], None]
    """Renders the page; called on the loop when there is something new to show."""
    notify: Callable[..., None]
    """Shows a note: title and sentence, and whether it is `calm`; called on the loop."""
