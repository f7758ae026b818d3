"""Event loops for tests without one, and pages without a browser."""

import asyncio
import functools
import time
from collections.abc import Callable, Coroutine
from types import SimpleNamespace
from typing import Any

from tests.webapp.stand_in import load_stand_in
from webapp.tasks.background import EventLoop
from webapp.tasks.context import Context
from webapp.tasks.solver import Solver


class AtOnce(EventLoop):
    """Runs everything where it is posted from; its timers ring by hand."""

    def __init__(self) -> None:
        """Nothing is waiting."""
        self.ring: Callable[[], object] = lambda: None

    def post(self, act: Callable[[], object]) -> None:
        """Run it now."""
        act()

    def later(self, seconds: float, act: Callable[[], object]) -> Any:
        """Keep it until somebody rings."""
        self.ring = act
        return type("Timer", (), {"cancel": lambda _: None})()


def raised(error: Exception) -> None:
    """In place of a page that tells of faults."""
    raise error


def running() -> EventLoop:
    """The loop that runs, as a page uses it."""
    return EventLoop(asyncio.get_running_loop(), raised)


class AloneContext(Context):
    """Makes everything where it is asked to."""

    def make(self, work: Any, use: Callable[[Any], object], kind: Any = "") -> None:
        """Make it now."""
        self.do(lambda: use(work()))


def page_of(worker: Any, session: Any = None, **options: Any) -> Context:
    """A page that does all its work on one worker, with the stand-in allocator unless told otherwise."""
    workers: Any = SimpleNamespace(answers=worker, swims=worker, searches=worker, fits=worker)
    silent: dict[str, Any] = {
        "client": None,
        "solver": Solver(load=load_stand_in),
        "loop": AtOnce(),
        "do": lambda act: act(),
        "changed": lambda: None,
        "notify": lambda title, text, calm=False: None,
    }
    return AloneContext(session=session, workers=workers, **{**silent, **options})


def until(condition: Callable[[], bool]) -> None:
    """Wait for something."""
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


def in_loop(test: Callable[..., Coroutine[Any, Any, None]]) -> Callable[..., None]:
    """A test that runs in an event loop of its own."""

    @functools.wraps(test)
    def run(*arguments: Any, **named: Any) -> None:
        asyncio.run(test(*arguments, **named))

    return run
